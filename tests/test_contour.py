"""Contour error: exact against lines, arcs, helices and spirals, within a window of the path."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from paths import arc, dwell, line, rows, toolpath
from scipy.optimize import minimize_scalar

from cnc_shape.arrays import frozen, frozen_integers
from cnc_shape.contour import ContourError, Tally, contour_error, measuring, tally
from cnc_shape.kernels.foot_point import points_at
from cnc_shape.segments import path_table, segments, since
from cnc_shape.windows import Reach, foot_windows

TURN = 2.0 * np.pi


def whole(points, path) -> ContourError:
    points = np.atleast_2d(np.asarray(points, dtype=float))
    everywhere = np.full(len(points), np.inf)
    return contour_error(points, path, -everywhere, everywhere)


def some_path(seed: int):
    """Lines, arcs, helices and spirals in all three planes, end to start."""
    rng = np.random.default_rng(seed)
    moves, at = [], np.zeros(3)
    for _ in range(rng.integers(2, 8)):
        if rng.random() < 0.4:
            at = at + rng.uniform(-10, 10, 3)
            moves.append(line(*at))
            continue
        normal = np.eye(3)[rng.integers(3)]
        u, v = np.roll(normal, 1), np.roll(normal, 2)
        radius, phase = rng.uniform(0.5, 8), rng.uniform(0, TURN)
        sweep = rng.choice([-1, 1]) * rng.uniform(0.05, 3 * TURN)
        center = at - radius * (np.cos(phase) * u + np.sin(phase) * v)
        outer = radius * (1 + rng.choice([0.0, 0.0, 1e-3]))
        if np.cross(u, v) @ normal < 0:
            u, v = v, u
        center = at - radius * (np.cos(phase) * u + np.sin(phase) * v)
        rise = rng.choice([0.0, rng.uniform(-6, 6)])
        at = center + outer * (np.cos(phase + sweep) * u + np.sin(phase + sweep) * v) + rise * normal
        moves.append(arc(tuple(at), tuple(center), sweep, tuple(normal)))
    return toolpath(*moves)


def test_line_is_the_perpendicular_distance_and_clamps_at_its_ends():
    path = toolpath(line(10.0, 0.0, 0.0))
    error = whole([[3.0, 4.0, 0.0], [-3.0, 4.0, 0.0], [13.0, 0.0, 4.0]], path)
    assert_allclose(error.distance, [4.0, 5.0, 5.0], rtol=1e-15)
    assert_allclose(error.arc_length, [3.0, 0.0, 10.0], rtol=1e-15)
    assert_allclose(error.foot, [[3, 0, 0], [0, 0, 0], [10, 0, 0]], atol=1e-14)


def test_circle_is_the_radius_error():
    path = toolpath(arc((5.0, 0.0, 0.0), (0.0, 0.0, 0.0), TURN), start=(5.0, 0.0, 0.0))
    angle = np.linspace(0.1, 6.2, 50)
    radius = np.linspace(4.0, 6.0, 50)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(50)], axis=1)
    error = whole(points, path)
    assert_allclose(error.distance, np.abs(radius - 5.0), atol=1e-14)
    assert_allclose(error.arc_length, 5.0 * angle, rtol=1e-13)


def test_helix_beside_its_axis_takes_the_nearer_turn():
    # radius 5, pitch 2 mm: from a point on the cylinder between two turns, the lower one is nearer
    path = toolpath(arc((5.0, 0.0, 6.0), (0.0, 0.0, 0.0), 3 * TURN), start=(5.0, 0.0, 0.0))
    height = 2.0 + 0.4  # turn 1 passes here at z = 2
    error = whole([[5.0, 0.0, height]], path)
    climb = np.hypot(5.0, 2.0 / TURN)
    assert_allclose(error.distance, 0.4 * 5.0 / climb, rtol=1e-4)  # along the slope, nearly
    assert 1.0 < error.arc_length[0] / (climb * TURN) < 1.01


@pytest.mark.parametrize("seed", range(12))
def test_equals_brute_force_on_any_path(seed):
    path = some_path(seed)
    rng = np.random.default_rng(100 + seed)
    points = np.vstack(
        [path.end[rng.integers(len(path), size=6)] + rng.normal(0, 2, (6, 3)), rng.uniform(-15, 15, (4, 3))]
    )
    expected = [naive.contour_distance(point, path) for point in points]
    assert_allclose(whole(points, path).distance, expected, atol=1e-6)
    assert (whole(points, path).distance <= np.array(expected) + 1e-12).all()


@pytest.mark.parametrize("seed", range(12))
def test_windowed_equals_brute_force_within_the_window_and_is_never_below_the_global(seed):
    path = some_path(seed)
    rng = np.random.default_rng(200 + seed)
    total = path.arc_length[-1]
    points = path.end[rng.integers(len(path), size=6)] + rng.normal(0, 2, (6, 3))
    lower = rng.uniform(0, total, 6)
    upper = lower + rng.uniform(0.05, 0.3, 6) * total
    error = contour_error(points, path, lower, upper)
    expected = [naive.contour_distance(p, path, a, b) for p, a, b in zip(points, lower, upper, strict=True)]
    assert_allclose(error.distance, expected, atol=1e-5)
    assert (error.distance >= whole(points, path).distance).all()
    assert ((error.arc_length >= lower - 1e-9) & (error.arc_length <= np.minimum(upper, total) + 1e-9)).all()


@given(st.integers(0, 10_000))
@settings(max_examples=40)
def test_a_point_on_the_path_has_no_error(seed):
    path = some_path(seed)
    rng = np.random.default_rng(seed)
    row = rng.integers(len(path))
    points = naive.curve_points(path, row, rng.uniform(0, 1, 5))
    assert whole(points, path).max <= 1e-11


def test_helix_foot_is_where_scipy_finds_it():
    radius, pitch, turns = 20.0, 10.0, 2
    path = toolpath(arc((radius, 0, pitch * turns), (0, 0, 0), turns * TURN), start=(radius, 0, 0))
    slope = np.hypot(radius, pitch / TURN)
    rng = np.random.default_rng(8)
    for point in rng.uniform([-25, -25, -5], [25, 25, 25], (40, 3)):

        def distance(angle, point=point):
            curve = [radius * np.cos(angle), radius * np.sin(angle), pitch * angle / TURN]
            return np.linalg.norm(np.array(curve) - point)

        starts = np.linspace(0, turns * TURN, 60)
        found = [
            minimize_scalar(distance, bounds=(a, b), method="bounded", options={"xatol": 1e-11})
            for a, b in pairwise(starts)
        ]
        best = min(found, key=lambda f: f.fun)
        error = whole(point, path)
        assert_allclose(error.distance, min(best.fun, distance(0), distance(turns * TURN)), atol=1e-9)
        assert_allclose(error.arc_length, slope * best.x, atol=2e-4)


@given(
    st.floats(0.0, 0.05), st.floats(0.001, 0.05), st.floats(0.1, 15.0), st.sampled_from([-1, 1]),
    st.floats(-0.1, 0.1), st.integers(0, 10_000),
)  # fmt: skip
@settings(max_examples=60)
def test_the_tightest_spirals_equal_brute_force(inner, outer, sweep, sense, rise, seed):
    # radii as small as the tolerance of an arc's ends: the radius changes as fast as the angle
    sweep *= sense
    end = (outer * np.cos(sweep), outer * np.sin(sweep), rise)
    path = toolpath(arc(end, (0, 0, 0), sweep), start=(inner, 0, 0))
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1.5, 1.5, (6, 3)) * [0.05, 0.05, 0.1]
    expected = [naive.contour_distance(p, path, count=4001) for p in points]
    error = whole(points, path)
    assert_allclose(error.distance, expected, atol=1e-8)
    assert_allclose(np.linalg.norm(points - error.foot, axis=1), error.distance, atol=1e-9)


def test_a_spiral_may_begin_at_its_center():
    path = toolpath(arc((0.02, 0.0, 0.0), (0.0, 0.0, 0.0), np.pi))  # its radius is 0.02 angle / pi
    error = whole([[0.0, -0.01, 0.0], [0.0, 0.0, 0.0], [0.03, 0.0, 0.0]], path)
    assert_allclose(error.distance, [0.0, 0.0, 0.01], atol=1e-17)


def rotation(seed):
    """A proper rotation matrix."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def moved(path, matrix, shift, scale=1.0):
    """The path turned (a permutation may mirror it), shifted and scaled."""
    mirror = np.sign(np.linalg.det(matrix))
    return replace(
        path,
        start=frozen(scale * path.start @ matrix.T + shift),
        end=frozen(scale * path.end @ matrix.T + shift),
        center=frozen(scale * path.center @ matrix.T + shift),
        normal=frozen(path.normal @ matrix.T),
        sweep=frozen(mirror * path.sweep),
        arc_length=frozen(scale * path.arc_length),
    )


