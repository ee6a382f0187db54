"""Time trajectories at the servo period. They bypass the planner; their path is their own polyline."""

from __future__ import annotations

from math import ceil

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.errors import InfeasibleError
from cnc_shape.readers.timed import TimedPoints, timed_program
from cnc_shape.toolpath import Toolpath, build_toolpath, travel_lengths
from cnc_shape.trajectory import Trajectory


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
    program = timed_program(points)
    along = np.concatenate([[0.0], np.cumsum(travel_lengths(program))])
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
    return trajectory, build_toolpath(program)
