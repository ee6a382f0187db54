"""Recording: the samples of a case that its report keeps, in bounded memory.

Up to `KEPT` samples all are kept. A longer motion is kept in buckets of equal width, two samples each: the
one where the tool is farthest from the path, and the one where it is nearest, in order of time. The width is
a power of two that goes with the number of samples, and the best of two buckets is the best of their
bests: so what is kept does not depend on how the samples came in chunks. The worst place always stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.contour import ContourError
from cnc_shape.kernels.foot_point import points_at
from cnc_shape.segments import segments
from cnc_shape.simulation import Response
from cnc_shape.toolpath import Toolpath

OUTLINE_ANGLE = 0.05  # rad, of a chord that stands for an arc in a drawing
KEPT = 2_000_000  # samples of a case that are kept as they are
DECIMATED = 200_000  # samples that a longer motion is thinned to, at most


@dataclass(frozen=True, eq=False, slots=True)
class Signals:
    """The samples of one case that were kept for the report; decimated by `factor` beyond its limit."""

    case: str
    axes: tuple[str, ...]
    factor: int  # 1: every sample; n: the worst and the best of every 2 n
    time: FloatArray  # (n,) s
    command: FloatArray  # (n,d) mm or rad
    position: FloatArray  # (n,d) mm or rad, of the drives
    tool: FloatArray  # (n,d) mm or rad
    velocity: FloatArray  # (n,d) mm/s, of the command
    acceleration: FloatArray  # (n,d) mm/s^2, of the command
    command_error: FloatArray  # (n,) mm, contour error of the command
    drive_error: FloatArray  # (n,) mm
    tool_error: FloatArray  # (n,) mm
    foot: FloatArray  # (n,3) mm, the path's nearest point to the tool
    line: IntArray  # (n,) source line of the foot point of the tool
    settling_time: FloatArray  # (m,) s, after the end of the motion
    settling: FloatArray  # (m,d) mm or rad, tool minus drive then

    def __post_init__(self) -> None:
        if self.command.shape != (self.time.size, len(self.axes)):
            raise ValueError(f"{self.command.shape=}")


class Recorder:
    """Collects the signals of one case, block by block."""

    def __init__(self, case: str, axes: tuple[str, ...], sample_time: float, kept: int = KEPT) -> None:
        self._case, self._axes, self._sample_time = case, axes, sample_time
        self._kept = kept
        self._most = max(kept * DECIMATED // KEPT, 4)
        self._waiting: list[FloatArray] = []  # rows of samples whose contour error is not decided yet
        self._table: list[FloatArray] = []  # rows: index, command, position, tool, v, a, foot, errors, line
        self._rows = 0
        self._count = 0

    def add(self, response: Response, errors: Sequence[ContourError]) -> None:
        """Take a block of samples, and the contour errors of those that are decided by now.

        errors: of the command, the drives and the tool.
        """
        command = response.command
        self._waiting.append(
            np.hstack(
                [command.position, response.position, response.tool, command.velocity, command.acceleration]
            )
        )
        decided = errors[0].distance.size
        if decided == 0:
            return
        rows = np.concatenate(self._waiting)
        self._waiting = [rows[decided:]]
        index = np.arange(self._count, self._count + decided)
        distances = [error.distance for error in errors]
        columns = [index, rows[:decided], errors[-1].foot, *distances, errors[-1].line]
        self._append(np.column_stack(columns).astype(np.float64, copy=False))
        self._count += decided

    def signals(self, settling: FloatArray) -> Signals:
        """What was kept, as one value; call it after the last block.

        settling: (m,d) tool minus drive, every sample from the end of the motion on.
        """
        d = len(self._axes)
        table = np.concatenate(self._table) if self._table else np.zeros((0, 5 * d + 8))
        width = self._width(self._count)
        if width > 1:
            table = _thin(table, width)
        parts = [frozen(table[:, 1 + k * d : 1 + (k + 1) * d]) for k in range(5)]
        errors = [frozen(table[:, 5 * d + 4 + k]) for k in range(3)]
        return Signals(
            case=self._case, axes=self._axes, factor=max(width // 2, 1),
            time=frozen(table[:, 0] * self._sample_time),
            command=parts[0], position=parts[1], tool=parts[2], velocity=parts[3], acceleration=parts[4],
            command_error=errors[0], drive_error=errors[1], tool_error=errors[2],
            foot=frozen(table[:, 5 * d + 1 : 5 * d + 4]), line=frozen_integers(table[:, -1]),
            settling_time=frozen(np.arange(settling.shape[0], dtype=np.int64) * self._sample_time),
            settling=frozen(settling),
        )  # fmt: skip

    def _width(self, count: int) -> int:
        """Samples a bucket after `count` samples: the least power of two that leaves few enough."""
        width = 1
        while count > self._kept and 2 * -(-count // width) > self._most:
            width *= 2
        return width

    def _append(self, table: FloatArray) -> None:
        self._table.append(table)
        self._rows += table.shape[0]
        after = int(table[-1, 0]) + 1
        width = self._width(after)
        if width == 1 or self._rows <= 2 * self._most:
            return
        whole = np.concatenate(self._table)
        complete = int(np.searchsorted(whole[:, 0], after - after % width))
        whole = np.concatenate([_thin(whole[:complete], width), whole[complete:]])
        self._table, self._rows = [whole], whole.shape[0]


class Outline:
    """Collects the programmed path as a polyline to draw."""

    def __init__(self) -> None:
        self._points: list[FloatArray] = []

    def add(self, toolpath: Toolpath) -> None:
        """Take the next chunk of the path; arcs are chopped into chords."""
        path = segments(toolpath, first=not self._points)
        if path.low.size == 0:
            return
        chords = np.ones(path.low.size, dtype=np.int64)
        turns = path.arc >= 0
        chords[turns] = np.ceil(path.arcs[:, 15] / OUTLINE_ANGLE).astype(np.int64)
        row = np.repeat(np.arange(chords.size), chords)
        share = (np.arange(row.size) - np.repeat(np.cumsum(chords) - chords, chords) + 1) / chords[row]
        place = path.low[row] + share * (path.high[row] - path.low[row])
        points = points_at(
            frozen(place),
            frozen_integers(row),
            path.start,
            path.end,
            path.low,
            path.high,
            path.arc,
            path.arcs,
        )
        self._points.append(points if self._points else np.vstack([path.start[:1], points]))

    def points(self) -> FloatArray:
        """The polyline, (p,3) mm."""
        return frozen(np.concatenate(self._points) if self._points else np.zeros((0, 3)))


def _thin(table: FloatArray, width: int) -> FloatArray:
    """Keep the rows with the largest and the smallest tool error of every bucket of `width` samples."""
    if table.shape[0] == 0:
        return table
    bucket = (table[:, 0] // width).astype(np.int64)
    error = table[:, -2]
    first = np.flatnonzero(np.concatenate([[True], np.diff(bucket) > 0]))
    rows = np.arange(table.shape[0], dtype=np.int64)
    by_error = np.lexsort((rows, error, bucket))  # within a bucket: rising error, then time
    last = np.concatenate([first[1:], [table.shape[0]]]) - 1
    highest = np.maximum.reduceat(error, first)
    # among equals the earliest row counts, for the largest as for the smallest
    is_highest = error == np.repeat(highest, last - first + 1)
    top = np.minimum.reduceat(np.where(is_highest, rows, table.shape[0]), first)
    keep = np.unique(np.concatenate([by_error[first], top]))
    return table[keep]
