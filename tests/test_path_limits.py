"""Limits along the path: chords between interpolation points (paper 004), and acceleration."""

from dataclasses import replace

import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motions import MILL, lines, wander
from numpy.testing import assert_allclose
from paths import arc, line, toolpath
from test_feedrate import assert_keeps, spline_path

from cnc_shape.arrays import frozen, frozen_integers
from cnc_shape.certificate import worst_violation
from cnc_shape.errors import OptionError
from cnc_shape.feedrate import rotary_only
from cnc_shape.kernels.path_limits import chord_speeds
from cnc_shape.kernels.speed_limits import speed_limits
from cnc_shape.kernels.time_law import backward
from cnc_shape.limits import Limits, PathLimits
from cnc_shape.planning import plan, planning
from cnc_shape.program import PathMode
from cnc_shape.smoothing import Smoothing, join_paths, smooth
from cnc_shape.trajectory import sample

SWIFT = [Limits(1e4, 1e6)] * 3  # axes that never limit
FEED, ERROR = 16.0, 1e-3  # mm/s, mm: the paper's


def circle(radius, laps=1, points=257):
    """A circle in XY as a C2 spline, whose curvature is 1/radius but for some millionths."""
    angle = np.linspace(0.0, 2 * np.pi * laps, laps * (points - 1) + 1)
    path, _ = spline_path(
        radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(angle.size)]), per_span=4
    )
    inner = slice(4 * 8, -4 * 8)  # the ends of the spline are those of no circle
    cells = path.cut(inner)
    stop = np.zeros(len(cells), np.bool_)
    stop[0] = True
    return replace(cells, stop=stop, u=frozen(cells.u - cells.u[0]))


def top_speed(path, limits, path_limits):
    profile = plan(path, limits, path_limits)
    assert worst_violation(profile, limits, 33, path_limits).worst <= 1e-6
    return profile.velocity.max()


@pytest.mark.parametrize("radius", [0.5, 2.0, 20.0])
@pytest.mark.parametrize("period", [1e-3, 8e-3])
def test_on_a_circle_the_feed_is_that_of_its_radius(radius, period):
    expected = 2 / period * np.sqrt(radius**2 - (radius - ERROR) ** 2)
    path = circle(radius)
    found = top_speed(path, SWIFT, PathLimits(interpolation_period=period, chord_error=ERROR))
    assert_allclose(found, expected, rtol=1e-4)


@pytest.mark.parametrize(
    ("period", "radius"), [(1e-3, 0.032), (2e-3, 0.128), (4e-3, 0.51), (8e-3, 2.05)]
)  # F 16 mm/s, h 1 um: nothing is limited unless rho < (F T)^2 / (8 h)
def test_the_feed_of_the_paper_is_limited_below_a_radius_only(period, radius):
    chord = PathLimits(interpolation_period=period, chord_error=ERROR)
    for factor, limited in ((0.95, True), (1.1, False)):
        path = circle(factor * radius)
        path = replace(path, feed_rate=frozen(np.full(len(path), FEED)))
        found = top_speed(path, [Limits(1e4, 1e9)] * 3, chord)
        assert (found < 0.99 * FEED) == limited
        assert_allclose(found, min(FEED, naive.chord_speed(1 / (factor * radius), period, ERROR)), rtol=1e-3)


def test_a_programmed_arc_is_run_through_at_nearly_the_speed_of_its_radius():
    """Its polygon, made smooth within 0.01 mm, is curved by a few per cent more here and there."""
    period = 8e-3
    path = smooth(
        toolpath(line(5, 0), arc((5, 0, 0), (0, 0, 0), 2 * np.pi, feed_rate=200.0)), Smoothing(0.01)
    )
    chord = PathLimits(interpolation_period=period, chord_error=ERROR)
    profile = plan(path, SWIFT, chord)
    expected = 2 / period * np.sqrt(2 * 5 * ERROR - ERROR**2)
    speed = np.median(profile.velocity[profile.path.line[profile.cell] == path.line[-1]])
    assert 0.97 * expected <= speed <= 1.001 * expected


def test_a_curve_smaller_than_the_chord_error_is_run_through_in_chords_of_twice_that():
    assert_allclose(naive.chord_speed(1 / ERROR, 1e-3, ERROR), 2 * ERROR / 1e-3)
    found = top_speed(circle(0.2 * ERROR), [Limits(1e4, 1e9)] * 3, PathLimits(np.inf, 1e-3, ERROR))
    assert_allclose(found, 2 * ERROR / 1e-3, rtol=1e-4)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.integers(0, 10**6), st.sampled_from([0.0, 1e-3, 0.3, 3.0]), st.sampled_from([3, 5]))
