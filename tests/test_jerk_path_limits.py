"""Limits along the path hold under a jerk limit of the axes as they do without (`test_path_limits.py`)."""

from dataclasses import replace

import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motions import MILL, lines, wander
from numpy.testing import assert_allclose
from test_jerk import MILL_J, UNLIKE
from test_path_limits import circle

from cnc_shape.arrays import frozen
from cnc_shape.certificate import worst_violation
from cnc_shape.limits import Limits, PathLimits
from cnc_shape.planning import plan, planning
from cnc_shape.smoothing import Smoothing, smooth

SWIFT = [Limits(1e4, 1e6, 1e8)] * 3


def assert_keeps(profile, limits, path_limits, points=33):
    found = worst_violation(profile, limits, points, path_limits)
    assert found.worst <= 1e-6
    assert found.jerk <= 1e-3


@pytest.mark.parametrize("heading", [0.0, 0.4])
def test_on_a_straight_the_path_acceleration_is_that_of_the_closed_form(heading):
    ends = [[0, 0], [40 * np.cos(heading), 40 * np.sin(heading)]]
    path = smooth(lines(ends, 50.0), Smoothing(0.01))
    profile = plan(path, MILL_J, PathLimits(160.0))
    steep = 5e4 / max(np.cos(heading), np.sin(heading))
    assert_allclose(profile.end_time, naive.rest_to_rest(40.0, 50.0, 160.0, steep), rtol=1e-9)
    assert plan(path, MILL_J, PathLimits(1e6)).end_time == plan(path, MILL_J).end_time


def test_on_a_circle_the_path_acceleration_is_the_ramp_whatever_the_axes_could():
    path = circle(20.0)
    path = replace(path, feed_rate=frozen(np.full(len(path), 30.0)))
    profile = plan(path, SWIFT, PathLimits(160.0))
    assert_keeps(profile, SWIFT, PathLimits(160.0))
    length = (path.length * np.linalg.norm(path.coefficients[:, 1], axis=1)).sum()
    assert_allclose(profile.end_time, length / 30 + 30 / 160, rtol=1e-3)


@pytest.mark.parametrize("period", [1e-3, 8e-3])
def test_on_a_circle_the_feed_is_that_of_its_radius(period):
    radius, error = 2.0, 1e-3
    chords = PathLimits(interpolation_period=period, chord_error=error)
    profile = plan(circle(radius), SWIFT, chords)
    assert_keeps(profile, SWIFT, chords)
    expected = 2 / period * np.sqrt(radius**2 - (radius - error) ** 2)
    assert_allclose(profile.velocity.max(), expected, rtol=1e-4)


@settings(max_examples=12, deadline=None, derandomize=True)
@given(
    st.integers(0, 10**6),
    st.sampled_from([PathLimits(160.0), PathLimits(700.0, 2e-3, 1e-3), PathLimits(np.inf, 8e-3, 1e-3)]),
    st.sampled_from([0.001, 0.01, 0.5]),
    st.sampled_from([MILL_J, UNLIKE]),
)
def test_random_programs_keep_every_limit(seed, path_limits, tolerance, limits):
    path = smooth(wander(np.random.default_rng(seed), 200), Smoothing(tolerance))
    profile = plan(path, limits, path_limits)
    assert_keeps(profile, limits, path_limits, 129)
    assert (naive.path_excesses(profile, path_limits, 33) <= 1.0 + 2e-6).all()
    assert profile.end_time >= plan(path, limits).end_time * (1 - 0.02)


def test_rotary_axes_alone_know_no_path_acceleration():
    axes, limits = ("x", "y", "z", "a"), [*MILL_J, Limits(1.5, 15.0, 300.0)]
    alone = smooth(lines([[0, 0, 0, 0], [0, 0, 0, 3.0]], 1.0, axes=axes), Smoothing(0.01))
    assert plan(alone, limits, PathLimits(1e-3)).end_time == plan(alone, limits).end_time
    mixed = smooth(
        lines([[0, 0, 0, 0], [5, 0, 0, 1], [5, 0, 0, 2], [5, 5, 0, 2]], 50.0, axes=axes), Smoothing(0.01)
    )
    slow = PathLimits(100.0, 1e-3, 1e-3)
    assert_keeps(plan(mixed, limits, slow), limits, slow)


def test_with_a_high_jerk_limit_it_is_the_law_without():
    path = smooth(lines([[0, 0], [20, 0], [20, 20], [0, 20]], 50.0), Smoothing(0.3))
    limits, path_limits = [Limits(1000.0, 500.0, 1e8)] * 3, PathLimits(300.0)
    fast = plan(path, [Limits(1000.0, 500.0)] * 3, path_limits).end_time
    assert_allclose(plan(path, limits, path_limits).end_time, fast, rtol=2e-3)


def test_an_equal_gentleness_everywhere_is_that_of_lower_limits():
    """With the factor g, ``q/g`` at ``F/sqrt(g)``: limits times g, feeds times its square root."""
    g = 0.5
    path = smooth(wander(np.random.default_rng(2), 200), Smoothing(0.01))
    _, gentle = planning(MILL_J, frozen(np.full(len(path), g)))(None, path, True)
    lower = [Limits(g * 200.0, g * 2000.0, g * 5e4)] * 3
    slow = plan(replace(path, feed_rate=frozen(np.sqrt(g) * path.feed_rate)), lower)
    assert_allclose(gentle.end_time, slow.end_time, rtol=1e-4)
    assert worst_violation(gentle, lower, 33).worst <= 1e-6


def test_gentle_cells_are_run_through_gently_and_the_others_are_not():
    path = smooth(wander(np.random.default_rng(3), 300), Smoothing(0.01))
    factor = np.ones(len(path))
    factor[len(path) // 3 : len(path) // 2] = 0.4
    _, gentle = planning(MILL_J, frozen(factor))(None, path, True)
    fast = plan(path, MILL_J)
    assert worst_violation(gentle, MILL_J, 33).worst <= 1e-6
    assert fast.end_time < gentle.end_time < fast.end_time / 0.4
    slowed = gentle.cell[np.abs(gentle.acceleration) > 0.4 * 2000.0 * 1.5]
    assert (factor[slowed] == 1.0).all()


def test_more_jerk_is_faster_down_to_the_law_without_a_limit():
    """Which has one acceleration in each cell, so on coarse cells it is not the fastest there is."""
    path = smooth(wander(np.random.default_rng(5), 200), Smoothing(0.01))
    times = [plan(path, [Limits(200.0, 2000.0, j)] * 3).end_time for j in (1e4, 5e4, 1e6, 1e8)]
    assert times == sorted(times, reverse=True)
    assert_allclose(times[-1], plan(path, MILL).end_time, rtol=5e-3)
