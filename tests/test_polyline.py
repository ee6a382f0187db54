"""Polyline: arcs as polygons, runs of short lines as chords, and where the path rests."""

import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motions import chunks, lines
from numpy.testing import assert_allclose, assert_array_equal
from paths import arc, dwell, line, toolpath

from cnc_shape.kernels.chords import WINDOW
from cnc_shape.kernels.polyline import ARC_SHARE, EXACT_PATH_TOLERANCE, LARGEST_STEP
from cnc_shape.polyline import Merging, Polyline, join, polyline
from cnc_shape.program import PathMode

MERGING = Merging(path_tolerance=0.01)


def straighten(path, merging=MERGING) -> Polyline:
    return polyline(merging)(None, path, True)[1]


def polygon_error(edges: Polyline, radius: float) -> float:
    """How far the edges lie outside a circle about the origin, at most."""
    return float(np.linalg.norm(edges.start[:-1, :2], axis=1).max() - radius)


@pytest.mark.parametrize("radius", [0.05, 1.0, 30.0, 1000.0])
@pytest.mark.parametrize("sweep", [0.01, -1.0, 2 * np.pi, -15.0])
def test_a_polygon_about_an_arc_is_tangent_at_its_ends_and_outside_by_its_share(radius, sweep):
    end = (radius * np.cos(sweep), radius * np.sin(sweep), 0.0)
    edges = straighten(toolpath(arc(end, (0.0, 0.0, 0.0), sweep), start=(radius, 0.0, 0.0)))
    assert_array_equal(edges.start[0], [radius, 0.0, 0.0])
    assert_allclose(edges.start[-1], end, atol=1e-15)
    first, last = edges.end[0] - edges.start[0], edges.end[-2] - edges.start[-2]
    assert_allclose(first / np.linalg.norm(first), [0.0, np.sign(sweep), 0.0], atol=1e-9 / min(radius, 1.0))
    tangent = np.sign(sweep) * np.array([-np.sin(sweep), np.cos(sweep), 0.0])
    assert_allclose(last / np.linalg.norm(last), tangent, atol=1e-8 / min(radius, 1.0))
    assert 0.0 <= polygon_error(edges, radius) <= 3 * ARC_SHARE * MERGING.path_tolerance * (1 + 0.05)
    assert_allclose(MERGING.path_tolerance - edges.tolerance[0], polygon_error(edges, radius), atol=1e-12)
    assert_allclose(edges.place[-1], radius * abs(sweep), rtol=1e-12)
    assert_allclose(edges.travel.sum(), radius * abs(sweep), rtol=1e-12)


@pytest.mark.parametrize("radius", [0.05, 1.0, 30.0])
@pytest.mark.parametrize("sweep", [0.3, -2.0, 15.0])
@pytest.mark.parametrize("rise", [0.0, 0.01, -4.0])
def test_corners_of_a_polygon_are_where_the_tangents_meet(radius, sweep, rise):
    end = (radius * np.cos(sweep), radius * np.sin(sweep), rise)
    edges = straighten(toolpath(arc(end, (0.0, 0.0, 0.0), sweep), start=(radius, 0.0, 0.0)))
    corners = naive.tangent_polygon(radius, rise, sweep, len(edges) - 1)
    assert_allclose(edges.start[1:-1], corners, atol=1e-11)
    count = len(corners)
    if count > 1 and not rise:  # no more than it takes: one fewer would spend more than its share
        step = abs(sweep) / (count - 1)
        assert (
            step > LARGEST_STEP
            or radius * (1 / np.cos(0.5 * step) - 1) > 3 * ARC_SHARE * MERGING.path_tolerance
        )


