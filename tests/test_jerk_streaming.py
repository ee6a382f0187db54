"""A law under a jerk limit does not depend on chunks, and what it holds back is a few stopping distances."""

import naive
import numpy as np
import pytest
from motions import lines, wander
from numpy.testing import assert_allclose
from test_jerk import MILL_J, assert_keeps

from cnc_shape import jerk
from cnc_shape.arrays import frozen
from cnc_shape.certificate import worst_violation
from cnc_shape.feedrate import rotary_only
from cnc_shape.jerk import PATIENCE, TOLERANCES, WINDOW, jerk_planning
from cnc_shape.kernels.jerk_rescue import slow_law
from cnc_shape.kernels.speed_limits import speed_limits
from cnc_shape.limits import NO_PATH_LIMITS, Limits, PathLimits
from cnc_shape.planning import plan
from cnc_shape.smoothing import Smoothing, join_paths, smooth

COLUMNS = ("time", "duration", "u", "velocity", "acceleration", "jerk")
PLANNED, CALMED, MERGED, RESTS, SLOWED = range(5)  # of what a state counts


def in_chunks(path, limits, size, gentleness=None, path_limits=NO_PATH_LIMITS):
    """Profiles of a path in chunks of `size` cells; what was counted; the most cells held back."""
    step, state, profiles, held, counts = jerk_planning(limits, gentleness, path_limits), None, [], 0, None
    for first in range(0, len(path), size):
        state, profile = step(state, path.cut(slice(first, first + size)), first + size >= len(path))
        profiles.append(profile)
        if state:
            held, counts = max(held, sum(len(part) for part in state.parts)), state.counts
    return profiles, counts, held


def assert_same_law(parts, once):
    assert join_paths([part.path for part in parts]).u.size == len(once.path)
    for name in COLUMNS:
        np.testing.assert_array_equal(
            np.concatenate([getattr(part, name) for part in parts]), getattr(once, name), err_msg=name
        )