def test_the_tightest_curve_of_a_cell_is_that_of_a_dense_scan(seed, bend, d):
    rng = np.random.default_rng(seed)
    rows, length = rng.normal(size=(4, d)), 10 ** rng.uniform(-2, 1)
    rows[1] /= np.linalg.norm(rows[1, :3])
    rows[2:] *= bend * np.array([[1.0], [1.0 / length]]) / length
    period, error, feed = 1e-3, 1e-3, 10 ** rng.uniform(0, 4)
    found = chord_speeds(
        frozen(rows[None]), frozen([length]), frozen([feed]), frozen_integers([0]), period, error
    )[0]
    at = np.linspace(0.0, length, 2001)
    for _ in range(4):  # closer and closer about the tightest place
        curvature = naive.curvatures(rows, at)
        near = at[np.argmax(curvature)]
        width = at[1] - at[0]
        at = np.linspace(max(0.0, near - width), min(length, near + width), 201)
    assert_allclose(found, min(feed, naive.chord_speed(curvature.max(), period, error)), rtol=1e-6)


def test_rotary_axes_alone_know_no_chords_and_no_path_acceleration():
    axes = ("x", "y", "z", "a")
    limits = [*MILL, Limits(1.5, 15.0)]
    path = smooth(lines([[0, 0, 0, 0], [0, 0, 0, 3.0]], 1.0, axes=axes), Smoothing(0.01))
    tight = PathLimits(1e-3, 1.0, 1e-6)
    assert plan(path, limits, tight).end_time == plan(path, limits).end_time
    mixed = smooth(
        lines([[0, 0, 0, 0], [5, 0, 0, 1], [5, 0, 0, 2], [5, 5, 0, 2]], 50.0, axes=axes), Smoothing(0.01)
    )
    slow = PathLimits(100.0, 1e-3, 1e-3)
    profile = plan(mixed, limits, slow)
    assert worst_violation(profile, limits, 33, slow).worst <= 1e-6


@pytest.mark.parametrize("heading", [0.0, 0.4])
def test_on_a_straight_the_path_acceleration_is_the_ramp(heading):
    path = smooth(lines([[0, 0], [40 * np.cos(heading), 40 * np.sin(heading)]], 50.0), Smoothing(0.01))
    profile = plan(path, MILL, PathLimits(160.0))
    assert_allclose(profile.end_time, 40 / 50 + 50 / 160, rtol=1e-9)
    assert plan(path, MILL, PathLimits(1e6)).end_time == plan(path, MILL).end_time


def test_on_a_circle_the_path_acceleration_is_the_ramp_whatever_the_axes_could():
    path = circle(20.0)
    path = replace(path, feed_rate=frozen(np.full(len(path), 30.0)))
    profile = plan(path, SWIFT, PathLimits(160.0))
    first = profile.acceleration[1:20] * np.linalg.norm(path.coefficients[0, 1])
    assert_allclose(first, 160.0, rtol=1e-4)
    length = (path.length * np.linalg.norm(path.coefficients[:, 1], axis=1)).sum()
    assert_allclose(profile.end_time, length / 30 + 30 / 160, rtol=1e-4)


def test_the_scan_is_the_solution_of_its_linear_programs_with_the_acceleration_along_the_path():
    path = smooth(lines([[0, 0], [3, 1], [3.5, 4], [5, 4.2], [5.4, 4.1]], 80.0), Smoothing(0.1))
    velocity, acceleration = frozen([200.0] * 3), frozen([2000.0] * 3)
    limit_v2, straight = speed_limits(
        path.coefficients, path.length, path.feed_rate, rotary_only(path), velocity, acceleration
    )
    straight[:] = 0.0  # the linear programs know curved cells alone
    along = frozen(np.full(len(path), 900.0))
    reach, _ = backward(
        path.coefficients, path.length, path.stop, limit_v2, straight, acceleration, along, np.inf
    )
    slow_reach, _ = naive.fastest(path, limit_v2, acceleration, 900.0)
    assert_allclose(reach, slow_reach, rtol=1e-6, atol=1e-6)


@settings(max_examples=15, deadline=None, derandomize=True)
@given(
    st.integers(0, 10**6),
    st.sampled_from([PathLimits(160.0), PathLimits(700.0, 2e-3, 1e-3), PathLimits(np.inf, 8e-3, 1e-3)]),
    st.sampled_from([0.001, 0.01, 0.5]),
)
def test_random_programs_keep_every_limit(seed, path_limits, tolerance):
    path = smooth(wander(np.random.default_rng(seed), 300), Smoothing(tolerance))
    profile = plan(path, MILL, path_limits)
    assert_keeps(profile, MILL, 9)
    found = worst_violation(profile, MILL, 9, path_limits)
    assert found.path_acceleration <= 1e-6
    assert found.chord <= 1e-6
    assert np.isfinite(profile.end_time)
    assert profile.end_time >= plan(path, MILL).end_time * (1 - 1e-9)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.integers(0, 10**6), st.sampled_from([2, 3, 4]))
