"""Polyline: the toolpath as straight edges, each within a known share of its tolerance.

Arcs become circumscribed polygons, runs of short lines become chords. What they use of the path
tolerance is taken from the budget that is left for rounding the corners, so the sum keeps the promise.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import TypeAlias

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.kernels.chords import merge
from cnc_shape.kernels.polyline import polygonize
from cnc_shape.toolpath import Toolpath

LARGEST_MERGE_SHARE = 0.5  # -, of the path tolerance: merging leaves the corners their half


@dataclass(frozen=True, slots=True)
class Merging:
    """How much of the path tolerance the chords may use.

    A chord that cuts a smooth curve costs speed at its ends, so its share is small. A run that turns to
    and fro is noise: there a chord is worth more than the rounding, and gets `noise_share`.
    A merge tolerance that the program names replaces both.
    """

    path_tolerance: float  # mm, where the program names none
    merge_share: float = 0.1  # -
    noise_share: float = 0.5  # -


@dataclass(frozen=True, eq=False, slots=True)
class Polyline:
    """A chunk of straight edges, end to start. The last row of a program is an edge of no length."""

    start: FloatArray  # (n,d) mm or rad
    end: FloatArray  # (n,d) mm or rad
    place: FloatArray  # (n,) mm, of the start on the toolpath
    travel: FloatArray  # (n,) mm, length on the toolpath
    tolerance: FloatArray  # (n,) mm, left for rounding the corners of the edge
    feed_rate: FloatArray  # (n,) mm/s or rad/s
    dwell: FloatArray  # (n,) s, at the start
    line: IntArray  # (n,)
    stop: IntArray  # (n,) 1: rest at the start
    alone: IntArray  # (n,) 1: rotary axes move alone

    def __len__(self) -> int:
        return self.line.size

    def cut(self, rows: slice) -> Polyline:
        """Return a view of some rows."""
        return Polyline(*(getattr(self, field.name)[rows] for field in fields(self)))


def join(parts: Sequence[Polyline]) -> Polyline:
    """Join consecutive chunks."""
    if len(parts) == 1:
        return parts[0]
    columns = [np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Polyline)]
    for column in columns:
        column.setflags(write=False)
    return Polyline(*columns)


@dataclass(frozen=True, eq=False, slots=True)
class PolylineState:
    """Between two chunks: edges whose chord may grow, and how the last row ended."""

    start: FloatArray  # (p,d)
    end: FloatArray  # (p,d)
    values: FloatArray  # (9,p) the columns of `polygonize`, then merge and noise tolerance and mergeable
    marks: IntArray  # (4,p)
    memory: FloatArray  # (1+d,)
    flags: IntArray  # (5,)
    position: FloatArray  # (d,) reached by the last row
    place: float  # mm, of that on the toolpath
    line: int  # of the last row


PolylineStep: TypeAlias = Callable[
    [PolylineState | None, Toolpath, bool], tuple[PolylineState | None, Polyline]
]


def _merge_tolerances(
    named: FloatArray, tolerance: FloatArray, merging: Merging
) -> tuple[FloatArray, FloatArray]:
    """Merge tolerance of a run, and of a run that turns to and fro, (n,) mm each; `named`: nan for none."""
    given = np.minimum(named, LARGEST_MERGE_SHARE * tolerance)
    default = np.isnan(named)
    return (
        np.where(default, merging.merge_share * tolerance, given),
        np.where(default, merging.noise_share * tolerance, given),
    )


def polyline(merging: Merging) -> PolylineStep:
    """Return the resumable step from Toolpath to Polyline."""

    def step(
        state: PolylineState | None, toolpath: Toolpath, last: bool
    ) -> tuple[PolylineState | None, Polyline]:
        d = len(toolpath.axes)
        memory = state.memory.copy() if state else np.zeros(1 + d)
        flags = state.flags.copy() if state else np.zeros(5, np.int64)
        tolerance = frozen(
            np.where(np.isnan(toolpath.path_tolerance), merging.path_tolerance, toolpath.path_tolerance)
        )
        start, end, values, marks = polygonize(
            toolpath.kind, toolpath.start, toolpath.end, toolpath.center, toolpath.normal, toolpath.sweep,
            toolpath.feed_rate, toolpath.dwell, toolpath.path_mode, tolerance, toolpath.arc_length,
            toolpath.line, memory, flags,
        )  # fmt: skip
        row = np.abs(marks[3]) - 1
        fine, coarse = _merge_tolerances(toolpath.merge_tolerance[row], values[2], merging)
        values = np.vstack([values, fine, coarse, (marks[3] > 0) & (marks[2] == 0)])
        if state:
            start, end = np.vstack([state.start, start]), np.vstack([state.end, end])
            values, marks = np.hstack([state.values, values]), np.hstack([state.marks, marks])
        first, after, distance = merge(
            start, end, values[2], values[6], values[7], values[4], marks[1], values[8].astype(np.int64), last
        )
        chords = _chords(start, end, values, marks, first, after - 1, distance)
        if len(toolpath):
            place, line = float(toolpath.arc_length[-1]), int(toolpath.line[-1])
            position = toolpath.end[-1]
        elif state:
            position, place, line = state.position, state.place, state.line
        else:
            return None, chords
        if last:
            return None, join([chords, _rest(position, place, line, float(memory[0]))])
        held = slice(int(after[-1]) if after.size else 0, None)
        columns = (start[held], end[held], values[:, held], marks[:, held])
        return PolylineState(*columns, memory, flags, position, place, line), chords

    return step


def _chords(
    start: FloatArray,
    end: FloatArray,
    values: FloatArray,
    marks: IntArray,
    first: IntArray,
    last: IntArray,
    distance: FloatArray,
) -> Polyline:
    """Edges from the starts of `first` to the ends of `last`, at most `distance` from what they replace."""
    return Polyline(
        start=frozen(start[first]),
        end=frozen(end[last]),
        place=frozen(values[0][first]),
        travel=frozen(values[0][last] + values[1][last] - values[0][first]),
        tolerance=frozen(values[2][first] - np.maximum(values[3][first], distance)),
        feed_rate=frozen(values[4][first]),
        dwell=frozen(values[5][first]),
        line=frozen_integers(marks[0][first]),
        stop=frozen_integers(marks[1][first]),
        alone=frozen_integers(marks[2][first]),
    )


def _rest(position: FloatArray, place: float, line: int, dwell: float) -> Polyline:
    """Edge of no length at the end of the program."""
    here = frozen(position[None])
    return Polyline(
        start=here,
        end=here,
        place=frozen([place]),
        travel=frozen([0.0]),
        tolerance=frozen([0.0]),
        feed_rate=frozen([np.inf]),
        dwell=frozen([dwell]),
        line=frozen_integers([line]),
        stop=frozen_integers([1]),
        alone=frozen_integers([0]),
    )