@pytest.mark.parametrize("seed", range(10))
def test_rigid_motion_changes_nothing(seed):
    path, matrix = some_path(seed), rotation(seed)
    rng = np.random.default_rng(seed)
    shift = rng.uniform(-100, 100, 3)
    points = rng.uniform(-15, 15, (50, 3))
    lower = rng.uniform(0, path.arc_length[-1], 50)
    upper = lower + rng.uniform(0, 20, 50)
    here = contour_error(points, path, lower, upper)
    there = contour_error(points @ matrix.T + shift, moved(path, matrix, shift), lower, upper)
    assert_allclose(there.distance, here.distance, atol=1e-9)
    assert_allclose(there.foot, here.foot @ matrix.T + shift, atol=1e-6)


@pytest.mark.parametrize("order", [[1, 2, 0], [2, 0, 1], [1, 0, 2], [0, 2, 1]])
def test_axes_may_be_exchanged_and_the_part_scaled(order):
    path, matrix = some_path(2), np.eye(3)[order]
    points = np.random.default_rng(2).uniform(-15, 15, (50, 3))
    here = whole(points, path)
    there = whole(2.5 * points @ matrix.T, moved(path, matrix, 0.0, 2.5))
    assert_allclose(there.distance, 2.5 * here.distance, rtol=1e-9)
    assert_allclose(there.arc_length, 2.5 * here.arc_length, atol=1e-6)


