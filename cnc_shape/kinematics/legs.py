"""Platforms on six legs, whatever moves the legs: what all hexapods share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.kernels.kinematics_legs import jacobians_of, joints_of, poses_of, turns_of
from cnc_shape.kinematics.kinematics import Kinematics, rows
from cnc_shape.program import ROTARY, XYZ

AXES = (*XYZ, *ROTARY)
JOINTS = ("q1", "q2", "q3", "q4", "q5", "q6")
TOLERANCE = 1e-11  # mm, of the joints of a pose that has been found from them
ROUNDING = 1e-14  # the same, relative to the size of the machine, where that is more
ROUNDS = 50  # steps of Newton's method before a pose counts as not to be found


@dataclass(frozen=True, eq=False, slots=True)
class Legs:
    """Where six legs begin and end; see `cnc_shape.kernels.kinematics_legs` for their equations."""

    direction: FloatArray  # (6,3) unit vectors of the rails; zero: this leg extends, and its foot is fixed
    origin: FloatArray  # (6,3) mm, where the rails have q = 0; or the foot
    point: FloatArray  # (6,3) mm, the leg's end on the platform, from the tool centre point
    length: FloatArray  # (6,) mm, of a leg on a rail


def triple_rows(name: str, values: FloatArray, count: int = 6) -> FloatArray:
    """Return `count` finite vectors as a frozen array; else raise ValueError with the `name`."""
    array = frozen(values)
    if array.shape != (count, 3):
        raise ValueError(f"{name} has shape {array.shape}, not ({count}, 3)")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} has numbers that are not finite")
    return array


def offset_points(platform: FloatArray, tool_offset: FloatArray) -> FloatArray:
    """Points (6,3) of the platform, from its centre, as seen from the tool centre point."""
    offset = triple_rows("tool_offset", np.atleast_2d(tool_offset), 1)
    return frozen(platform - offset)


def orientation(axes: FloatArray) -> FloatArray:
    """Rotation matrices (n,3,3) of poses (n,6): R = Rz(c) Ry(b) Rx(a)."""
    a, b, c = rows(axes, 6)[:, 3:].T
    zero, one = np.zeros_like(a), np.ones_like(a)
    about_x = [[one, zero, zero], [zero, np.cos(a), -np.sin(a)], [zero, np.sin(a), np.cos(a)]]
    about_y = [[np.cos(b), zero, np.sin(b)], [zero, one, zero], [-np.sin(b), zero, np.cos(b)]]
    about_z = [[np.cos(c), -np.sin(c), zero], [np.sin(c), np.cos(c), zero], [zero, zero, one]]
    x, y, z = (np.moveaxis(np.array(matrix), 2, 0) for matrix in (about_x, about_y, about_z))
    return z @ y @ x


def twist_rates(axes: FloatArray) -> FloatArray:
    """Twist (v; omega) per rates of the axes at poses (n,6): (n,6,6), block diagonal with I and E(a,b,c).

    Joint rates per axis rates are joint rates per twist times this; omega is in base axes, rad/s.
    """
    angles = rows(axes, 6)[:, 3:]
    b, c = angles[:, 1], angles[:, 2]
    rates = np.zeros((len(angles), 6, 6))
    rates[:, [0, 1, 2], [0, 1, 2]] = 1.0
    rates[:, 3, 3], rates[:, 4, 3], rates[:, 5, 3] = np.cos(c) * np.cos(b), np.sin(c) * np.cos(b), -np.sin(b)
    rates[:, 3, 4], rates[:, 4, 4] = -np.sin(c), np.cos(c)
    rates[:, 5, 5] = 1.0
    return rates


def twist_jacobian(legs: Legs, position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Joint rates per twist (v of the tool centre point; omega) at a pose, (6,6), in base axes.

    Row i is the reciprocal screw of the passive joints of leg i, ``(s, (R b) x s) / s.d``.
    """
    arm = legs.point @ rotation.T
    c = position + arm - legs.origin
    along: FloatArray = np.einsum("ij,ij->i", c, legs.direction)
    square: FloatArray = np.einsum("ij,ij->i", c, c)
    slides = np.any(legs.direction != 0.0, axis=1)
    radicand: FloatArray = np.where(slides, legs.length**2 - square + along**2, square)
    reach = np.sqrt(np.where(radicand > 0.0, radicand, np.nan))
    s = np.where(slides, along - reach, 0.0)
    s = c - s[:, None] * legs.direction
    return np.hstack([s, np.cross(arm, s)]) / reach[:, None]


def on_legs(name: str, legs: Legs, radian: float) -> Kinematics:
    """Return the kinematics of a platform on `legs`; `radian` mm weigh as much as a radian."""
    direction, origin, point, length = legs.direction, legs.origin, legs.point, legs.length
    size = max(float(np.abs(part).max()) for part in (origin, point, length))
    tolerance = max(TOLERANCE, ROUNDING * size)

    def forward(joints: FloatArray, near: FloatArray) -> FloatArray:
        axes = np.empty((len(joints), 6))
        given, guess = rows(joints, 6), rows(near, 6)
        if len(given) != len(guess):
            raise ValueError(f"{joints.shape=}, {near.shape=}")
        poses_of(given, guess, direction, origin, point, length, tolerance, ROUNDS, axes)
        return axes

    def inverse(axes: FloatArray) -> FloatArray:
        joints = np.empty((len(axes), 6))
        joints_of(rows(axes, 6), direction, origin, point, length, joints)
        return joints

    def inverse_jacobian(axes: FloatArray) -> FloatArray:
        rates = np.empty((len(axes), 6, 6))
        jacobians_of(rows(axes, 6), direction, origin, point, length, rates)
        return rates

    def turn(first: FloatArray, second: FloatArray) -> FloatArray:
        if first.shape != second.shape:
            raise ValueError(f"{first.shape=}, {second.shape=}")
        angle = np.empty(len(first))
        turns_of(rows(first, 6), rows(second, 6), angle)
        return angle

    return Kinematics(name, AXES, JOINTS, forward, inverse, inverse_jacobian, turn, radian)
