"""The circle through the rows of a time trajectory, as exact arcs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, pi

import numpy as np

from cnc_shape.arrays import FloatArray, frozen, frozen_integers
from cnc_shape.errors import InfeasibleError, ProgramError
from cnc_shape.program import Motion
from cnc_shape.readers.timed import SAME_POINT, Spans, TimedPath, TimedPoints, new_points, timed_path
from cnc_shape.readers.waypoints import polyline
from cnc_shape.units import MICROMETRE

OFF_CIRCLE = 1e-3  # mm, by which a row may leave the circle
OFF_CIRCLE_SHARE = 1e-4  # -, of the radius, by which it may leave a large one
LARGEST_RADIUS = 1e6  # mm, beyond which the rows are straight
_TURN = 2.0 * pi


@dataclass(frozen=True, eq=False, slots=True)
class Circle:
    """A circle in space."""

    center: FloatArray  # (3,) mm
    radius: float  # mm
    along: FloatArray  # (3,) unit vector in the plane, angle 0
    across: FloatArray  # (3,) unit vector in the plane, a quarter turn on

    @property
    def normal(self) -> FloatArray:
        """Unit normal, about which angles count."""
        return np.cross(self.along, self.across)

    def angle(self, position: FloatArray) -> FloatArray:
        """Angle of the points nearest to (n,3) mm, (n,) rad; steps are less than a half turn."""
        arm = position - self.center
        return np.unwrap(np.arctan2(arm @ self.across, arm @ self.along))

    def at(self, angle: FloatArray) -> FloatArray:
        """Points, (n,3) mm."""
        cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
        return self.center + self.radius * (cosine * self.along + sine * self.across)


def circle_through(points: TimedPoints, *, closed: bool) -> TimedPath:
    """Arcs of the circle through the rows, one from row to row, with the turns and the sense they have.

    closed: one more completes the last turn. Rows that repeat a point are dwells.

    Raises
    ------
    ProgramError
        A row that leaves the circle.
    InfeasibleError
        Rows that are no circle: fewer than three points, or straight.
    """
    xyz = points.position[:, :3]
    circle = fit_circle(points)
    angle = circle.angle(xyz)
    _refuse_rows_off(points, circle)
    rows = new_points(circle.at(angle))
    turn = np.repeat(angle[rows], np.diff(rows, append=angle.size))
    seconds = np.diff(points.time)
    line, rotary = points.line, points.position[:, 3:]
    if closed:
        made = float(turn[-1] - turn[0])
        rest = ceil(abs(made) / _TURN - SAME_POINT / (_TURN * circle.radius)) * _TURN - abs(made)
        if rest * circle.radius > SAME_POINT:
            turn = np.append(turn, turn[-1] + np.copysign(rest, made))
            seconds, line = np.append(seconds, 0.0), np.append(line, line[0])
            rotary = np.vstack([rotary, rotary[:1]])
    sweep = np.diff(turn)
    count = sweep.size
    target = frozen(np.column_stack([circle.at(turn), rotary]))
    lines = polyline(points.source, points.axes, target, frozen_integers(line))
    program = replace(
        lines,
        motion=frozen_integers(np.where(sweep == 0.0, int(Motion.FEED), int(Motion.ARC))),
        center=frozen(np.where(sweep[:, None] == 0.0, 0.0, circle.center)),
        normal=frozen(np.tile(circle.normal, (count, 1))),
        sweep=frozen(sweep),
    )
    return timed_path(points, program, Spans(frozen_integers(np.ones(count)), frozen(seconds)))


def fit_circle(points: TimedPoints) -> Circle:
    """Circle through the rows: the plane nearest to them, then the circle in it, by least squares.

    Rows that repeat a point count once. The circle is that of least distances (Gauss-Newton), not the
    algebraic one, from which it starts: that is too small where the rows are an arc and scatter.

    Raises
    ------
    InfeasibleError
        Fewer than three points, or straight ones.
    """
    position = points.position[:, :3]
    position = position[new_points(position)]
    middle = position.mean(axis=0)
    _, size, axes = np.linalg.svd(position - middle, full_matrices=False)
    straight = len(position) < 3 or size[1] <= 1e-9 * size[0]
    along, normal = axes[0], np.cross(axes[0], axes[-1 if straight else 1])
    normal = normal if normal[np.abs(normal).argmax()] > 0.0 else -normal  # as of G17, G18, G19
    across = np.cross(normal, along)
    x, y = (position - middle) @ along, (position - middle) @ across
    radius = np.inf
    center = np.zeros(2)
    if not straight:
        algebraic = _least_squares(np.column_stack([x, y, np.ones_like(x)]), x * x + y * y)
        center = algebraic[:2] / 2.0
        radius = float(np.sqrt(algebraic[2] + center @ center))
        for _ in range(10):
            dx, dy = x - center[0], y - center[1]
            arm = np.hypot(dx, dy)
            slope = np.column_stack([dx / arm, dy / arm, np.ones_like(arm)])
            step = _least_squares(slope, arm - radius)
            center, radius = center + step[:2], radius + float(step[2])
            if np.abs(step).max() < 1e-12 * radius:
                break
    if not radius < LARGEST_RADIUS:
        raise InfeasibleError(
            "the rows are fewer than three points, or straight: there is no circle through them",
            hint="take --path polyline",
            source=points.source,
        )
    return Circle(
        frozen(middle + center[0] * along + center[1] * across), radius, frozen(along), frozen(across)
    )


def _least_squares(matrix: FloatArray, right: FloatArray) -> FloatArray:
    return frozen(np.linalg.lstsq(matrix, right, rcond=None)[0])


def _refuse_rows_off(points: TimedPoints, circle: Circle) -> None:
    position = points.position[:, :3]
    arm = position - circle.center
    height = arm @ circle.normal
    off = np.hypot(np.hypot(arm @ circle.along, arm @ circle.across) - circle.radius, height)
    reach = float(np.ptp(position, axis=0).max()) / 2.0  # the radius, of a full turn
    allowed = max(OFF_CIRCLE, OFF_CIRCLE_SHARE * min(circle.radius, reach))
    worst = int(off.argmax())
    if not off[worst] <= allowed:
        raise ProgramError(
            points.source, int(points.line[worst]), 1,
            f"the row is {off[worst] / MICROMETRE:.6g} µm off the circle of radius {circle.radius:.6g} mm "
            f"through the rows, by more than {allowed / MICROMETRE:.3g} µm",
            hint="take --path spline or --path polyline",
        )  # fmt: skip