def dense_path(count=3000):
    """A curve in steps of about 0.02 mm that comes back to itself."""
    u = np.linspace(0.0, 3 * TURN, count + 1)
    points = np.stack([3 * np.sin(2 * u), 3 * np.sin(3 * u + 0.3), 0.2 * np.sin(u)], axis=1)
    return toolpath(*[line(*p) for p in points[1:]], start=tuple(points[0]))


def test_many_segments_equal_brute_force_over_all_of_them():
    path = dense_path()
    rng = np.random.default_rng(3)
    points = rng.uniform(-3.5, 3.5, (300, 3)) * [1, 1, 0.1]
    lower = rng.uniform(-5, path.arc_length[-1], 300)
    upper = lower + 10 ** rng.uniform(-3, 2, 300)
    error = contour_error(points, path, lower, upper)
    expected = [naive.polyline_distance(p, path, a, b) for p, a, b in zip(points, lower, upper, strict=True)]
    assert_allclose(error.distance, expected, atol=1e-12)
    assert_allclose(np.linalg.norm(points - error.foot, axis=1), error.distance, atol=1e-12)


@pytest.mark.parametrize("make", [dense_path, lambda: some_path(4), lambda: some_path(7)])
def test_what_was_measured_before_does_not_change_a_bit(make):
    path = make()
    rng = np.random.default_rng(4)
    count = 500
    points = path.end[rng.integers(len(path), size=count)] + rng.choice([0.0, 0.1, 3.0], (count, 1))
    lower = rng.uniform(-1, path.arc_length[-1], count)
    upper = lower + 10 ** rng.uniform(-3, 2, count)
    at_once = contour_error(points, path, lower, upper)
    shuffled = rng.permutation(count)
    again = contour_error(points[shuffled], path, lower[shuffled], upper[shuffled])
    for name in ("distance", "foot", "arc_length", "line"):
        assert_array_equal(getattr(again, name), getattr(at_once, name)[shuffled])


