"""Toolpath: lengths and extents in closed form, and the fold over chunks."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from paths import arc, dwell, line, program
from programs import chunks, read

from cnc_shape.errors import InfeasibleError
from cnc_shape.readers import ReadingOptions, read_program
from cnc_shape.toolpath import Toolpath, build_toolpath, building, check_travel, extent, travel_lengths


def curve(move, start, points=20001):
    """Points along an arc, from its definition: radius and height linear in the angle."""
    start, end = np.array(start), np.array(move["target"])
    normal, center, sweep = np.array(move["normal"]), np.array(move["center"]), move["sweep"]
    arm = start - center
    rise = (end - start) @ normal
    last = np.linalg.norm(end - center - rise * normal)
    along = arm / np.linalg.norm(arm)
    across = np.cross(normal, along)
    share = np.linspace(0.0, 1.0, points)[:, None]
    radius = np.linalg.norm(arm) + share * (last - np.linalg.norm(arm))
    angle = share * sweep
    return center + radius * (along * np.cos(angle) + across * np.sin(angle)) + share * rise * normal


@st.composite
def arcs(draw):
    """Arcs, helices and spirals of any plane, turn and tilt; the start is the origin."""
    direction = st.floats(-1.0, 1.0)
    normal = np.array([draw(direction), draw(direction), draw(direction)])
    if np.linalg.norm(normal) < 0.1 or draw(st.booleans()):
        normal = np.eye(3)[draw(st.integers(0, 2))]
    normal /= np.linalg.norm(normal)
    along = np.cross(normal, np.roll(normal, 1) + np.array([0.3, 0.5, 0.7]))
    along /= np.linalg.norm(along)
    radius = draw(st.floats(0.5, 50.0))
    sweep = draw(st.floats(0.05, 30.0)) * draw(st.sampled_from([-1.0, 1.0]))
    grown = radius * (1.0 + draw(st.floats(-1e-3, 1e-3)))
    rise = draw(st.sampled_from([0.0, 0.01, 3.0, -20.0]))
    center = -radius * along
    across = np.cross(normal, along)
    end = center + grown * (along * math.cos(sweep) + across * math.sin(sweep)) + rise * normal
    return arc(tuple(end), tuple(center), sweep, normal=tuple(normal))


@given(arcs())
@settings(max_examples=100)
def test_an_arc_is_as_long_and_reaches_as_far_as_its_points(move):
    points = curve(move, (0.0, 0.0, 0.0))
    one = program(move)
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert_allclose(travel_lengths(one), chords, rtol=1e-5)
    low, high = extent(one)
    scale = np.abs(points).max()
    past = 1e-6 * scale + 1e-9  # of the sampled extremes, which fall short
    assert_allclose(np.minimum(low[0], 0.0), points.min(axis=0), atol=past)  # its start is the origin
    assert_allclose(np.maximum(high[0], 0.0), points.max(axis=0), atol=past)


@pytest.mark.parametrize("turns", [1, 2, 1000])
def test_a_circle_and_a_helix_in_closed_form(turns):
    sweep = 2 * math.pi * turns
    flat = program(arc((0.0, 0.0, 0.0), (5.0, 0.0, 0.0), sweep))
    assert_allclose(travel_lengths(flat), [5 * sweep], rtol=1e-14)
    low, high = extent(flat)
    assert_allclose(low, [[0.0, -5.0, 0.0]], atol=1e-12)
    assert_allclose(high, [[10.0, 5.0, 0.0]], atol=1e-12)
    helix = program(arc((0.0, 0.0, 7.0), (5.0, 0.0, 0.0), -sweep))
    assert_allclose(travel_lengths(helix), [math.hypot(5 * sweep, 7.0)], rtol=1e-14)
    assert_allclose(extent(helix)[1], [[10.0, 5.0, 7.0]], atol=1e-12)


def test_a_spiral_in_closed_form():
    # r from r0 to r1 over phi: with s = dr/dphi, length = [r sqrt(r^2 + s^2) + s^2 asinh(r / s)] / (2 s)
    r0, r1, phi = 0.01, 0.03, 2.5
    s = (r1 - r0) / phi
    primitive = lambda r: (r * math.hypot(r, s) + s * s * math.asinh(r / s)) / (2 * s)  # noqa: E731
    end = (r1 * math.cos(phi), r1 * math.sin(phi), 0.0)
    spiral = program(arc(end, (0.0, 0.0, 0.0), phi), start=(r0, 0.0, 0.0))
    assert_allclose(travel_lengths(spiral), [primitive(r1) - primitive(r0)], rtol=1e-10)


def test_a_quarter_reaches_no_further_than_its_ends():
    quarter = program(arc((10.0, 10.0, 0.0), (0.0, 10.0, 0.0), math.pi / 2))
    low, high = extent(quarter)
    assert_allclose(low, [[10.0, 10.0, 0.0]])  # its start belongs to the move before
    assert_allclose(high, [[10.0, 10.0, 0.0]])


def test_moves_that_go_nowhere_are_dropped_and_dwells_stay():
    path = build_toolpath(program(line(1.0, 0.0), line(1.0, 0.0), dwell(0.5), line(1.0, 1.0)))
    assert path.line.tolist() == [1, 3, 4]
    assert path.arc_length.tolist() == [0.0, 1.0, 1.0, 2.0]
    assert path.dwell.tolist() == [0.0, 0.5, 0.0]


def test_travel_too_small_to_have_a_length_is_none():
    assert len(build_toolpath(program(line(1e-200, 0.0)))) == 0


@pytest.mark.parametrize("rows", [1, 2, 7, 1000])
def test_a_streamed_toolpath_has_the_bits_of_the_whole(rows):
    text = (
        "F100 G0 X.1\n" + "G3 X.2 Y.3 R.7\nG2 X.1 Y0 R.6\nG1 X.7 Y.1 Z.1\nG1 X.1 A.1\nG4 P1\n" * 60 + "M2\n"
    )
    whole = build_toolpath(read(text))
    step, state, parts = building(), None, []
    pieces = chunks(text, how=ReadingOptions(rows=rows))
    for number, piece in enumerate(pieces):
        state, part = step(state, piece, number == len(pieces) - 1)
        parts.append(part)
    for name in Toolpath.__slots__:
        want = getattr(whole, name)
        if name == "arc_length":
            got = np.concatenate([[0.0], *[part.arc_length[1:] for part in parts]])
        elif isinstance(want, np.ndarray):
            got = np.concatenate([getattr(part, name) for part in parts])
        else:
            continue
        np.testing.assert_array_equal(got, want, err_msg=name)
    assert state == whole.arc_length[-1]


def test_travel_is_checked_along_the_whole_arc():
    half = program(line(10.0, 0.0), arc((-10.0, 0.0, 0.0), (0.0, 0.0, 0.0), math.pi))
    check_travel(half, {"x": (-10.0, 10.0), "y": (0.0, 10.0)})
    with pytest.raises(InfeasibleError, match=r"Y reaches 10 mm, beyond .* -1 to 9\.5 mm") as caught:
        check_travel(half, {"y": (-1.0, 9.5)})
    assert caught.value.line == 2


def test_rotary_travel_is_told_in_degrees():
    turned = program(line(0.0, 0.0, 0.0, math.pi), axes=("x", "y", "z", "a"))
    with pytest.raises(InfeasibleError, match="A reaches 180°, beyond its travel of -90 to 90°"):
        check_travel(turned, {"a": (-math.pi / 2, math.pi / 2)})


def test_increments_that_cancel_to_rounding_leave_the_rotary_axes_alone(tmp_path):
    text = "G21 G90\nG91 G1 X0.1 F600\nX0.2\nG90 X0.3 A90 F600\nM2\n"  # 0.1 + 0.2 is not 0.3
    (tmp_path / "part.nc").write_text(text)
    read = read_program(tmp_path / "part.nc")
    assert travel_lengths(read)[-1] == 0.0
    assert_allclose(read.feed_rate[-1], np.deg2rad(600.0) / 60.0)
