"""Rows of a time trajectory as CSV: ``time_s,x_mm,…``, and the polyline through them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.errors import ProgramError
from cnc_shape.program import Motion, Program
from cnc_shape.readers.source import Source
from cnc_shape.readers.table import TIME, Header, read_rows
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


def read_timed_points(source: Source, header: Header) -> TimedPoints:
    """Read all rows; time counts from the first.

    Raises
    ------
    ProgramError
        As `read_rows`; time that does not go on; fewer than two rows.
    """
    kept: list[list[float]] = []
    numbers: list[int] = []
    clock = header.names.index(TIME)
    for number, values in read_rows(source, header):
        if kept and values[clock] < kept[-1][clock] + SHORTEST:
            way = "runs backwards" if values[clock] < kept[-1][clock] else "stands still"
            raise ProgramError(
                source.name, number, 1, f"time {way} at {values[clock]:g} s", hint="rows are in order of time"
            )
        kept.append(values)
        numbers.append(number)
    if len(kept) < 2:
        raise ProgramError(
            source.name, None, None, "fewer than two rows", hint="a trajectory has two rows at least"
        )
    table = np.array(kept, dtype=np.float64)
    return TimedPoints(
        source=source.name,
        axes=header.axes,
        time=frozen(table[:, clock] - table[0, clock]),
        position=frozen(positions(header, table)),
        line=frozen_integers(numbers),
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
