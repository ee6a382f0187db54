"""Rows of a time trajectory as CSV: ``time_s,x_mm,…``, and the polyline through them."""

from __future__ import annotations

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


def timed_program(points: TimedPoints) -> Program:
    """Polyline through the rows, each at the speed that its times say; rows without travel are dwells."""
    program = polyline(points.source, points.axes, points.position, points.line)
    period = np.diff(points.time)
    travel = travel_lengths(program)
    travel = np.where(travel > 0.0, travel, rotary_travel(program))
    still = travel == 0.0
    return replace(
        program,
        motion=frozen_integers(np.where(still, int(Motion.DWELL), int(Motion.FEED))),
        feed_rate=frozen(np.where(still, np.inf, travel / period)),
        dwell=frozen(np.where(still, period, 0.0)),
    )
