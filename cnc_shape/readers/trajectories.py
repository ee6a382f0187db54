"""Time trajectories at the servo period. They bypass the planner; their path is that through their rows."""

from __future__ import annotations

from math import ceil, cos, radians

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.errors import InfeasibleError
from cnc_shape.readers.timed import TimedPath
from cnc_shape.toolpath import Toolpath, build_toolpath
from cnc_shape.trajectory import Trajectory

SAME_PERIOD = 1.0 + 1e-6  # -, of the sample time: rows no farther apart come with every sample
CORNER = radians(20.0)  # between two steps: beyond, the path has a corner and does not bend


def rates(position: FloatArray, sample_time: float) -> tuple[FloatArray, FloatArray]:
    """Velocity and acceleration of sampled positions, each (n,d); both are 0 at either end.

    They are central differences, the mean of the step that arrives at a sample and the one that leaves it:
    exact to the second order, and along the tangent wherever the path bends evenly. A corner has no tangent,
    and the mean would point along neither side of it. There the velocity is that of arriving, and the
    acceleration its part along that: the brake before the corner, but no curvature.

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
    along = arriving[corner, :3] / speed[corner, None]
    braking = (acceleration[1 + corner, :3] * along).sum(axis=1)
    acceleration[1 + corner, :3] = braking[:, None] * along
    return velocity, acceleration


def resample(path: TimedPath, sample_time: float, *, samples: int) -> tuple[Trajectory, Toolpath]:
    """Resample the rows; return the commands and the path they are measured against.

    Positions lie on the straight line between two rows. Where the path is a spline, and rows that move are
    farther apart than samples, they lie on the spline: its parameter goes with time through the rows as a
    monotone cubic (PCHIP), so that commands keep the path, meet every row in time and never run back.
    Velocity and acceleration are `rates` of the resampled positions: all that a replayed table knows.

    Parameters
    ----------
    path
        The rows, and the path through them.
    sample_time
        s.
    samples
        The most that are made.

    Raises
    ------
    InfeasibleError
        More samples than `samples`.
    """
    points = path.points
    steps = ceil(points.time[-1] / sample_time - 1e-9)
    if steps >= samples:
        raise InfeasibleError(
            f"the trajectory lasts {points.time[-1]:g} s: more samples than the limit of {samples}",
            hint="raise the limit of the samples or sample_time_s",
            source=points.source,
        )
    time: FloatArray = np.arange(steps + 1, dtype=np.float64) * sample_time
    time = frozen(np.minimum(time, points.time[-1]))
    columns: list[FloatArray] = [np.interp(time, points.time, column) for column in points.position.T]
    place: FloatArray = np.interp(time, points.time, path.place)
    if path.spline is not None and _coarser(path, sample_time):
        from scipy.interpolate import PchipInterpolator  # pyright: ignore[reportUnknownVariableType]

        spline = path.spline
        parameter = frozen(PchipInterpolator(points.time, spline.parameter)(time))
        columns[:3] = spline.at(parameter).T
        place = np.interp(parameter, spline.node, spline.place)
    position = np.column_stack(columns)
    velocity, acceleration = rates(position, sample_time)
    trajectory = Trajectory(
        axes=points.axes,
        sample_time=sample_time,
        arc_length=frozen(place),
        position=frozen(position),
        velocity=frozen(velocity),
        acceleration=frozen(acceleration),
        replayed=True,
        rounded=True,
    )
    return trajectory, build_toolpath(path.program)


def _coarser(path: TimedPath, sample_time: float) -> bool:
    """Whether there are moving rows farther apart in time than samples."""
    moving = np.diff(path.place) > 0.0
    return bool((np.diff(path.points.time)[moving] > SAME_PERIOD * sample_time).any())
