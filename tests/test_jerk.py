"""Time laws under a jerk limit: they keep every limit, and how much slower than possible they are."""

from dataclasses import replace

import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motions import MILL, lines, refined, wander
from numpy.testing import assert_allclose
from paths import arc, dwell, line, toolpath
from test_feedrate import SQUARE

from cnc_shape.arrays import frozen
from cnc_shape.certificate import worst_violation
from cnc_shape.errors import InfeasibleError
from cnc_shape.feedrate import Profile, scan_path
from cnc_shape.kernels.jerk_rounding import round_off
from cnc_shape.limits import Limits
from cnc_shape.planning import plan
from cnc_shape.program import PathMode
from cnc_shape.readers import read_program
from cnc_shape.smoothing import Smoothing, smooth
from cnc_shape.toolpath import build_toolpath
from cnc_shape.trajectory import sample

MILL_J = [Limits(200.0, 2000.0, 5e4)] * 3  # j = 25 a
MILL_2J = [Limits(200.0, 2000.0, 1e5)] * 3
UNLIKE = [Limits(200.0, 2000.0, 5e4), Limits(150.0, 1500.0, 3e4), Limits(50.0, 400.0, 8e3)]


def assert_keeps(profile: Profile, limits) -> None:
    found = worst_violation(profile, limits, 129)
    assert found.worst <= 1e-6
    assert found.jerk <= 1e-3
    assert found.gap <= 1e-9
    assert found.jump <= 1e-9
    assert found.step <= 1e-6 * max(limit.acceleration for limit in limits)


def planned(whole, limits=MILL_J, tolerance=0.01) -> Profile:
    return plan(smooth(whole, Smoothing(tolerance)), limits)