def test_of_equally_near_points_the_first_counts():
    path = toolpath(line(2, 0), line(2, 2), line(0, 2), line(0, 0))  # from its middle, all sides are alike
    error = whole([[1.0, 1.0, 0.0]] * 2 + [[1.9, 0.1, 0.0]], path)
    assert_array_equal(error.arc_length[:2], [1.0, 1.0])
    assert error.line.tolist() == [1, 1, 1]
    circle = toolpath(arc((5, 0, 0), (0, 0, 0), 3 * TURN), start=(5, 0, 0))
    assert_allclose(whole([[0.0, 6.0, 0.0]], circle).arc_length, 5 * np.pi / 2)
    assert whole([[0.0, 0.0, 1.0]], circle).arc_length == 0.0


@given(st.integers(0, 10_000))
@settings(max_examples=20)
def test_moving_the_workpiece_moves_nothing_else(seed):
    rng = np.random.default_rng(seed)
    shift = rng.uniform(-50, 50, 3)
    moves = [line(*rng.uniform(-10, 10, 3)) for _ in range(5)]
    moved = [line(*(np.array(m["target"]) + shift)) for m in moves]
    points = rng.uniform(-10, 10, (20, 3))
    here = whole(points, toolpath(*moves))
    there = whole(points + shift, toolpath(*moved, start=tuple(shift)))
    assert_allclose(there.distance, here.distance, atol=1e-12)


def test_a_crossing_is_passed_on_the_right_branch():
    u = np.linspace(0, TURN, 2001)
    curve = 30 * np.stack([np.cos(u), np.sin(u) * np.cos(u), 0 * u], axis=1) / (1 + np.sin(u) ** 2)[:, None]
    path = toolpath(*[line(*p) for p in curve[1:]], start=tuple(curve[0]))
    rng = np.random.default_rng(0)
    near = np.flatnonzero(np.linalg.norm(curve[1:-1], axis=1) < 0.3) + 1
    rows_ = rng.choice(near, 400)
    points = curve[rows_] + rng.uniform(-0.3, 0.3, (400, 3)) * [1, 1, 0]
    place = path.arc_length[rows_]
    windowed = contour_error(points, path, place - 1.0, place + 1.0).distance
    everywhere = whole(points, path).distance
    assert (windowed >= everywhere).all()
    assert (windowed > everywhere + 1e-6).mean() > 0.1  # the other branch would have been nearer


def test_a_neighbouring_raster_line_is_not_meant():
    path = toolpath(line(50, 0), line(50, 0.1), line(0, 0.1))
    point = [[10.0, 0.09, 0.0]]  # due on the first line, 10 um beside the second
    lower, upper = foot_windows(np.linspace(0, path.arc_length[-1], 1002), 20, 20, 0.5)
    k = 100
    error = contour_error(np.array(point), path, lower[k : k + 1], upper[k : k + 1])
    assert_allclose(error.distance, 0.09, rtol=1e-12)
    assert_allclose(whole(point, path).distance, 0.01, rtol=1e-12)


def test_windows_are_cut_off_at_the_ends_of_the_motion():
    lower, upper = foot_windows(np.array([0.0, 1.0, 3.0, 3.0]), back=1, ahead=2, margin=0.5)
    assert_allclose(lower, [-0.5, -0.5, 0.5, 2.5])
    assert_allclose(upper, [3.5, 3.5, 3.5, 3.5])


def test_rows_without_travel_are_passed_over():
    path = toolpath(dwell(0.5), line(10, 0), dwell(1.0), line(10, 10))
    error = whole([[0.0, 3.0, 0.0], [4.0, 0.0, 0.0]], path)
    assert_allclose(error.distance, [3.0, 0.0], atol=1e-15)
    assert error.line.tolist() == [1, 2]


