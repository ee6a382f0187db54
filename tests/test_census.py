"""Census: counts, sums and bounds, whatever the chunks."""

from __future__ import annotations

import io
import math

import numpy as np
import pytest
from archives import arrays_of
from numpy.testing import assert_allclose
from programs import chunks

from cnc_shape.census import Census, count
from cnc_shape.readers import ReadingOptions
from cnc_shape.writers.points import points_file, points_of

PART = """G21 G90 F600
G0 X10 Y0 Z5
G1 Z0
G3 X-10 I-10
G4 P1.5
G1 A90
G93 G1 X-10 Y30 F2
M2
"""


def census(text: str, rows: int = 1000) -> Census:
    state = None
    for chunk in chunks(text, how=ReadingOptions(rows=rows)):
        state = count(state, chunk)
    assert state is not None
    return state


def test_what_a_small_part_amounts_to():
    result = census(PART)
    assert (result.rapids, result.feeds, result.arcs, result.dwells) == (1, 3, 1, 1)
    assert_allclose(result.rapid_length, math.hypot(10, 5))
    assert_allclose(result.feed_length, 5 + 10 * math.pi + 30)
    assert_allclose(result.feed_time, 0.5 + math.pi + 90 / 600 * 60 + 30.0)  # 600 degrees/min about A
    assert result.dwell == 1.5
    assert_allclose(result.low, [-10, 0, 0], atol=1e-12)
    assert_allclose(result.high, [10, 30, 5])
    assert_allclose(result.position, [-10, 30, 0, math.pi / 2], atol=1e-12)


def test_bounds_begin_with_the_path():
    assert census("G0 X5 Y5 Z5\nF1 G1 X6\nM2\n").low.tolist() == [
        5.0,
        5.0,
        5.0,
    ]  # a rapid comes from anywhere
    assert census("G4 P1\nF1 G1 X6 Y5 Z5\nM2\n").low.tolist() == [0.0, 0.0, 0.0]  # a feed begins where it is


def test_a_program_without_moves():
    result = census("G21\nM2\n")
    assert not (result.low <= result.high).any()
    assert result.position.tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("rows", [1, 2, 7, 1000])
def test_chunks_of_any_size_give_the_same_bits(rows):
    text = (
        PART.replace("M2", "G94 F77\n") + "G1 X.1 Y.2\nG2 X.3 Y.1 R1\nG0 Z.1\nG4 P.1\nG1 A.1\n" * 40 + "M2\n"
    )
    whole, streamed = census(text, 10**9), census(text, rows)
    for name in Census.__slots__:
        np.testing.assert_array_equal(getattr(whole, name), getattr(streamed, name), err_msg=name)


def test_points_are_in_the_units_of_the_door():
    file = arrays_of(
        io.BytesIO(points_file([points_of(part) for part in chunks(PART, how=ReadingOptions(rows=2))]))
    )
    assert file["kind"].tolist() == [0, 1, 2, 1, 1]  # the dwell is no move
    assert file["line"].tolist() == [2, 3, 4, 6, 7]
    assert_allclose(file["end"][-1], [-10, 30, 0, 90, 0, 0], atol=1e-12)
    assert_allclose(file["length_mm"], [math.hypot(10, 5), 5, 10 * math.pi, 0, 30])
    assert_allclose(file["feed_mm_min"], [0, 600, 600, 600, 60])
    assert_allclose(file["sweep_rad"], [0, 0, math.pi, 0, 0])


def test_points_of_no_moves():
    file = arrays_of(io.BytesIO(points_file([points_of(part) for part in chunks("M2\n")])))
    assert file["end"].shape == (0, 6)
