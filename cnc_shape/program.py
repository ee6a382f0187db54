"""Program: what a reader makes of a text. Modal state is resolved, every row is one programmed move."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.units import DEGREE

XYZ = ("x", "y", "z")
ROTARY = ("a", "b", "c")  # rad inside


def unit_of(axis: str) -> float:
    """What 1 is inside, of what people write and read along an axis: a millimetre in mm, a degree in rad."""
    return DEGREE if axis in ROTARY else 1.0


class Motion(IntEnum):
    """What a row does."""

    RAPID = 0
    FEED = 1
    ARC = 2
    DWELL = 6


class PathMode(IntEnum):
    """How a move joins the next one."""

    EXACT_STOP = 0  # G61.1: rest at its end
    EXACT_PATH = 1  # G61: on the path, rest only where the direction turns
    BLEND = 2  # G64: leave the path by no more than the tolerance


@dataclass(frozen=True, slots=True)
class Note:
    """A warning of a reader."""

    line: int
    message: str


@dataclass(frozen=True, eq=False, slots=True)
class Program:
    """A chunk of programmed moves as columns, one row a move, in the machine frame.

    The first chunk starts at `start`; each later chunk starts where the one before it ended. Axes are
    x, y, z and then the rotary axes that the program uses.
    """

    source: str
    axes: tuple[str, ...]
    start: FloatArray  # (d,) mm or rad, position before the first row
    motion: IntArray  # (m,) Motion
    target: FloatArray  # (m,d) mm or rad
    center: FloatArray  # (m,3) mm, arcs only; the foot of the axis at the arc's start
    normal: FloatArray  # (m,3) unit normal of the arc's plane; counter-clockwise about it is positive
    sweep: FloatArray  # (m,) rad, signed angle of arcs, full turns included; 0 for others
    feed_rate: FloatArray  # (m,) mm/s (rad/s for rotary-only moves); inf: as fast as the axes can
    dwell: FloatArray  # (m,) s, rows of Motion.DWELL only
    path_mode: IntArray  # (m,) PathMode
    path_tolerance: FloatArray  # (m,) mm; nan: the machine's own
    merge_tolerance: FloatArray  # (m,) mm; nan: the planner's default share of the path tolerance
    line: IntArray  # (m,) 1-based line of the source
    notes: tuple[Note, ...] = field(default=())

    def __len__(self) -> int:
        return self.motion.size

    @property
    def end(self) -> FloatArray:
        """Position after the last row, (d,) mm or rad."""
        return self.target[-1] if len(self) else self.start


def vertical_normals(count: int) -> FloatArray:
    """Normals of moves that are no arcs, (count,3): along z."""
    normal = np.zeros((count, 3))
    normal[:, 2] = 1.0
    return normal


_COLUMNS = (
    "motion", "target", "center", "normal", "sweep", "feed_rate", "dwell", "path_mode", "path_tolerance",
    "merge_tolerance", "line",
)  # fmt: skip


def concatenate(chunks: Iterable[Program]) -> Program:
    """Join consecutive chunks of one program into one."""
    parts = list(chunks)
    first = parts[0]
    if len(parts) == 1:
        return first
    columns = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _COLUMNS}
    integers = ("motion", "path_mode", "line")
    return Program(
        source=first.source,
        axes=first.axes,
        start=first.start,
        notes=tuple(note for part in parts for note in part.notes),
        **{n: frozen_integers(c) if n in integers else frozen(c) for n, c in columns.items()},  # pyright: ignore[reportArgumentType]
    )