def streamed(path, place, signals, cuts, path_cuts, back, ahead, margin):
    """Run the stage over chunks; each path chunk comes before the samples that run on it."""
    step, state, parts, seen = measuring(Reach(back, ahead, margin)), None, [], 0
    bounds = [0, *cuts, len(place)]
    path_bounds = [0, *path_cuts, len(path)]
    for low, high in pairwise(bounds):
        last = high == len(place)
        while seen < len(path_bounds) - 1 and (
            last or path.arc_length[path_bounds[seen]] <= place[max(high - 1, 0)]
        ):
            state, errors = step(
                state,
                rows(path, path_bounds[seen], path_bounds[seen + 1]),
                place[:0],
                [s[:0] for s in signals],
                False,
            )
            parts.append(errors)
            seen += 1
        state, errors = step(state, None, place[low:high], [s[low:high] for s in signals], last)
        parts.append(errors)
    return [
        ContourError(
            *(
                np.concatenate([getattr(part[i], name) for part in parts])
                for name in ("distance", "foot", "arc_length", "line")
            )
        )
        for i in range(len(signals))
    ]


@pytest.mark.parametrize("chunk", [1, 2, 7, 64, 1000])
@pytest.mark.parametrize("path_chunk", [1, 3, 50])
def test_streamed_equals_whole_bit_for_bit(chunk, path_chunk):
    path = some_path(3)
    rng = np.random.default_rng(5)
    n = 300
    place = np.sort(rng.uniform(0, path.arc_length[-1], n))
    signals = [rng.uniform(-10, 10, (n, 3)) for _ in range(2)]
    expected = [contour_error(s, path, *foot_windows(place, 11, 4, 0.5)) for s in signals]
    got = streamed(
        path,
        place,
        signals,
        list(range(chunk, n, chunk)),
        list(range(path_chunk, len(path), path_chunk)),
        11,
        4,
        0.5,
    )
    for mine, theirs in zip(got, expected, strict=True):
        assert_array_equal(mine.distance, theirs.distance)
        assert_array_equal(mine.foot, theirs.foot)
        assert_array_equal(mine.arc_length, theirs.arc_length)
        assert_array_equal(mine.line, theirs.line)


@pytest.mark.parametrize(("back", "ahead"), [(0, 0), (3, 0), (0, 2), (5, 40)])
def test_streamed_where_windows_end_on_vertices(back, ahead):
    # places, segments and margin on one grid: windows begin and end where segments do
    corners = np.cumsum(np.random.default_rng(6).choice([-1.0, 1.0], (60, 3)) * [[0.5, 0.0, 0.0]], axis=0)
    corners[::2, 1] += 0.5
    path = toolpath(*[line(*c) for c in corners])
    place = np.repeat(path.arc_length[:-1], 3)
    signal = np.repeat(corners, 3, axis=0) + np.array([0.0, 0.25, 0.0])
    expected = contour_error(signal, path, *foot_windows(place, back, ahead, 0.5))
    (got,) = streamed(path, place, [signal], range(4, len(place), 4), range(1, len(path)), back, ahead, 0.5)
    for name in ("distance", "foot", "arc_length", "line"):
        assert_array_equal(getattr(got, name), getattr(expected, name))


@pytest.mark.parametrize("seed", range(20))
def test_a_sample_waits_for_the_move_that_begins_where_its_window_ends(seed):
    # the end of one move and the start of the next are one point, but not to the last bit
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-9, 9, (3, 3))
    path = toolpath(line(*corners[1]), line(*corners[2]), start=tuple(corners[0]))
    place = path.arc_length[:2]
    signal = path.end[[0, 0], :3] + 0.1 * rng.normal(size=(2, 3))
    expected = contour_error(signal, path, *foot_windows(place, 0, 0, 0.0))
    step = measuring(Reach(0, 0, 0.0))
    state, first = step(None, rows(path, 0, 1), place, (signal,), False)
    state, second = step(state, rows(path, 1, 2), place[:0], (signal[:0],), True)
    assert_array_equal(np.concatenate([first[0].distance, second[0].distance]), expected.distance)