def test_rest_to_rest_is_the_closed_form():
    """20,000 moves over eight decades of length, where neither, one or both of v and a are reached."""
    rng = np.random.default_rng(1)
    parts = 200
    for _ in range(20_000 // parts):
        v, a, j = 10 ** rng.uniform([0, 1, 2], [3, 5, 7])
        d = 10 ** rng.uniform(-4, 4, parts)
        x = np.concatenate([[0.0], np.cumsum(d * (-1.0) ** np.arange(parts))])
        limits = [Limits(2000.0, a, j)] * 3
        profile = planned(lines(x[:, None] * [1.0, 0.0, 0.0], v), limits)
        starts = np.flatnonzero(profile.path.stop)
        begin = profile.time[np.searchsorted(profile.cell, starts)]
        expected = [naive.rest_to_rest(h, v, a, j) for h in profile.path.length[starts[:-1]]]
        assert_allclose(np.diff(begin), expected, rtol=1e-9, atol=1e-12 * begin[-1])
        assert_keeps(profile, limits)


def square(tolerance, jerk, mode=PathMode.BLEND):
    limits = [Limits(1000.0, 500.0, jerk)] * 3
    profile = planned(lines(SQUARE, 50.0, mode), limits, tolerance)
    assert_keeps(profile, limits)
    return profile.end_time


def test_square_numbers():
    """20 mm, F 50 mm/s, 500 mm/s^2, j = 50 a. At rest in the corners the closed form: 4 (20/50 + 50/500 + 500/25000)."""
    assert_allclose(square(0.01, 25_000.0, PathMode.EXACT_STOP), 2.08, rtol=1e-12)
    assert square(0.035, 25_000.0) <= 2.08
    assert square(0.35, 25_000.0) <= 1.825  # linear programs: 1.822


@pytest.mark.parametrize("tolerance", [0.035, 0.35])
def test_with_a_high_jerk_limit_it_is_the_law_without(tolerance):
    limits = [Limits(1000.0, 500.0)] * 3
    path = smooth(lines(SQUARE, 50.0), Smoothing(tolerance))
    assert_allclose(square(tolerance, 1e9), plan(path, limits).end_time, rtol=1e-4)
    # that law keeps one acceleration over each cell; in an eighth of them it is the fastest but for 1e-4
    assert square(tolerance, 1e5) > plan(refined(path, 8), limits).end_time


def test_without_jerk_limits_it_is_the_law_without_bit_for_bit():
    path = smooth(wander(np.random.default_rng(7), 200), Smoothing(0.01))
    one, other = plan(path, MILL), scan_path(path, MILL)
    for name in ("time", "duration", "u", "velocity", "acceleration", "jerk", "cell"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_a_straight_of_100_000_blocks_is_one_move():
    path = smooth(
        lines(np.column_stack([0.01 * np.arange(100_001), np.zeros(100_001)]), 180.0), Smoothing(0.01, 0, 0)
    )
    profile = plan(path, MILL_J)
    assert len(path) > 50_000
    assert_allclose(profile.end_time, naive.rest_to_rest(1000.0, 180.0, 2000.0, 5e4), rtol=1e-8)


@pytest.mark.parametrize(
    "name", ["lcnc_boat_xyzbc.ngc", "lcnc_lathe_pawn.ngc", "ugs_no_spaces.gcode", "lcnc_cds.ngc"]
)
@pytest.mark.parametrize("limits", [MILL_J, UNLIKE], ids=["mill", "unlike"])
def test_real_programs_keep_every_limit(shared, name, limits):
    whole = build_toolpath(read_program(shared / "data" / "gcode" / "programs" / name))
    every = [*limits, *[Limits(3.0, 30.0, 750.0)] * 3][: len(whole.axes)]
    profile = planned(whole, every)
    assert_keeps(profile, every)
    fastest = plan(profile.path, [replace(limit, jerk=np.inf) for limit in every]).end_time
    assert 1.0 - 1e-4 <= profile.end_time / fastest <= 1.06


def corners(seed, n=10):
    return np.vstack([[0, 0], np.cumsum(np.random.default_rng(seed).uniform(-15, 15, (n + 1, 2)), axis=0)])


@settings(max_examples=40)
@given(
    st.integers(0, 10**6),
    st.sampled_from([MILL_J, MILL_2J, UNLIKE]),
    st.sampled_from([0.003, 0.03, 0.3]),
    st.sampled_from([20.0, 200.0]),
)
def test_random_corners_keep_every_limit(seed, limits, tolerance, feed):
    profile = planned(lines(corners(seed), feed), limits, tolerance)
    assert_keeps(profile, limits)
    assert (profile.duration >= 0.0).all()


@settings(max_examples=12)
@given(st.integers(0, 10**6), st.sampled_from([MILL_J, UNLIKE]))
def test_random_programs_keep_every_limit(seed, limits):
    profile = planned(wander(np.random.default_rng(seed), 300), limits)
    assert_keeps(profile, limits)


@settings(max_examples=25)
@given(st.integers(0, 10**6))
def test_it_is_never_faster_than_the_law_without_jerk_limit(seed):
    path = refined(smooth(lines(corners(seed), 150.0), Smoothing(0.1)), 4)
    assert plan(path, MILL_J).end_time >= plan(path, MILL).end_time * (1.0 - 1e-3)


@settings(max_examples=10)
@given(st.integers(0, 10**6))
def test_more_jerk_is_faster(seed):
    path = smooth(lines(corners(seed), 150.0), Smoothing(0.1))
    times = [plan(path, [Limits(200.0, 2000.0, j)] * 3).end_time for j in (1e4, 5e4, 2.5e5, 1e7)]
    assert times == sorted(times, reverse=True)


def test_sampled_accelerations_change_no_faster_than_the_jerk_limit():
    profile = planned(lines(corners(3), 200.0), tolerance=0.1)
    trajectory = sample(profile, 2e-5)
    jerk = np.abs(np.diff(trajectory.acceleration, axis=0)).max() / 2e-5
    assert 0.99 <= jerk / 5e4 <= 1.001
    steps = np.diff(trajectory.velocity, axis=0) / 2e-5
    middle = 0.5 * (trajectory.acceleration[1:] + trajectory.acceleration[:-1])
    assert np.abs(steps - middle).max() <= 5e4 * 2e-5


def test_end_points_are_exact_and_travel_adds_up():
    points = corners(5)
    profile = planned(lines(points, 200.0), tolerance=0.1)
    assert_allclose(profile.path.coefficients[profile.cell[-1], 0, :2], points[-1], rtol=0, atol=1e-9)
    e = profile.duration
    moved = e * (profile.velocity + e * (profile.acceleration / 2 + e * profile.jerk / 6))
    assert_allclose(moved.sum(), profile.path.length.sum(), rtol=1e-12)


def test_dwells_and_stops_rest():
    profile = planned(toolpath(dwell(0.25), line(10, 0), dwell(0.5), line(20, 0), dwell(1.0)))
    still = (profile.velocity == 0.0) & (profile.acceleration == 0.0) & (profile.jerk == 0.0)
    assert_allclose(profile.duration[still], [0.25, 0.5, 1.0])
    assert_allclose(profile.end_time, 1.75 + 2 * naive.rest_to_rest(10.0, 20.0, 2000.0, 5e4), rtol=1e-12)
    assert_keeps(profile, MILL_J)


def test_tangent_arcs_run_through():
    profile = planned(
        toolpath(line(20, 0), arc((25, 5, 0), (20, 5, 0), np.pi / 2), line(25, 20)), tolerance=0.05
    )
    assert_keeps(profile, MILL_J)
    assert profile.velocity[1:-1].min() > 0.0
    assert_allclose(profile.end_time, naive.rest_to_rest(35 + 5 * np.pi / 2, 20.0, 2000.0, 5e4), rtol=1e-3)


def test_a_change_of_feed_on_a_straight_and_in_a_hat():
    straight = planned(lines([[0, 0], [10, 0], [20, 0]], [30.0, 90.0]))
    hat = planned(lines([[0, 0], [10, 0], [20, 1], [30, 0]], [30.0, 90.0, 20.0]))
    for profile in (straight, hat):
        assert_keeps(profile, MILL_J)


def test_rotary_axes_keep_their_own_limits():
    limits = [*MILL_J, Limits(1.5, 15.0, 300.0)]
    axes = ("x", "y", "z", "a")
    alone = planned(lines([[0, 0, 0, 0], [0, 0, 0, 3.0]], 1.0, axes=axes), limits)
    assert_allclose(alone.end_time, naive.rest_to_rest(3.0, 1.0, 15.0, 300.0), rtol=1e-9)
    rng = np.random.default_rng(2)
    steps = rng.normal(size=(200, 4)) * [1.0, 1.0, 0.2, 0.05]
    steps[::20, :3] = 0.0
    steps[1::20, 3] = 0.0
    mixed = planned(lines(np.vstack([np.zeros(4), np.cumsum(steps, axis=0)]), 50.0, axes=axes), limits)
    assert_keeps(mixed, limits)


def test_an_axis_without_a_jerk_limit_beside_one_with():
    limits = [Limits(200.0, 2000.0), Limits(200.0, 2000.0, 5e4), Limits(200.0, 2000.0)]
    profile = planned(lines(corners(8), 200.0), limits, 0.1)
    assert_keeps(profile, [replace(limit, jerk=min(limit.jerk, 2e9)) for limit in limits])
    times = [planned(lines(corners(8), 200.0), bounds, 0.1).end_time for bounds in (MILL, MILL_J)]
    assert times[0] < profile.end_time < times[1]


def test_the_certificate_is_that_of_a_plain_loop():
    profile = planned(toolpath(line(3, 0), arc((5, 2, 0), (3, 2, 0), np.pi / 2), line(5, 6), line(8, 6.5)))
    found = worst_violation(profile, MILL_J, 17)
    slow = naive.law_loads(profile, MILL_J, 17) - 1.0
    assert_allclose([found.velocity, found.acceleration, found.jerk, found.feed], slow, rtol=0, atol=1e-12)


def test_the_certificate_sees_what_is_wrong():
    profile = planned(lines(SQUARE))
    assert worst_violation(replace(profile, velocity=frozen(1.01 * profile.velocity)), MILL_J).feed > 9e-3
    steeper = worst_violation(replace(profile, acceleration=frozen(1.01 * profile.acceleration)), MILL_J)
    assert steeper.step > 0.0
    assert steeper.acceleration > 9e-3
    assert worst_violation(replace(profile, jerk=frozen(1.01 * profile.jerk)), MILL_J).jerk > 9e-3
    shifted = replace(profile, u=frozen(profile.u + 1e-6 * (np.arange(len(profile)) % 2)))
    assert worst_violation(shifted, MILL_J).gap > 9e-7


def test_what_no_motion_can_satisfy_names_its_line():
    still = [Limits(200.0, 2000.0, 5e4), Limits(200.0, 2000.0, 0.0), Limits(200.0, 2000.0, 5e4)]
    with pytest.raises(InfeasibleError, match="Y moves, but its jerk limit is 0") as caught:
        planned(lines(SQUARE), still)
    assert caught.value.line in (1, 2)
    with pytest.raises(InfeasibleError, match="feed rate") as caught:
        planned(lines(SQUARE, [10.0, 10.0, 0.0, 10.0]))
    assert caught.value.line == 3


@pytest.mark.parametrize("seed", range(4))
def test_rounding_finds_the_highest_law_below_an_envelope(seed):
    """Rising and falling phases with steps between them, on one straight; the twin looks at every point."""
    rng = np.random.default_rng(seed)
    jerk = 2e4
    phases = [[0.06, 0.0, 0.0, 0.0, jerk]]  # from rest
    place, v, a = jerk * 0.06**3 / 6, jerk * 0.06**2 / 2, 300.0
    for _ in range(6):
        duration, b = rng.uniform(0.005, 0.05), rng.choice([0.0, rng.uniform(0.0, jerk)])
        end_v = v + duration * (a + duration * b / 2)
        if end_v < 5.0:
            b, duration = 0.0, 0.5 * v / abs(a)
            end_v = v + duration * a
        phases.append([duration, place, v, a, b])
        place += duration * (v + duration * (a / 2 + duration * b / 6))
        v, a = end_v, a + b * duration - rng.uniform(0.0, 900.0)
    n = len(phases)
    law, law_cell = np.empty((4 * n + 2, 5)), np.empty(4 * n + 2, np.int64)
    count = round_off(
        np.array(phases), np.zeros(n, np.int64), n, np.array([0.0, place]), np.array([jerk]), law, law_cell
    )
    dense = [piece_points(phase, 100) for phase in phases]
    points, speeds = (np.concatenate(column) for column in zip(*dense, strict=True))
    ours = [piece_points(phase, 100) for phase in law[:count]]
    own_points, own_speeds = (np.concatenate(column) for column in zip(*ours, strict=True))
    for at in np.linspace(0.1, 0.97, 6) * place:
        expected = naive.highest_below(points, speeds, jerk, at)
        assert_allclose(
            np.interp(at, own_points, own_speeds), expected, rtol=2e-3
        )  # the twin's points are as near


def piece_points(phase, count):
    duration, place, v, a, b = phase
    t = np.linspace(0.0, duration, count)
    return place + t * (v + t * (a / 2 + t * b / 6)), v + t * (a + t * b / 2)


def test_a_corner_between_short_straights_is_hardly_slower_than_a_rest_in_it():
    points = [[0, 0], [0.0055069, 0.0012751], [0.0041093, 0.0013945]]
    blend, rest = (
        plan(smooth(lines(points, 1.7, mode), Smoothing(0.00146)), MILL_J).end_time
        for mode in (PathMode.BLEND, PathMode.EXACT_STOP)
    )
    assert blend <= 1.02 * rest


@pytest.mark.parametrize(
    ("tolerance", "limits"), [(1e-4, MILL_J), (1e-3, [Limits(500.0, 2000.0, 2000.0)] * 3)]
)
def test_an_arc_of_many_cells_is_run_through(tolerance, limits):
    whole = toolpath(arc((0, 151.38, 0), (0, 75.69, 0), np.pi, feed_rate=100.0))
    profile = planned(whole, limits, tolerance)
    assert_keeps(profile, limits)
    assert profile.velocity[1:-1].min() > 0.0


def test_a_bend_that_takes_all_of_the_acceleration_at_its_end_is_not_crept_up_to():
    """Axes as unlike as these: an exact stop in every corner takes no less than two thirds of the time."""
    limits = [Limits(50.0, 5000.0, 6.7e5), Limits(200.0, 2000.0, 1e5), Limits(1990.0, 0.441, 87.0)]
    for seed in range(40):
        whole = wander(np.random.default_rng(seed), 20)
        profile = planned(whole, limits, 0.003)
        assert_keeps(profile, limits)
        free = plan(profile.path, [replace(limit, jerk=np.inf) for limit in limits]).end_time
        assert profile.end_time <= 6.0 * free
