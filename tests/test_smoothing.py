"""Path: C2, within the tolerance, and the same for any chunks."""

import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motions import MILL, assert_same_bits, chunks, gaps, lines, points_of, streamed, wander
from numpy.testing import assert_allclose, assert_array_equal
from paths import arc, dwell, line, toolpath

import cnc_shape.smoothing
from cnc_shape.errors import OptionError
from cnc_shape.kernels.hats import ROUNDS, SHRINK, TICK, edges, first_widths, turns, widths
from cnc_shape.polyline import Merging, polyline
from cnc_shape.program import PathMode
from cnc_shape.smoothing import Smoothing, smooth

SQUARE = np.array([[0, 0], [20, 0], [20, 20], [0, 20], [0, 0]])


def path_of(whole, tolerance=0.01):
    return smooth(whole, Smoothing(tolerance))


@pytest.mark.parametrize("degrees", [5, 30, 90, 120, 160])
def test_a_corner_by_itself_is_cut_by_its_tolerance(degrees):
    """Half-width l: deviation ``l sin(theta)/6``, curvature ``2 sin(theta/2) / (l cos^2(theta/2))``."""
    theta = np.deg2rad(degrees)
    corner = lines([[0, 0], [10, 0], [10 + 10 * np.cos(theta), 10 * np.sin(theta)]])
    path = path_of(corner)
    points, at = points_of(path, 33)
    worst = naive.deviations(corner, points, at, 5.0).max()
    assert worst <= 0.01 * (1 + 1e-9)
    if 10 <= degrees <= 90:
        assert worst >= 0.01 * (1 - 1e-6)
    wide = min(0.06 / np.sin(theta), 3.0) if degrees <= 90 else 0.06
    bend = np.linalg.norm(2 * path.coefficients[:, 2], axis=1).max()
    assert_allclose(bend, 2 * np.sin(theta / 2) / wide, rtol=1e-9)


def random_program(rng, tolerance, n=40):
    """Lines, arcs, helices and spirals of all sizes, tangent or not."""
    moves, at = [], np.zeros(3)
    for _ in range(n):
        size = rng.choice([0.003, 0.05, 1.0, 20.0])
        heading = rng.uniform(0, 2 * np.pi)
        if rng.random() < 0.6:
            at = at + size * np.array([np.cos(heading), np.sin(heading), 0.3 * rng.normal()])
            moves.append(line(*at, tolerance=tolerance))
            continue
        sweep = rng.choice([-1, 1]) * rng.choice([0.1, 1.5, 7.0])
        center = at - size * np.array([np.cos(heading), np.sin(heading), 0.0])
        out = size * (1 + rng.choice([0.0, 0.003, 0.5]))
        around = np.array([np.cos(heading + sweep), np.sin(heading + sweep), 0.0])
        end = center + out * around + np.array([0.0, 0.0, rng.choice([0.0, 0.2 * size])])
        moves.append(arc(tuple(end), tuple(center), sweep, tolerance=tolerance))
        at = np.asarray(end)
    return toolpath(*moves)


@settings(max_examples=25)
@given(seed=st.integers(0, 10**6), tolerance=st.sampled_from([0.002, 0.01, 0.1, 1.0]))
def test_no_path_leaves_the_programmed_lines_and_arcs_by_more_than_the_tolerance(seed, tolerance):
    whole = random_program(np.random.default_rng(seed), tolerance)
    path = path_of(whole)
    points, at = points_of(path, 4)
    pick = slice(None, None, 1 + len(points) // 1500)
    reach = 2.0 + 12.0 * tolerance
    arcs = 2e-6 * 30.0  # the twin's arcs are polylines themselves
    assert (
        naive.deviations(whole, points[pick], at[pick], reach).max() <= tolerance * (1 + 1e-6) + arcs * 1e-2
    )
    jumps = gaps(path)
    assert jumps[0] <= 1e-11
    assert jumps[1] <= 1e-9
    assert jumps[2] <= 1e-9 * np.abs(path.coefficients[:, 2]).max()
    assert_allclose(points[0], whole.start[0], rtol=0, atol=1e-12)
    assert_array_equal(path.coefficients[-1, 0], whole.end[-1])


@settings(max_examples=25)
@given(st.integers(0, 10**6), st.floats(0.002, 0.2))
def test_dense_noise_keeps_the_tolerance(seed, amplitude):
    rng = np.random.default_rng(seed)
    whole = lines(
        np.column_stack([np.cumsum(rng.random(200)) * 0.02, amplitude * 0.05 * rng.normal(size=200)])
    )
    points, at = points_of(path_of(whole), 4)
    assert naive.deviations(whole, points, at, 0.5).max() <= 0.01 * (1 + 1e-9)


def hats_of(points, tolerance=0.01):
    """Edges of a polyline without merging, and the widths of its hats, in mm."""
    _, straight = polyline(Merging(tolerance, 0.0, 0.0))(None, lines(points, tolerance=tolerance), True)
    ticks, tangent = edges(straight.start, straight.end, straight.alone)
    u = np.cumsum(ticks) - ticks
    turn, twist = turns(tangent, straight.stop)
    return straight, tangent, u, turn, twist


@settings(max_examples=20)
@given(st.integers(0, 10**6), st.sampled_from([0.002, 0.05]))
def test_widths_are_those_of_all_pairs(seed, tolerance):
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal([0.05, 0.0, 0.0], 0.03, size=(40, 3)), axis=0)
    straight, _, u, turn, twist = hats_of(points, tolerance)
    if straight.stop[1:-1].any():
        return
    width = widths(u, straight.tolerance, turn, twist, straight.stop)
    start = first_widths(u, straight.tolerance, turn, twist, straight.stop)
    budget = np.append(0.0, np.minimum(straight.tolerance[:-1], straight.tolerance[1:]))
    budget[-1] = 0.0
    slow = naive.hat_widths(u * TICK, budget, turn, start * TICK, ROUNDS, SHRINK)
    assert_allclose(width * TICK, slow, rtol=1e-6, atol=1e-9)
    total, others = naive.hat_sums(u * TICK, width * TICK, turn)
    assert (total[1:-1][others[1:-1] > 0] <= budget[1:-1][others[1:-1] > 0] * (1 + 1e-8)).all()


