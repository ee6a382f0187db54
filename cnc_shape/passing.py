"""Passing: how long every move of a toolpath takes.

The cells of a path know their place on the toolpath, and a time law knows when it is where in which cell. So
the end of a move is passed at a time of its own, also where many moves share one straight chord, and where a
corner is rounded: half of the rounding belongs to each side.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import TypeAlias

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.feedrate import Profile
from cnc_shape.kernels.passing import ALONE, TRAVEL, WAIT, passing_times
from cnc_shape.program import Motion
from cnc_shape.toolpath import Toolpath


@dataclass(frozen=True, eq=False, slots=True)
class Moves:
    """A chunk of the moves and dwells of a toolpath in the order they are made, one row each.

    A line of the program may have made several (a canned cycle), and come again (a loop).
    """

    line: IntArray  # (m,)
    kind: IntArray  # (m,) Motion
    start: FloatArray  # (m,) s
    time: FloatArray  # (m,) s, from its start to the start of the next
    naive_time: FloatArray  # (m,) s, as if it needed neither acceleration nor rounding
    length: FloatArray  # (m,) mm of XYZ travel
    feed_rate: FloatArray  # (m,) mm/s, rad/s where rotary axes move alone; inf for rapids

    def __len__(self) -> int:
        return self.line.size


@dataclass(frozen=True, eq=False, slots=True)
class _Rows:
    """Moves whose end has not been passed."""

    line: IntArray
    kind: IntArray
    what: IntArray  # of the kernel
    border: FloatArray  # mm, place of the end
    dwell: FloatArray  # s
    naive_time: FloatArray  # s
    length: FloatArray  # mm
    feed_rate: FloatArray

    def cut(self, rows: slice) -> _Rows:
        return _Rows(*(getattr(self, field.name)[rows] for field in fields(self)))


@dataclass(frozen=True, eq=False, slots=True)
class PassingState:
    """Between two chunks: moves that are still to be made, and when the last one ended."""

    parts: tuple[_Rows, ...]
    memory: IntArray  # (1,) of the kernel
    clock: float  # s


PassingStep: TypeAlias = Callable[
    [PassingState | None, Toolpath, Profile, bool], tuple[PassingState | None, Moves]
]


def passing(velocity: Sequence[float]) -> PassingStep:
    """Return the resumable step to Moves: ``step(state, toolpath, profile, last) -> (state, moves)``.

    Toolpath and profile are what has come in since the last step; the toolpath may be ahead. The moves do not
    depend on how either was cut into chunks.

    Parameters
    ----------
    velocity
        mm/s or rad/s, limits of the axes of the toolpath: at these the naive time takes a rapid.
    """
    limits = np.array(velocity)

    def step(
        state: PassingState | None, toolpath: Toolpath, profile: Profile, last: bool
    ) -> tuple[PassingState | None, Moves]:
        before = state or PassingState((), frozen_integers(np.zeros(1)), 0.0)
        parts = (*before.parts, _rows(toolpath, limits)) if len(toolpath) else before.parts
        if not parts or not (len(profile) or last):
            return PassingState(parts, before.memory, before.clock), _moves(_rows(toolpath, limits), [], 0.0)
        due, path, memory = _join(parts), profile.path, before.memory.copy()
        ends = passing_times(
            due.what, due.border, due.dwell, profile.time, profile.duration, profile.u, profile.velocity,
            profile.acceleration, profile.jerk, profile.cell, path.stop, path.arc_length, path.stretch,
            memory,
        )  # fmt: skip
        if last:
            end = profile.end_time if len(profile) else before.clock
            ends = np.concatenate([ends, np.full(due.line.size - ends.size, end)])
        moves = _moves(due, ends, before.clock)
        if last:
            return None, moves
        clock = float(ends[-1]) if ends.size else before.clock
        return PassingState((due.cut(slice(ends.size, None)),), frozen_integers(memory), clock), moves

    return step


def naive_times(toolpath: Toolpath, velocity: FloatArray) -> FloatArray:
    """Time of every row as if speed could jump, (m,) s: length over feed rate; dwells as they are.

    Rapids, and all else without a feed, run straight as fast as the axes' `velocity` (d,) lets them.
    """
    change = np.abs(toolpath.end - toolpath.start)
    length, square = np.diff(toolpath.arc_length), np.zeros(len(toolpath))
    for column in range(3, len(toolpath.axes)):
        square = square + change[:, column] ** 2
    travel = np.where(length > 0.0, length, np.sqrt(square))
    feed = np.full(len(toolpath), np.inf)
    np.divide(travel, toolpath.feed_rate, out=feed, where=toolpath.feed_rate > 0.0)
    slowest = np.zeros(len(toolpath))
    for column, limit in enumerate(velocity):
        if limit > 0.0:
            slowest = np.maximum(slowest, change[:, column] / limit)
    moving = np.where(np.isinf(toolpath.feed_rate), slowest, feed)
    return np.where(toolpath.kind == Motion.DWELL, toolpath.dwell, moving)


def _rows(toolpath: Toolpath, velocity: FloatArray) -> _Rows:
    length = np.diff(toolpath.arc_length)
    what = np.where(length > 0.0, TRAVEL, ALONE)
    return _Rows(
        toolpath.line,
        toolpath.kind,
        frozen_integers(np.where(toolpath.kind == Motion.DWELL, WAIT, what)),
        frozen(toolpath.arc_length[1:]),
        toolpath.dwell,
        frozen(naive_times(toolpath, velocity)),
        frozen(length),
        toolpath.feed_rate,
    )


def _join(parts: Sequence[_Rows]) -> _Rows:
    if len(parts) == 1:
        return parts[0]
    columns = [np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(_Rows)]
    for column in columns:
        column.setflags(write=False)
    return _Rows(*columns)


def _moves(rows: _Rows, ends: FloatArray | list[float], clock: float) -> Moves:
    """The first rows as moves, which end at `ends`; the first of them begins at `clock`."""
    made = rows.cut(slice(0, len(ends)))
    borders = np.concatenate([[clock], ends])
    start, time = frozen(borders[:-1]), frozen(np.diff(borders))
    return Moves(made.line, made.kind, start, time, made.naive_time, made.length, made.feed_rate)