def spiral(turns, pitch=0.1, segments=60):
    angle = np.linspace(0.0, 2 * np.pi * turns, int(turns * segments))
    return (1.0 + pitch * angle / (2 * np.pi))[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


@pytest.fixture
def small_windows(monkeypatch):
    """Windows that a short path has many of, whatever the stopping distance."""
    monkeypatch.setattr("cnc_shape.jerk.WINDOW", 64)
    monkeypatch.setattr("cnc_shape.jerk.LOOK_AHEAD", 0.0)
    monkeypatch.setattr("cnc_shape.jerk.PATIENCE", 1)


@pytest.mark.usefixtures("small_windows")
@pytest.mark.parametrize("kind", ["wander", "spiral", "slow spiral"])
@pytest.mark.parametrize("at_once", [30_000.0, 400.0])
def test_chunks_do_not_change_a_bit(kind, at_once, monkeypatch):
    """Neither where all of a law is brought close to the fastest, nor where that ends on the way."""
    monkeypatch.setattr("cnc_shape.jerk.REFINED_AT_ONCE", at_once)
    whole = wander(np.random.default_rng(3), 600) if kind == "wander" else lines(spiral(12), 150.0)
    limits = [Limits(200.0, 2000.0, 2e3 if kind == "slow spiral" else 5e4)] * 3
    path = smooth(whole, Smoothing(0.01))
    once = plan(path, limits)
    assert_keeps(once, limits)
    for size in (1, 97, 1000):
        parts, _, held = in_chunks(path, limits, size)
        assert_same_law(parts, once)
        assert held < len(path)


@pytest.mark.usefixtures("small_windows")
def test_chunks_do_not_change_a_bit_with_path_limits_and_gently():
    path_limits = PathLimits(400.0, 4e-3, 1e-3)
    path = smooth(wander(np.random.default_rng(3), 500), Smoothing(0.01))
    factor = frozen(np.random.default_rng(4).uniform(0.3, 1.0, len(path)))
    once, _, _ = in_chunks(path, MILL_J, len(path), factor, path_limits)
    assert worst_violation(once[0], MILL_J, 9, path_limits).worst <= 1e-6
    for size in (97, 1000):
        parts, _, _ = in_chunks(path, MILL_J, size, factor, path_limits)
        assert_same_law(parts, once[0])


@pytest.mark.usefixtures("small_windows")
def test_a_law_that_is_always_on_its_way_up_is_kept_at_one_speed_for_a_moment():
    """64 blocks are 0.3 mm: much too few to come near 180 mm/s, or to stop from there."""
    path = smooth(
        lines(np.column_stack([0.005 * np.arange(1001), np.zeros(1001)]), 180.0), Smoothing(0.01, 0, 0)
    )
    parts, counts, _ = in_chunks(path, MILL_J, 300)
    assert counts[CALMED] > 10 * counts[RESTS]
    assert_same_law(parts, plan(path, MILL_J))
    found = worst_violation(plan(path, MILL_J), MILL_J, 33)
    assert found.worst <= 1e-6
    assert found.jerk <= 1e-3
    assert max(found.gap, found.jump) <= 1e-8  # at 64 joints a mm, rounding of each


@pytest.mark.usefixtures("small_windows")
@pytest.mark.parametrize("seed", [1, 2])
def test_where_no_law_is_found_there_are_rests_and_slow_stretches(monkeypatch, seed):
    """With a single round, the law of most curved stretches still asks for too much."""
    monkeypatch.setattr("cnc_shape.jerk.MOST_ROUNDS", 1)
    path = smooth(wander(np.random.default_rng(seed), 200), Smoothing(0.01))
    parts, counts, _ = in_chunks(path, MILL_J, 100)
    assert counts[RESTS] > 0
    assert counts[SLOWED] > 0
    once = plan(path, MILL_J)
    assert_same_law(parts, once)
    assert_keeps(once, MILL_J)
    monkeypatch.setattr("cnc_shape.jerk.MOST_ROUNDS", 100)
    assert once.end_time > plan(path, MILL_J).end_time


@pytest.mark.parametrize("length", [1e-3, 0.3, 7.0])
def test_the_slow_law_of_a_straight_is_the_closed_form(length):
    path = smooth(lines([[0, 0], [length, 0]], 50.0), Smoothing(0.01))
    velocity, acceleration, jerk = frozen([200.0] * 3), frozen([2000.0] * 3), frozen([5e4] * 3)
    alone = rotary_only(path)
    limit_v2, straight = speed_limits(
        path.coefficients, path.length, path.feed_rate, alone, velocity, acceleration
    )
    pieces, _ = slow_law(
        path.coefficients, path.length, limit_v2, straight, frozen([]), acceleration, jerk, 0, 1, TOLERANCES
    )
    assert_allclose(pieces[:, 1].sum(), naive.rest_to_rest(length, 50.0, 2000.0, 5e4), rtol=1e-9)


@pytest.mark.parametrize("seed", [3, 4])
def test_a_window_costs_no_time(monkeypatch, seed):
    """Against the law of each section as a whole."""
    path = smooth(wander(np.random.default_rng(seed), 3000), Smoothing(0.01))
    in_windows = plan(path, MILL_J)
    monkeypatch.setattr("cnc_shape.jerk.WINDOW", len(path))
    assert_allclose(in_windows.end_time, plan(path, MILL_J).end_time, rtol=1e-4)


def test_a_straight_of_100_000_blocks_is_one_move_and_little_of_it_is_held_back():
    """180 mm/s over 5 um a block: the stopping distance, 11.7 mm, is 2340 blocks, the window is four of them."""
    n = 100_000
    points = np.column_stack([0.005 * np.arange(n + 1), np.zeros(n + 1)])
    path = smooth(lines(points, 180.0), Smoothing(0.01, 0, 0))
    stop = 180.0 / 2 * (180.0 / 2000 + 2000 / 5e4)
    assert len(path) > n // 2
    parts, counts, held = in_chunks(path, MILL_J, 1000)
    assert counts[MERGED] == counts[RESTS] == counts[CALMED] == counts[SLOWED] == 0
    assert_allclose(parts[-1].end_time, naive.rest_to_rest(500.0, 180.0, 2000.0, 5e4), rtol=1e-7)
    assert max(part.velocity.max(initial=0.0) for part in parts) == pytest.approx(180.0)
    ahead = 4 * stop / path.length[:-1].min()
    assert held <= 4 * ahead + 2 * PATIENCE
    assert held < len(path) / 2


def test_what_is_held_back_of_a_long_path_without_stops_does_not_grow():
    held = []
    for turns in (20, 80):
        path = smooth(lines(spiral(turns, pitch=0.02, segments=200), 40.0), Smoothing(0.01))
        _, counts, most = in_chunks(path, MILL_J, 500)
        assert counts[RESTS] == counts[SLOWED] == 0
        held.append(most)
    assert len(path) > 6 * WINDOW
    assert held[1] <= 4 * WINDOW


def straights(rng, count):
    """Path of straights of 3 to 5000 blocks of 5 to 50 um, with corners, at F 20/100/180 mm/s."""
    steps, feeds = [], []
    while sum(len(part) for part in steps) < count:
        n = int(10 ** rng.uniform(np.log10(3), np.log10(5000)))
        heading = rng.uniform(-np.pi, np.pi)
        steps.append(rng.uniform(0.005, 0.05, n)[:, None] * [np.cos(heading), np.sin(heading)])
        feeds.append(np.full(n, rng.choice([20.0, 100.0, 180.0])))
    points = np.vstack([np.zeros(2), np.cumsum(np.concatenate(steps), axis=0)])
    return smooth(lines(points, np.concatenate(feeds)), Smoothing(0.01, 0, 0))


def test_the_future_is_felt_a_stopping_distance_ahead_whatever_the_number_of_blocks(monkeypatch):
    """60,000 cells, planned up to 40 places as if they rested there; 64 blocks of look-ahead are too few.

    While it is still speeding up, the acceleration has to fall before the motion can brake. Of the scans alone:
    what brings a law close to the fastest works on all of a window between two cruises.
    """
    monkeypatch.setattr(jerk, "REFINED_AT_ONCE", -1.0)
    path = straights(np.random.default_rng(5), 60_000)
    assert len(path) > 50_000
    whole = plan(path, MILL_J)
    border = np.cumsum(np.concatenate([[0.0], path.length]))
    reach = 180.0 / 2 * (180.0 / 2000 + 2000 / 5e4) + 180.0 * 2000 / 5e4
    stops = np.flatnonzero(path.stop)
    too_late = 0
    for cut in np.linspace(2000, len(path) - 2000, 40).astype(int):
        begin = stops[stops < cut][-1]
        part = plan(path.cut(slice(begin, cut)), MILL_J)
        first = int(np.searchsorted(whole.cell, begin)) + int(path.dwell[begin] > 0.0)
        n = len(part)
        same = np.isclose(part.velocity, whole.velocity[first : first + n], rtol=1e-9, atol=0)
        differs = begin + part.cell[np.argmin(same)]
        assert border[cut] - border[differs] <= reach
        too_late += cut - differs > 64
    assert too_late >= 20
