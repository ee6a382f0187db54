"""The paper's path: a circle in space that leans 45 degrees on two axes, and the time law that runs it.

The speed rises to the feed as ``F sin(pi t / 2 ta)^2``, falls likewise at the end, and is constant between:
one lap of a circle of radius R takes ``2 pi R / F + ta``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import ceil, cos, pi, sin

import numpy as np

from cnc_shape.arrays import FloatArray, frozen, frozen_integers
from cnc_shape.program import XYZ, Motion, PathMode, Program
from cnc_shape.toolpath import Toolpath, build_toolpath
from cnc_shape.trajectory import Trajectory
from cnc_shape.units import DEGREE, MM_PER_MIN, TWO_PI

BEYOND = 2.0  # mm of the circle that a toolpath goes on before and after its laps: what lags is no error


@dataclass(frozen=True, slots=True)
class TiltedCircle:
    """A circle about the origin, and how it is run.

    Its plane is that of x and y, leaned about x and then about y: ``M = Ry Rx``. The paper says only that it
    leans 45 degrees on x and y; the order is a choice.
    """

    radius: float = 50.0  # mm
    feed_rate: float = 1000.0 * MM_PER_MIN  # mm/s
    about_x: float = 45.0 * DEGREE
    about_y: float = 45.0 * DEGREE
    ramp: float = 0.1  # s, from rest to the feed
    laps: int = 1
    sample_time: float = 1e-3  # s

    @property
    def length(self) -> float:
        """Of all laps, mm."""
        return TWO_PI * self.radius * self.laps

    @property
    def duration(self) -> float:
        """From rest to rest, s."""
        return self.length / self.feed_rate + self.ramp

    @property
    def frame(self) -> FloatArray:
        """(3,3): its columns are where the circle begins, a quarter on from there, and its axis."""
        return _frame(self.about_x, self.about_y)


@cache
def _frame(about_x: float, about_y: float) -> FloatArray:
    c, s = cos(about_x), sin(about_x)
    lean_x = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    c, s = cos(about_y), sin(about_y)
    lean_y = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    return frozen(lean_y @ lean_x)


def along(circle: TiltedCircle, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Place (mm), speed (mm/s) and acceleration along the path (mm/s^2) at times (n,) s."""
    feed, ramp, end = circle.feed_rate, circle.ramp, circle.duration
    t = np.clip(time, 0.0, end)
    since = np.minimum(np.minimum(t, end - t), ramp)  # the start, the end of time backwards, or feed
    place = 0.5 * feed * (since - ramp / pi * np.sin(pi * since / ramp))
    speed = feed * np.sin(0.5 * pi * since / ramp) ** 2
    rate = 0.5 * pi * feed / ramp * np.sin(pi * since / ramp)
    late = 2.0 * t > end
    cruising = feed * np.clip(np.where(late, end - t, t) - ramp, 0.0, None)
    place = place + cruising
    return np.where(late, circle.length - place, place), speed, np.where(late, -rate, rate)


def command(circle: TiltedCircle) -> Trajectory:
    """The motion as samples, analytic in velocity and acceleration; the last is at rest."""
    samples = ceil(circle.duration / circle.sample_time - 1e-9) + 1
    place, speed, rate = along(circle, circle.sample_time * np.arange(samples, dtype=np.float64))
    outward, forward = directions(circle, place)
    return Trajectory(
        XYZ,
        circle.sample_time,
        frozen(place),
        frozen(circle.radius * outward),
        frozen(speed[:, None] * forward),
        frozen(rate[:, None] * forward - (speed**2 / circle.radius)[:, None] * outward),
    )


def directions(circle: TiltedCircle, place: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Outward and forward unit vectors at places (n,) mm, (n,3) each."""
    angle = (place / circle.radius)[:, None]
    start, across, _ = circle.frame.T
    outward = np.cos(angle) * start + np.sin(angle) * across
    return outward, np.cos(angle) * across - np.sin(angle) * start


def toolpath(circle: TiltedCircle) -> Toolpath:
    """The circle as programmed, one exact arc a lap.

    It begins a little before the start and goes on a little after the end, at places below zero and beyond
    the length: a drive that reads half a count behind its start is on the circle all the same.
    """
    lap = TWO_PI * circle.radius
    ends = np.array([-BEYOND, *(lap * np.arange(circle.laps + 1)), circle.length + BEYOND])
    count = ends.size - 1
    at = circle.radius * directions(circle, ends)[0]
    nan = frozen(np.full(count, np.nan))
    program = Program(
        source="tilted circle",
        axes=XYZ,
        start=frozen(at[0]),
        motion=frozen_integers([int(Motion.ARC)] * count),
        target=frozen(at[1:]),
        center=frozen(np.zeros((count, 3))),
        normal=frozen(np.tile(circle.frame[:, 2], (count, 1))),
        sweep=frozen(np.diff(ends) / circle.radius),
        feed_rate=frozen(np.full(count, circle.feed_rate)),
        dwell=frozen(np.zeros(count)),
        path_mode=frozen_integers([int(PathMode.EXACT_PATH)] * count),
        path_tolerance=nan,
        merge_tolerance=nan,
        line=frozen_integers(np.arange(1, count + 1)),
    )
    return build_toolpath(program, -BEYOND)


def off_circle(circle: TiltedCircle, position: FloatArray) -> FloatArray:
    """Distance of positions (n,3) mm from the circle, (n,) mm: the geometry alone, without a toolpath."""
    axis = circle.frame[:, 2]
    height = position @ axis
    in_plane = position - height[:, None] * axis
    return np.hypot(height, np.linalg.norm(in_plane, axis=1) - circle.radius)
