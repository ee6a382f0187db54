"""Rows of a time trajectory as CSV: ``time_s,x_mm,…``, and the path through them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.errors import ProgramError
from cnc_shape.program import Motion, Program
from cnc_shape.readers.source import Source
from cnc_shape.readers.table import TIME, Header, Rows, join_rows, read_rows
from cnc_shape.readers.waypoints import polyline, positions
from cnc_shape.toolpath import rotary_travel, travel_lengths

SHORTEST = 1e-9  # s, between two rows
SAME_POINT = 1e-6  # mm: rows nearer than that repeat a point of the path


@dataclass(frozen=True, eq=False, slots=True)
class TimedPoints:
    """The rows of a time trajectory."""

    source: str
    axes: tuple[str, ...]
    time: FloatArray  # (n,) s, increasing from 0
    position: FloatArray  # (n,d) mm or rad
    line: IntArray  # (n,)


def read_timed_points(source: Source, header: Header, *, rows: int, compiled_from: int) -> TimedPoints:
    """Read all rows as `read_rows` does; time counts from the first.

    Raises
    ------
    ProgramError
        As `read_rows`; time that does not go on; fewer than two rows.
    """
    clock = header.names.index(TIME)
    parts: list[Rows] = []
    before = -np.inf
    for part in read_rows(source, header, rows=rows, compiled_from=compiled_from):
        time = part.values[:, clock]
        last = np.concatenate([[before], time[:-1]])
        wrong = np.flatnonzero(time < last + SHORTEST)
        if wrong.size:
            k = int(wrong[0])
            way = "runs backwards" if time[k] < last[k] else "stands still"
            reason = f"time {way} at {time[k]:g} s"
            raise ProgramError(source.name, int(part.line[k]), 1, reason, hint="rows are in order of time")
        before = time[-1]
        parts.append(part)
    if sum(part.line.size for part in parts) < 2:
        raise ProgramError(
            source.name, None, None, "fewer than two rows", hint="a trajectory has two rows at least"
        )
    table = join_rows(parts)
    time = table.values[:, clock]
    return TimedPoints(
        source=source.name,
        axes=header.axes,
        time=frozen(time - time[0]),
        position=frozen(positions(header, table.values)),
        line=table.line,
    )


@dataclass(frozen=True, eq=False, slots=True)
class RowSpline:
    """A curve through the rows that a command may run along between them."""

    parameter: FloatArray  # (n,) mm, of every row
    at: Callable[[FloatArray], FloatArray]  # parameter (m,) mm -> point (m,3) mm
    node: FloatArray  # (k,) mm, parameter of the path's vertices
    place: FloatArray  # (k,) mm, of the vertices on the path


@dataclass(frozen=True, eq=False, slots=True)
class TimedPath:
    """A time trajectory and the path that it is measured against."""

    points: TimedPoints
    program: Program  # the path, each move at the speed that the rows' times say
    place: FloatArray  # (n,) mm, of every row on the path
    spline: RowSpline | None = None  # along which positions between the rows lie; None: on straight lines


@dataclass(frozen=True, eq=False, slots=True)
class Spans:
    """How the moves of a path divide the spans from row to row; the last one may lead back to the start."""

    pieces: IntArray  # (s,) moves of each span, at least 1
    seconds: FloatArray  # (s,) that it takes; 0 for the way back, which no row tells

    @property
    def span(self) -> IntArray:
        """The span of every move, (m,)."""
        return np.repeat(np.arange(self.pieces.size), self.pieces)

    @property
    def share(self) -> FloatArray:
        """Share of its span that lies behind the end of a move, (m,); 1 for the last."""
        ends = np.cumsum(self.pieces)
        before = np.repeat(ends - self.pieces, self.pieces)
        return (np.arange(1, before.size + 1) - before) / np.repeat(self.pieces, self.pieces)


def polyline_through(points: TimedPoints, *, closed: bool) -> TimedPath:
    """Straight lines from row to row; rows without travel are dwells. closed: one more leads back."""
    position, line, seconds = points.position, points.line, np.diff(points.time)
    if closed and len(new_points(position[[-1, 0], :3])) > 1:
        position, line = np.vstack([position, position[:1]]), np.append(line, line[0])
        seconds = np.append(seconds, 0.0)
    spans = Spans(frozen_integers(np.ones(seconds.size)), frozen(seconds))
    program = polyline(points.source, points.axes, frozen(position), frozen_integers(line))
    return timed_path(points, program, spans)


def timed_path(
    points: TimedPoints, program: Program, spans: Spans, spline: RowSpline | None = None
) -> TimedPath:
    """Give the moves of a path the speed that the rows' times say; what does not travel dwells."""
    seconds = np.repeat(spans.seconds / spans.pieces, spans.pieces)
    length = travel_lengths(program)
    travel = np.where(length > 0.0, length, rotary_travel(program))
    still = travel == 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = np.where(still, np.inf, travel / seconds)
    along = np.concatenate([[0.0], np.cumsum(length)])
    ends = np.concatenate([[0], np.cumsum(spans.pieces)])
    return TimedPath(
        points,
        replace(
            program,
            motion=frozen_integers(np.where(still, int(Motion.DWELL), program.motion)),
            feed_rate=frozen(speed),
            dwell=frozen(np.where(still, seconds, 0.0)),
        ),
        frozen(along[ends[: points.time.size]]),
        spline,
    )


def new_points(position: FloatArray) -> IntArray:
    """Rows that are away from the last such row by `SAME_POINT`, and the first: the rest repeat it.

    position: (n,3) mm.
    """
    step = np.sqrt((np.diff(position, axis=0) ** 2).sum(axis=1))
    new = np.ones(len(position), dtype=np.bool_)
    last = 0
    for row in (1 + np.flatnonzero(step < 2.0 * SAME_POINT)).tolist():  # farther than that it is new for sure
        last = row - 1 if new[row - 1] else last
        new[row] = np.sqrt(((position[row] - position[last]) ** 2).sum()) >= SAME_POINT
    return np.flatnonzero(new)
