"""Rows of moves on their way into the columns of a `Program`."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from cnc_shape.arrays import FloatArray, frozen, frozen_integers
from cnc_shape.program import ROTARY, XYZ, Motion, Note, Program
from cnc_shape.toolpath import rotary_travel, travel_lengths
from cnc_shape.units import DEGREE

PER_TIME, PER_LENGTH = 0.0, 1.0  # what a feed number means: mm/s and deg/s, or moves per second

COLUMNS = 15
# motion, line, x y z mm, a b c deg, feed mm/s or 1/s, feed deg/s, PER_..., dwell s, path mode, tolerances mm
Row = tuple[
    float, int, float, float, float, float, float, float, float, float, float, float, float, float, float
]  # fmt: skip


@dataclass(slots=True)
class Rows:
    """The moves since the last chunk was handed on. Arcs are few: their geometry stands aside."""

    rows: list[Row] = field(default_factory=list[Row])
    arcs: list[tuple[int, tuple[float, float, float], tuple[float, float, float], float]] = field(
        default_factory=list[tuple[int, tuple[float, float, float], tuple[float, float, float], float]]
    )
    notes: list[Note] = field(default_factory=list[Note])

    def add_arc(
        self, row: Row, center: tuple[float, float, float], normal: tuple[float, float, float], sweep: float
    ) -> None:
        """Append an arc."""
        self.arcs.append((len(self.rows), center, normal, sweep))
        self.rows.append(row)


def to_program(rows: Rows, source: str, axes: tuple[str, ...], start: FloatArray) -> Program:
    """Turn the rows into columns: radians, and feed rates that hold for the move at hand."""
    table = np.array(rows.rows, dtype=np.float64).reshape(len(rows.rows), COLUMNS)
    count = len(table)
    rotary = [5 + ROTARY.index(axis) for axis in axes[len(XYZ) :]]
    target = np.hstack([table[:, 2:5], table[:, rotary] * DEGREE])
    center, normal, sweep = np.zeros((count, 3)), np.tile([0.0, 0.0, 1.0], (count, 1)), np.zeros(count)
    if rows.arcs:
        index = [arc[0] for arc in rows.arcs]
        center[index] = [arc[1] for arc in rows.arcs]
        normal[index] = [arc[2] for arc in rows.arcs]
        sweep[index] = [arc[3] for arc in rows.arcs]
    program = Program(
        source=source,
        axes=axes,
        start=start,
        motion=frozen_integers(table[:, 0]),
        target=frozen(target),
        center=frozen(center),
        normal=frozen(normal),
        sweep=frozen(sweep),
        feed_rate=frozen(table[:, 8]),
        dwell=frozen(table[:, 11]),
        path_mode=frozen_integers(table[:, 12]),
        path_tolerance=frozen(table[:, 13]),
        merge_tolerance=frozen(table[:, 14]),
        line=frozen_integers(table[:, 1]),
        notes=tuple(rows.notes),
    )
    return replace(program, feed_rate=frozen(_feed_rates(program, table)))


def _feed_rates(program: Program, table: FloatArray) -> FloatArray:
    """Resolve feeds: moves with XYZ travel take it along XYZ, moves of rotary axes alone about these."""
    feed, angular, meaning = table[:, 8], table[:, 9] * DEGREE, table[:, 10]
    if len(program.axes) == len(XYZ) and not meaning.any():
        return feed
    length = travel_lengths(program)
    turn = rotary_travel(program)
    rate = np.where((length == 0.0) & (turn > 0.0), angular, feed)
    along = np.where(length > 0.0, length, turn)
    with np.errstate(invalid="ignore"):
        rate = np.where(meaning == PER_LENGTH, np.where(along > 0.0, feed * along, np.inf), rate)
    return np.where(program.motion == Motion.RAPID, feed, rate)