def test_cells_are_the_sum_over_all_hats():
    rng = np.random.default_rng(3)
    points = np.cumsum(rng.normal([0.05, 0.0, 0.0], 0.02, size=(60, 3)), axis=0)
    straight, tangent, u, turn, twist = hats_of(points)
    width = widths(u, straight.tolerance, turn, twist, straight.stop)
    path = smooth(lines(points), Smoothing(0.01, 0.0, 0.0))
    e = np.linspace(0.0, 1.0, 4)
    q, _ = points_of(path, 4)
    at = (path.u[:, None] + path.length[:, None] * e).ravel()[:-4]
    slow = naive.hat_path(straight.start, tangent, u * TICK, width * TICK, at)
    assert_allclose(q[:-4], slow, rtol=0, atol=1e-12)


@pytest.mark.parametrize("tolerance", [0.005, 0.01, 0.1])
def test_an_arc_is_curved_evenly(tolerance):
    """Hats as wide as a whole number of edges add up to a constant: away from its ends there is no ripple."""
    path = path_of(toolpath(arc((5, 0, 0), (0, 0, 0), 2 * np.pi), start=(5.0, 0.0, 0.0)), tolerance)
    inner = slice(len(path) // 3, 2 * len(path) // 3)
    start = 2 * path.coefficients[inner, 2]
    end = start + 6 * path.length[inner, None] * path.coefficients[inner, 3]
    curvature = np.linalg.norm([start, end], axis=2)
    assert np.ptp(curvature) <= 0.02 * curvature.mean()
    assert_allclose(curvature.mean(), 0.2, rtol=0.02)


def test_stops_and_ends_are_exact():
    for mode in (PathMode.EXACT_STOP, PathMode.EXACT_PATH):
        path = path_of(lines(SQUARE, mode=mode))
        rests = path.coefficients[path.stop, 0, :2]
        assert_array_equal(rests, SQUARE)
    path = path_of(toolpath(line(10, 0), line(10, 10), dwell(1.0), line(3, 3)))
    assert_array_equal(path.coefficients[path.stop, 0], [[0, 0, 0], [10, 10, 0], [3, 3, 0]])
    assert_allclose(path.dwell[path.stop], [0.0, 1.0, 0.0])


def test_tangent_arcs_run_through():
    """Line, arc, arc the other way, helix: no rest but at the ends, in either mode."""
    for mode in (PathMode.BLEND, PathMode.EXACT_PATH):
        path = path_of(
            toolpath(
                line(10, 0, mode=mode), arc((15, 5, 0), (10, 5, 0), np.pi / 2, mode=mode),
                arc((20, 10, 0), (20, 5, 0), -np.pi / 2, mode=mode), line(25, 10, mode=mode),
                arc((25, 10, 3), (25, 15, 0), 4 * np.pi, mode=PathMode.BLEND),
            )
        )  # fmt: skip
        # the helix rises by 0.048 of its length: a corner of 2.7 degrees for an exact path
        assert path.stop.sum() == (2 if mode == PathMode.BLEND else 3)


def test_an_exact_path_visits_every_corner():
    rng = np.random.default_rng(8)
    points = np.vstack([[0, 0], np.cumsum(rng.normal(size=(30, 2)), axis=0)])
    path = path_of(lines(points, mode=PathMode.EXACT_PATH))
    assert_array_equal(path.coefficients[path.stop, 0, :2], points)


def test_places_follow_the_toolpath():
    whole = toolpath(line(10, 0), arc((10, 10, 0), (10, 5, 0), np.pi), line(0, 10), line(0, 0))
    path = path_of(whole)
    ends = path.arc_length + path.stretch * path.length
    assert_allclose(ends[:-1], path.arc_length[1:], rtol=0, atol=1e-12)
    assert (np.diff(path.arc_length) >= 0.0).all()
    assert_allclose(path.arc_length[-1], whole.arc_length[-1], rtol=1e-15)
    assert set(whole.arc_length[[0, 1, 2, 3]]) <= set(path.arc_length)


def test_rotary_axes_ride_along_and_bend_with_the_path():
    points = np.zeros((5, 5))
    points[:, 0] = [0, 10, 20, 30, 40]
    points[:, 3] = [0, 0.1, 0.1, 0.4, 0.4]
    path = path_of(lines(points, axes=("x", "y", "z", "a", "b")))
    assert path.stop.sum() == 2
    q, at = points_of(path, 9)
    assert np.abs(q[:, 3] - np.interp(at, points[:, 0], points[:, 3])).max() <= 1e-3
    assert max(gaps(path)) <= 1e-12
    alone = path_of(lines([[0, 0, 0, 0], [0, 0, 0, 1.5], [1, 0, 0, 1.5]], axes=("x", "y", "z", "c")))
    assert_allclose(alone.length[0], 1.5, rtol=1e-11)
    assert (alone.stretch == 0.0).tolist() == [True, False, True]


@pytest.mark.parametrize("sizes", [[1], [1, 0, 7], [13, 257], [997]])
def test_chunks_do_not_change_a_bit(sizes, monkeypatch):
    monkeypatch.setattr(cnc_shape.smoothing, "PATIENCE", 1)
    monkeypatch.setattr("cnc_shape.feedrate.PATIENCE", 1)
    whole = wander(np.random.default_rng(sum(sizes)), 500 if sizes[0] == 1 else 5000)
    once, _ = streamed([whole], MILL)
    pieces, held = streamed(chunks(whole, sizes), MILL, most=777)
    assert_same_bits(once, pieces)
    assert held < max(sizes) + 400


def test_chunks_across_arcs_and_corners_do_not_change_a_bit(monkeypatch):
    monkeypatch.setattr(cnc_shape.smoothing, "PATIENCE", 1)
    whole = random_program(np.random.default_rng(4), 0.01, 200)
    once, _ = streamed([whole], MILL)
    pieces, _ = streamed(chunks(whole, [1]), MILL)
    assert_same_bits(once, pieces)


def test_a_margin_that_is_too_short_shows(monkeypatch):
    """The control of the tests above: without the reach of the widths, chunks differ."""
    monkeypatch.setattr(cnc_shape.smoothing, "PATIENCE", 1)
    monkeypatch.setattr(cnc_shape.smoothing, "ROUNDS", -2)
    monkeypatch.setattr(cnc_shape.smoothing, "LONGEST_BLEND", 0.05)
    whole = wander(np.random.default_rng(11), 500)
    once, _ = streamed([whole], MILL)
    pieces, _ = streamed(chunks(whole, [1]), MILL)
    with pytest.raises(AssertionError):
        assert_same_bits(once, pieces)


def test_a_long_straight_streams_in_little_memory():
    n = 200_000
    whole = lines(np.column_stack([0.01 * np.arange(n + 1), np.zeros(n + 1)]), 180.0)
    once, _ = streamed([whole], MILL, sample_time=0.01)
    pieces, held = streamed(chunks(whole, [1000]), MILL, sample_time=0.01)
    assert_same_bits(once, pieces)
    assert held < 3000


def test_precision_does_not_fade_with_length():
    """A corner after 200 m has the bits of a corner after none: lengths are sums of whole ticks."""
    far = np.vstack([[[-200_000.0, 0.0]], [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]]])
    near = far[1:]
    long, short = path_of(lines(far)), path_of(lines(near))
    bent = np.abs(long.coefficients[:, 3]).max(axis=1) > 0.0
    also = np.abs(short.coefficients[:, 3]).max(axis=1) > 0.0
    assert_array_equal(long.coefficients[bent], short.coefficients[also])


def test_settings_are_checked():
    with pytest.raises(OptionError):
        Smoothing(0.0)
    with pytest.raises(OptionError):
        Smoothing(0.01, merge_share=0.7)


def test_a_program_without_moves_is_a_rest_or_nothing():
    assert len(path_of(toolpath())) == 0
    path = path_of(toolpath(dwell(0.5), start=(1.0, 2.0, 3.0)))
    assert_array_equal(path.coefficients[:, 0], [[1.0, 2.0, 3.0]])
    assert_allclose(path.dwell, [0.5])
