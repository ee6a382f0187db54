"""Time trajectories as CSV: ``time_s,x_mm,…``. They bypass the planner; their path is their own polyline."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.errors import InfeasibleError, ProgramError
from cnc_shape.program import Motion, Program
from cnc_shape.readers.source import Source
from cnc_shape.readers.table import TIME, Header, read_rows
from cnc_shape.readers.waypoints import polyline, positions
from cnc_shape.toolpath import Toolpath, build_toolpath, rotary_travel, travel_lengths
from cnc_shape.trajectory import Trajectory


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
        if kept and values[clock] <= kept[-1][clock]:
            way = "stands still" if values[clock] == kept[-1][clock] else "runs backwards"
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


def resample(points: TimedPoints, sample_time: float, *, samples: int) -> tuple[Trajectory, Toolpath]:
    """Resample the rows linearly; return the commands and the polyline they are measured against.

    Velocity is the backward difference of the resampled positions, 0 at the first sample, and acceleration
    the backward difference of that: all that a replayed table knows.

    Parameters
    ----------
    points
        The rows.
    sample_time
        s.
    samples
        The most that are made.

    Raises
    ------
    InfeasibleError
        More samples than `samples`.
    """
    steps = ceil(points.time[-1] / sample_time - 1e-9)
    if steps >= samples:
        raise InfeasibleError(
            f"the trajectory lasts {points.time[-1]:g} s: more samples than the limit of {samples}",
            hint="raise the limit of the samples or sample_time_s",
            source=points.source,
        )
    toolpath = build_toolpath(timed_program(points))
    along = np.concatenate([[0.0], np.cumsum(travel_lengths(timed_program(points)))])
    time: FloatArray = np.arange(steps + 1, dtype=np.float64) * sample_time
    columns: list[FloatArray] = [np.interp(time, points.time, column) for column in points.position.T]
    position = np.column_stack(columns)
    velocity = np.diff(position, axis=0, prepend=position[:1]) / sample_time
    acceleration = np.diff(velocity, axis=0, prepend=velocity[:1]) / sample_time
    trajectory = Trajectory(
        axes=points.axes,
        sample_time=sample_time,
        arc_length=frozen(np.interp(time, points.time, along)),
        position=frozen(position),
        velocity=frozen(velocity),
        acceleration=frozen(acceleration),
    )
    return trajectory, toolpath
