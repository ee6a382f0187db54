"""Time trajectories at the servo period. They bypass the planner; their path is their own polyline."""

from __future__ import annotations

from math import ceil, cos, radians

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.errors import InfeasibleError
from cnc_shape.readers.timed import TimedPoints, timed_program
from cnc_shape.toolpath import Toolpath, build_toolpath, travel_lengths
from cnc_shape.trajectory import Trajectory


CORNER = radians(20.0)  # between two steps: beyond, the path has a corner and does not bend


def rates(position: FloatArray, sample_time: float) -> tuple[FloatArray, FloatArray]:
    """Velocity and acceleration of sampled positions, each (n,d); both are 0 at either end.

    They are central differences, the mean of the step that arrives at a sample and the one that leaves it:
    exact to the second order, and along the tangent wherever the path bends evenly. A corner has no tangent,
    and the mean would point along neither side of it. There the velocity is that of arriving, so that a loop
    which feeds ``(velocity[k+1] - velocity[k]) / T`` forward turns with the path and not a sample ahead of it,
    and the acceleration is only what changes the speed: a corner is no curvature.

    Parameters
    ----------
    position
        (n,d) mm or rad; x, y, z come first.
    sample_time
        s.
    """
    velocity, acceleration = np.zeros_like(position), np.zeros_like(position)
    step = np.diff(position, axis=0) / sample_time
    arriving, leaving = step[:-1], step[1:]
    speed = np.sqrt((step[:, :3] ** 2).sum(axis=1))
    cosine = (arriving[:, :3] * leaving[:, :3]).sum(axis=1)
    both = speed[:-1] * speed[1:]
    corner = np.flatnonzero((both > 0.0) & (cosine < cos(CORNER) * both))
    velocity[1:-1] = 0.5 * (arriving + leaving)
    velocity[1 + corner] = arriving[corner]
    acceleration[1:-1] = (leaving - arriving) / sample_time
    gain = (speed[1:] / np.where(speed[:-1] > 0.0, speed[:-1], 1.0) - 1.0) / sample_time
    acceleration[1 + corner, :3] = gain[corner, None] * arriving[corner, :3]
    return velocity, acceleration


def resample(points: TimedPoints, sample_time: float, *, samples: int) -> tuple[Trajectory, Toolpath]:
    """Resample the rows linearly; return the commands and the polyline they are measured against.

    Velocity and acceleration are `rates` of the resampled positions: all that a replayed table knows.

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
    velocity, acceleration = rates(position, sample_time)
    trajectory = Trajectory(
        axes=points.axes,
        sample_time=sample_time,
        arc_length=frozen(np.interp(time, points.time, along)),
        position=frozen(position),
        velocity=frozen(velocity),
        acceleration=frozen(acceleration),
    )
    return trajectory, build_toolpath(program)