def test_cells_that_turn_back_on_themselves_keep_every_limit(seed, per_span):
    """A spline to and fro in a few cells a span: there is no direction that all of a cell goes along."""
    points = np.random.default_rng(seed).normal(size=(6, 3)) * [1.0, 0.5, 0.1]
    points[1::2, 0] += 10.0
    path, _ = spline_path(points, per_span=per_span)
    path_limits = PathLimits(300.0)
    profile = plan(path, SWIFT, path_limits)
    assert worst_violation(profile, SWIFT, 33, path_limits).worst <= 1e-6
    assert profile.end_time < 10.0


def smooth_program(seed):
    """A closed curve of five harmonics in 3-D, in short lines, at 16 or 48 mm/s."""
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * np.linspace(0.0, 1.0, 2000)[:, None]
    points = sum(
        (np.cos(k * angle) * rng.normal(size=3) + np.sin(k * angle) * rng.normal(size=3)) * 4.0 / k
        for k in range(1, 6)
    )
    return lines(points, FEED * rng.choice([1, 3]))


@settings(max_examples=8, deadline=None, derandomize=True)
@given(
    st.integers(0, 10**6),
    st.sampled_from([(8e-3, 1e-3), (2e-3, 1e-3), (8e-3, 1e-4)]),
    st.sampled_from([160.0, np.inf]),
)
def test_chords_between_interpolation_points_keep_their_error(seed, chord, acceleration):
    """What the law is for, measured: the largest distance between the path and the chords over it."""
    period, error = chord
    path = smooth(smooth_program(seed), Smoothing(0.001))
    profile = plan(path, MILL, PathLimits(acceleration, period, error))
    measured = naive.chord_errors(sample(profile, period / 20).position, 20)
    assert measured.max() <= 1.02 * error
    free = naive.chord_errors(sample(plan(path, MILL), period / 20).position, 20)
    assert measured.max() <= free.max()


def test_a_chord_over_an_exact_stop_cuts_its_corner():
    """The law knows the path's curvature alone, and a stop has none: only a rest of a period is sampled."""
    corner = lines([[0, 0], [10, 0], [10, 10]], 16.0, PathMode.EXACT_STOP)
    profile = plan(smooth(corner, Smoothing(0.01)), MILL, PathLimits(160.0, 8e-3, ERROR))
    measured = naive.chord_errors(sample(profile, 8e-3 / 20).position, 20)
    assert ERROR / 2 <= measured.max() <= 160.0 * 8e-3**2 / 8


def test_the_certificate_is_that_of_a_plain_loop():
    path_limits = PathLimits(300.0, 8e-3, 1e-3)
    path = smooth(wander(np.random.default_rng(1), 100), Smoothing(0.01))
    for made_for in (path_limits, PathLimits()):
        profile = plan(path, MILL, made_for)
        found = worst_violation(profile, MILL, 9, path_limits)
        slow = naive.path_excesses(profile, path_limits, 9) - 1.0
        assert_allclose([found.path_acceleration, found.chord], slow, rtol=1e-9, atol=1e-12)
    assert found.path_acceleration > 0.1
    assert found.chord > 0.1
    assert found.worst == max(found.path_acceleration, found.chord)


@pytest.mark.parametrize("gentle", [False, True])
def test_chunks_of_cells_do_not_change_a_bit(monkeypatch, gentle):
    monkeypatch.setattr("cnc_shape.feedrate.PATIENCE", 1)
    path_limits = PathLimits(400.0, 4e-3, 1e-3)
    path = smooth(wander(np.random.default_rng(3), 2000), Smoothing(0.01))
    factor = frozen(np.random.default_rng(4).uniform(0.3, 1.0, len(path))) if gentle else None
    _, once = planning(MILL, factor, path_limits)(None, path, True)
    assert worst_violation(once, MILL, 9, path_limits).worst <= 1e-6
    for size in (97, 1000):
        step, state, parts = planning(MILL, factor, path_limits), None, []
        for first in range(0, len(path), size):
            state, profile = step(state, path.cut(slice(first, first + size)), first + size >= len(path))
            parts.append(profile)
        assert len(parts[0]) < len(once)
        assert len(join_paths([profile.path for profile in parts])) == len(path)
        for name in ("time", "duration", "u", "velocity", "acceleration"):
            np.testing.assert_array_equal(
                np.concatenate([getattr(p, name) for p in parts]), getattr(once, name)
            )


def test_without_path_limits_the_motion_is_the_same_to_the_bit():
    path = smooth(wander(np.random.default_rng(7), 500), Smoothing(0.01))
    plain, idle = plan(path, MILL), plan(path, MILL, PathLimits(np.inf, 1e-6, 10.0))
    for name in ("time", "u", "velocity", "acceleration"):
        np.testing.assert_array_equal(getattr(plain, name), getattr(idle, name))


@pytest.mark.parametrize(
    "given_limits",
    [
        (0.0,),
        (-1.0,),
        (np.nan,),
        (np.inf, 1e-3),
        (np.inf, None, 1e-3),
        (np.inf, 0.0, 1e-3),
        (1.0, 1e-3, np.nan),
    ],
)
def test_path_limits_that_no_motion_can_keep_are_refused(given_limits):
    with pytest.raises(OptionError):
        PathLimits(*given_limits)