@settings(max_examples=60)
@given(
    radius=st.sampled_from([0.05, 2.0, 40.0]),
    growth=st.sampled_from([0.0, 0.004, -0.5, 3.0]),
    rise=st.sampled_from([0.0, 0.3, 5.0]),
    sweep=st.floats(0.02, 9.0),
    tolerance=st.sampled_from([0.002, 0.01, 0.2]),
)
def test_helices_and_spirals_keep_what_they_spend(radius, growth, rise, sweep, tolerance):
    outer = radius * (1 + growth)
    end = (outer * np.cos(sweep), outer * np.sin(sweep), rise * radius)
    path = toolpath(arc(end, (0.0, 0.0, 0.0), sweep, tolerance=tolerance), start=(radius, 0.0, 0.0))
    edges = straighten(path)
    share = np.linspace(0.0, 1.0, 9)[:, None]
    points = np.concatenate([a + share * (b - a) for a, b in zip(edges.start, edges.end, strict=True)])
    at = np.concatenate([p + share[:, 0] * t for p, t in zip(edges.place, edges.travel, strict=True)])
    pick = slice(None, None, 1 + len(points) // 300)
    spent = tolerance - edges.tolerance[0]
    assert spent <= 0.36 * tolerance
    chord_error = radius * max(1.0, 1 + growth) * (sweep / 4000) ** 2
    assert (
        naive.deviations(path, points[pick], at[pick], 0.5 * path.arc_length[-1]).max()
        <= spent * 1.001 + chord_error
    )


def test_a_spiral_may_leave_its_own_axis():
    path = toolpath(arc((0.0, 2.0, 0.0), (0.0, 0.0, 0.0), np.pi / 2), start=(0.0, 0.0, 0.0))
    edges = straighten(path)
    assert np.isfinite(edges.start).all()
    assert_allclose(edges.start[1] / np.linalg.norm(edges.start[1]), [1.0, 0.0, 0.0], atol=0.1)


@given(st.integers(0, 10**6))
@settings(max_examples=20)
def test_chords_are_the_longest_that_keep_the_tolerance(seed):
    rng = np.random.default_rng(seed)
    points = np.vstack([np.zeros(3), np.cumsum(rng.normal([0.05, 0.0, 0.0], 0.004, size=(150, 3)), axis=0)])
    kept = straighten(lines(points, merge_tolerance=0.003))
    assert_array_equal(kept.start, points[naive.chords(points, 0.003, WINDOW)])


@given(st.integers(0, 10**6))
@settings(max_examples=40)
def test_chords_do_not_run_back(seed):
    """Steps in all directions, within the tolerance: only progress along the chord limits it."""
    rng = np.random.default_rng(seed)
    points = np.vstack([np.zeros(3), np.cumsum(rng.normal([3e-4, 0.0, 0.0], 2e-4, size=(20, 3)), axis=0)])
    kept = straighten(lines(points, merge_tolerance=0.004))
    if not kept.stop[1:-1].any():
        assert_array_equal(kept.start, points[naive.chords(points, 0.004, WINDOW)])


def test_a_straight_of_many_blocks_is_few_chords():
    edges = straighten(lines(np.column_stack([0.01 * np.arange(1281), np.zeros(1281)])))
    assert len(edges) == 1280 // WINDOW + 1
    assert_array_equal(edges.line[:-1], 1 + WINDOW * np.arange(1280 // WINDOW))


def test_noise_is_worth_half_the_tolerance_and_a_curve_a_tenth():
    n = 640
    zigzag = np.column_stack([0.02 * np.arange(n + 1), 0.004 * (np.arange(n + 1) % 2)])
    assert len(straighten(lines(zigzag))) == n // WINDOW + 1
    assert len(straighten(lines(zigzag, tolerance=0.003))) == n + 1
    curve = 5.0 * np.column_stack([np.cos(0.001 * np.arange(n)), np.sin(0.001 * np.arange(n))])
    sagitta = 5.0 * (1 - np.cos(0.5 * 0.001 * (n - 1) / (len(straighten(lines(curve))) - 1)))
    assert sagitta <= 0.1 * MERGING.path_tolerance


def test_chords_do_not_cross_a_change_of_feed_or_mode():
    points = np.column_stack([0.01 * np.arange(101), np.zeros(101)])
    feed = np.where(np.arange(100) < 37, 50.0, 60.0)
    assert 38 in straighten(lines(points, feed)).line
    assert 38 in straighten(lines(points, tolerance=np.where(np.arange(100) < 37, 0.01, 0.02))).line


def stops(path) -> list[int]:
    """Lines whose start is a rest, the end of the program left out."""
    edges = straighten(path)
    return edges.line[:-1][edges.stop[:-1] == 1].tolist()


def test_where_the_path_rests():
    assert stops(toolpath(line(1, 0), line(1, 1), line(0, 1))) == [1]
    assert stops(toolpath(line(1, 0, mode=PathMode.EXACT_STOP), line(1, 1), line(0, 1))) == [1, 2]
    assert stops(toolpath(line(1, 0), dwell(0.5), line(2, 0))) == [1, 3]
    assert stops(toolpath(line(1, 0), line(0, 0.26))) == [1, 2]  # turns by 165.4 degrees
    assert stops(toolpath(line(1, 0), line(0, 0.27))) == [1]  # by 164.9
    assert stops(toolpath(line(1, 0, feed_rate=np.inf), line(2, 0))) == [1]


def test_an_exact_path_rests_where_it_turns_and_runs_through_where_it_is_tangent():
    exact = PathMode.EXACT_PATH
    assert stops(toolpath(line(1, 0, mode=exact), line(2, 0.01, mode=exact), line(3, 0.1, mode=exact))) == [
        1,
        3,
    ]
    path = toolpath(
        line(5, 0, mode=exact), arc((5, 10, 0), (5, 5, 0), np.pi, mode=exact), line(0, 10, mode=exact)
    )
    assert stops(path) == [1]
    assert (straighten(path).tolerance <= EXACT_PATH_TOLERANCE).all()


def test_a_blend_does_not_reach_into_an_exact_path():
    assert stops(toolpath(line(1, 0), line(1, 1, mode=PathMode.EXACT_PATH), line(2, 1))) == [1, 2, 3]


def test_rotary_moves_alone_have_a_rest_at_both_ends():
    points = [[0, 0, 0, 0], [1, 0, 0, 0], [1, 0, 0, 0.5], [1, 0, 0, 0.9], [2, 0, 0, 0.9], [3, 0, 0, 1.0]]
    edges = straighten(lines(points, axes=("x", "y", "z", "a")))
    assert edges.line[edges.stop == 1].tolist() == [1, 2, 3, 4, 5]
    assert edges.alone.tolist() == [0, 1, 1, 0, 0, 0]


def test_dwells_add_up_and_the_last_one_is_kept():
    edges = straighten(toolpath(dwell(0.1), dwell(0.2), line(1, 0), dwell(0.4)))
    assert_allclose(edges.dwell, [0.3, 0.4])


def assert_chunks_change_nothing(whole, sizes):
    """The same edges, to the bit, whole and in chunks."""
    step, state, parts = polyline(MERGING), None, []
    cut = chunks(whole, sizes)
    for number, part in enumerate(cut, 1):
        state, edges = step(state, part, number == len(cut))
        parts.append(edges)
    streamed, once = join(parts), straighten(whole)
    for name in Polyline.__slots__:
        assert_array_equal(getattr(streamed, name), getattr(once, name), err_msg=name)


@pytest.mark.parametrize("sizes", [[1], [3, 0, 1], [64], [50, 7]])
def test_chunks_do_not_change_the_polyline(sizes):
    rng = np.random.default_rng(5)
    points = np.cumsum(rng.normal([0.02, 0.0, 0.0], 0.002, size=(400, 3)), axis=0)
    whole = lines(points, np.where(np.arange(399) < 150, 40.0, 90.0))
    assert_chunks_change_nothing(whole, sizes)


def zigzag(legs, blocks_per_leg=1):
    corners = np.column_stack([0.02 * np.arange(legs + 1), 0.004 * (np.arange(legs + 1) % 2)])
    steps = np.arange(legs * blocks_per_leg + 1) / blocks_per_leg
    return np.column_stack([np.interp(steps, np.arange(legs + 1), column) for column in corners.T])


@pytest.mark.parametrize("legs", [65, 66, 73, 128, 129, 200, 1000])
@pytest.mark.parametrize("blocks_per_leg", [1, 4])
def test_noise_is_merged_to_its_end(legs, blocks_per_leg):
    """The last two chords share evenly: none is too short to show that its edges turn to and fro."""
    edges = straighten(lines(zigzag(legs, blocks_per_leg)))
    assert len(edges) - 1 == -(-legs * blocks_per_leg // WINDOW)
    assert edges.travel[:-1].min() >= 0.4 * edges.travel[:-1].max()


@pytest.mark.parametrize("sizes", [[1], [3, 0, 50], [64]])
def test_chunks_do_not_change_the_end_of_noise(sizes):
    feeds = np.repeat([40.0, 90.0], [150, 141])
    whole = lines(zigzag(291), feeds)
    assert_chunks_change_nothing(whole, sizes)


def test_a_smooth_curve_that_turns_both_ways_is_not_noise():
    """Where it changes its side, its turns cancel, but not to and fro."""
    x = 0.02 * np.arange(400)
    wave = np.column_stack([x, 0.3 * np.sin(x)])
    kept = straighten(lines(wave))
    assert len(kept) == len(straighten(lines(wave), Merging(0.01, 0.1, 0.1)))