@pytest.mark.parametrize(("back", "ahead"), [(0, 0), (1, 0), (20, 10)])
def test_memory_does_not_grow_with_the_path(back, ahead):
    step, state, held = measuring(Reach(back, ahead, 0.5)), None, []
    for k in range(50):
        path = toolpath(*[line(10.0 * k + 0.1 * j, 0.0) for j in range(1, 101)], start=(10.0 * k, 0.0, 0.0))
        path = replace(path, arc_length=frozen(path.arc_length + 10.0 * k))
        place = 10.0 * k + np.linspace(0.0, 9.0, 100)
        state, _ = step(state, path, place, (np.stack([place, 0 * place, 0 * place], axis=1),), False)
        held.append(state.windows.path.low.size)
    assert max(held) <= 300


def test_path_out_of_reach_is_forgotten():
    path = toolpath(*[line(0.1 * k, 0.0) for k in range(1, 2001)])
    kept = since(segments(path, first=True), 190.0)
    assert kept.low.size < 110
    assert kept.low[0] <= 190.0 <= kept.high[-1]


def test_a_tally_does_not_depend_on_the_cut():
    rng = np.random.default_rng(1)
    path = toolpath(line(10.0, 0.0))
    error = whole(rng.uniform(-1, 11, (1000, 3)), path)
    at_once = tally(Tally(), error)
    state = Tally()
    for low in range(0, 1000, 13):
        part = slice(low, low + 13)
        state = tally(
            state,
            ContourError(error.distance[part], error.foot[part], error.arc_length[part], error.line[part]),
        )
    assert state == at_once
    assert_allclose(at_once.rms, np.sqrt(np.mean(error.distance**2)), rtol=1e-14)
    assert at_once.max == error.distance.max()


# --- the layout -----------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(20))
def test_segments_stand_for_the_programmed_curves_and_lie_in_their_boxes(seed):
    path = some_path(seed)
    laid = segments(path, first=True)
    assert_array_equal(laid.line, path.line)
    shares = np.linspace(0.0, 1.0, 41)
    for row in range(len(path)):
        points = naive.curve_points(path, row, shares)
        at = frozen(naive.places(path, row, shares))
        rows_ = frozen_integers(np.full(at.size, row))
        found = points_at(at, rows_, path_table(laid))
        assert_allclose(found, points, atol=1e-7)
        assert (laid.boxes[row, :3] <= points).all()
        assert (points <= laid.boxes[row, 3:]).all()


def turning_path(seed, count=400):
    """Short lines in runs of any length, that turn back now and then, and a few arcs between them."""
    rng = np.random.default_rng(seed)
    moves, at, heading = [], np.zeros(3), rng.uniform(0, TURN)
    for k in range(count):
        heading += rng.choice([0.02, 0.3, 3.0], p=[0.9, 0.07, 0.03]) * rng.normal()
        step = 10 ** rng.uniform(-3, 0) * np.array([np.cos(heading), np.sin(heading), 0.1 * rng.normal()])
        if k % 90 == 89:
            center, at = at + 0.1 * np.eye(3)[0], at + 0.2 * np.eye(3)[0]
            moves.append(arc(tuple(at), tuple(center), np.pi))
        at = at + step
        moves.append(line(*at))
    return toolpath(*moves)


@pytest.mark.parametrize("seed", range(6))
def test_windows_of_any_length_equal_brute_force_for_signals_near_and_far(seed):
    rng = np.random.default_rng(seed)
    path = toolpath(*[line(*p) for p in turning_path(seed).end])
    place = np.sort(rng.uniform(0, path.arc_length[-1], 300))
    on_path = np.stack([np.interp(place, path.arc_length[1:], path.end[:, i]) for i in range(3)], axis=1)
    for error, width in ((1e-4, 3.0), (0.1, 20.0), (5.0, 1000.0)):
        points = on_path + error * rng.normal(size=(300, 3))
        found = contour_error(points, path, place - width, place + width)
        expected = [
            naive.polyline_distance(p, path, a, b)
            for p, a, b in zip(points, place - width, place + width, strict=True)
        ]
        assert_allclose(found.distance, expected, atol=1e-12)


def test_an_empty_path_is_a_wrong_call():
    with pytest.raises(ValueError, match="needs a path"):
        whole([[0.0, 0.0, 0.0]], rows(toolpath(line(1, 0)), 0, 0))
