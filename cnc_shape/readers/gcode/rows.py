"""Moves on their way into the columns of a `Program`."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import inf
from typing import NamedTuple

import numpy as np

from cnc_shape.arrays import BoolArray, FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.program import ROTARY, XYZ, Motion, Note, Program, vertical_normals
from cnc_shape.readers.gcode.modal import AXES, Modal
from cnc_shape.readers.source import CHUNK_ROWS
from cnc_shape.toolpath import rotary_travel, travel_lengths
from cnc_shape.units import DEGREE


class Feed(NamedTuple):
    """The feed of a move as it was programmed."""

    along: float = inf  # mm/s of XYZ travel, or moves per second
    about: float = inf  # deg/s of rotary axes alone, or moves per second
    per_move: bool = False  # moves per second


AS_FAST_AS_THE_AXES_CAN = Feed()


class Columns(NamedTuple):
    """Room for n moves; plain arrays, so that compiled code fills them as well."""

    motion: IntArray  # (n,) Motion
    line: IntArray  # (n,)
    target: FloatArray  # (n,6) mm and degrees
    feed: FloatArray  # (n,) mm/s, or 1/s
    angular: FloatArray  # (n,) deg/s, or 1/s
    per_move: BoolArray  # (n,) the feed is moves per second
    dwell: FloatArray  # (n,) s
    path_mode: IntArray  # (n,) PathMode
    path_tolerance: FloatArray  # (n,) mm
    merge_tolerance: FloatArray  # (n,) mm


def _columns(rows: int) -> Columns:
    def floats() -> FloatArray:
        return np.empty(rows, dtype=np.float64)

    def integers() -> IntArray:
        return np.empty(rows, dtype=np.int64)

    return Columns(
        motion=integers(), line=integers(), target=np.empty((rows, len(AXES)), dtype=np.float64),
        feed=floats(), angular=floats(), per_move=np.empty(rows, dtype=np.bool_), dwell=floats(),
        path_mode=integers(), path_tolerance=floats(), merge_tolerance=floats(),
    )  # fmt: skip


@dataclass(slots=True)
class Rows:
    """The moves since the last chunk was handed on. Arcs are few: their geometry stands aside."""

    columns: Columns = field(default_factory=lambda: _columns(CHUNK_ROWS))
    count: int = 0
    arcs: list[tuple[int, tuple[float, float, float], tuple[float, float, float], float]] = field(
        default_factory=list[tuple[int, tuple[float, float, float], tuple[float, float, float], float]]
    )
    notes: list[Note] = field(default_factory=list[Note])

    def __len__(self) -> int:
        return self.count

    def make_room(self) -> int:
        """Return how many rows fit by now: one more at least."""
        room = self.columns.line.size
        if self.count == room:
            more = _columns(room)
            joined = (np.concatenate(pair) for pair in zip(self.columns, more, strict=True))
            self.columns = Columns._make(joined)
        return self.columns.line.size

    def add(
        self,
        motion: Motion,
        line: int,
        modal: Modal,
        *,
        feed: Feed = AS_FAST_AS_THE_AXES_CAN,
        dwell: float = 0.0,
    ) -> None:
        """Append a move that ends at the present position."""
        self.make_room()
        row, columns = self.count, self.columns
        columns.motion[row] = motion
        columns.line[row] = line
        columns.target[row] = modal.position
        columns.feed[row], columns.angular[row], columns.per_move[row] = feed
        columns.dwell[row] = dwell
        columns.path_mode[row] = modal.path_mode
        columns.path_tolerance[row] = modal.path_tolerance
        columns.merge_tolerance[row] = modal.merge_tolerance
        self.count += 1

    def add_arc(
        self,
        line: int,
        modal: Modal,
        feed: Feed,
        center: tuple[float, float, float],
        normal: tuple[float, float, float],
        sweep: float,
    ) -> None:
        """Append an arc that ends at the present position."""
        self.arcs.append((self.count, center, normal, sweep))
        self.add(Motion.ARC, line, modal, feed=feed)


def to_program(rows: Rows, source: str, axes: tuple[str, ...], start: FloatArray) -> Program:
    """Turn the rows into columns: radians, and feed rates that hold for the move at hand."""
    count = rows.count
    columns = Columns._make(column[:count] for column in rows.columns)
    rotary = [len(XYZ) + ROTARY.index(axis) for axis in axes[len(XYZ) :]]
    target = columns.target[:, : len(XYZ)]
    if rotary:
        target = np.hstack([target, columns.target[:, rotary] * DEGREE])
    center, normal, sweep = np.zeros((count, 3)), vertical_normals(count), np.zeros(count)
    if rows.arcs:
        index = [arc[0] for arc in rows.arcs]
        center[index] = [arc[1] for arc in rows.arcs]
        normal[index] = [arc[2] for arc in rows.arcs]
        sweep[index] = [arc[3] for arc in rows.arcs]
    program = Program(
        source=source,
        axes=axes,
        start=start,
        motion=frozen_integers(columns.motion),
        target=frozen(target),
        center=frozen(center),
        normal=frozen(normal),
        sweep=frozen(sweep),
        feed_rate=frozen(columns.feed),
        dwell=frozen(columns.dwell),
        path_mode=frozen_integers(columns.path_mode),
        path_tolerance=frozen(columns.path_tolerance),
        merge_tolerance=frozen(columns.merge_tolerance),
        line=frozen_integers(columns.line),
        notes=tuple(rows.notes),
    )
    if not rotary and not columns.per_move.any():
        return program
    return replace(program, feed_rate=frozen(_feed_rates(program, columns)))


def _feed_rates(program: Program, columns: Columns) -> FloatArray:
    """Resolve feeds: moves with XYZ travel take it along XYZ, moves of rotary axes alone about these."""
    length = travel_lengths(program)
    turn = rotary_travel(program)
    rate = np.where((length == 0.0) & (turn > 0.0), columns.angular * DEGREE, columns.feed)
    along = np.where(length > 0.0, length, turn)
    with np.errstate(invalid="ignore"):
        rate = np.where(columns.per_move, np.where(along > 0.0, columns.feed * along, np.inf), rate)
    return np.where(program.motion == Motion.RAPID, columns.feed, rate)
