"""Programmed points as an ``.npz``: one row a move, in the units of the door: mm, degrees, mm/min."""

from __future__ import annotations

import io
from collections.abc import Iterable

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray
from cnc_shape.program import ROTARY, XYZ, Motion, Program, unit_of
from cnc_shape.toolpath import rotary_travel, travel_lengths
from cnc_shape.units import DEGREE, MM_PER_MIN

POINT_AXES = (*XYZ, *ROTARY)


def points_of(program: Program) -> dict[str, FloatArray | IntArray]:
    """Columns ``kind, end (n,6), length_mm, feed_mm_min, sweep_rad, line`` of a chunk; dwells are left out.

    A feed without end (a rapid) is written as 0; moves of rotary axes alone have theirs in degrees/min.
    """
    moves = program.motion != Motion.DWELL
    end = np.zeros((len(program), len(POINT_AXES)))
    for column, axis in enumerate(program.axes):
        end[:, POINT_AXES.index(axis)] = program.target[:, column] / unit_of(axis)
    length = travel_lengths(program)
    alone = (length == 0.0) & (rotary_travel(program) > 0.0)
    feed = np.where(np.isfinite(program.feed_rate), program.feed_rate, 0.0) / MM_PER_MIN
    feed = np.where(alone, feed / DEGREE, feed)
    return {
        "kind": program.motion[moves],
        "end": end[moves],
        "length_mm": length[moves],
        "feed_mm_min": feed[moves],
        "sweep_rad": program.sweep[moves],
        "line": program.line[moves],
    }


def points_file(chunks: Iterable[dict[str, FloatArray | IntArray]]) -> bytes:
    """Join the columns of consecutive chunks to the content of an ``.npz`` file."""
    parts = list(chunks)
    buffer = io.BytesIO()
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    np.savez_compressed(buffer, allow_pickle=False, **columns)
    return buffer.getvalue()
