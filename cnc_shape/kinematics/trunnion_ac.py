"""Trunnion: a table that tilts about x (a) and turns about its own z (c) below a fixed spindle.

The axes are the tool's position in the workpiece's frame and both angles, so no pose is singular. Only the
way back from a tool's direction to angles is, where the tool stands upright.
"""

from __future__ import annotations

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.kernels.kinematics_trunnion import machine_positions, machine_rates, workpiece_positions
from cnc_shape.kinematics.kinematics import Kinematics, rows
from cnc_shape.kinematics.legs import triple_rows
from cnc_shape.program import XYZ

NAMES = (*XYZ, "a", "c")
UPRIGHT = 1e-12  # rad of tilt up to which the direction does not tell c


def tool_direction(a: FloatArray, c: FloatArray) -> FloatArray:
    """Direction of the tool in the workpiece's frame, unit vectors (n,3); a, c (n,) rad."""
    return np.stack([np.sin(a) * np.sin(c), np.sin(a) * np.cos(c), np.cos(a)], axis=-1)


def angles_of(direction: FloatArray, c_before: float) -> tuple[FloatArray, FloatArray]:
    """Angles a >= 0 and c, (n,) rad each, that point the tool along `direction` (n,3).

    The table turns the short way from row to row, beginning at `c_before` (rad), and stays where it is while
    the tool stands upright.
    """
    x, y, z = rows(direction, 3).T
    flat = np.hypot(x, y)
    a = np.arctan2(flat, z)
    tells = flat > UPRIGHT * np.hypot(flat, z)
    turned = np.concatenate([[c_before], np.arctan2(x, y)])
    latest = np.maximum.accumulate(np.where(np.concatenate([[True], tells]), np.arange(len(turned)), 0))
    return a, np.unwrap(turned[latest])[1:]


def _turn(first: FloatArray, second: FloatArray) -> FloatArray:
    """Angle between the tool's directions at poses (n,5), (n,) rad."""
    one = tool_direction(rows(first, 5)[:, 3], first[:, 4])
    other = tool_direction(rows(second, 5)[:, 3], second[:, 4])
    return np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), (one * other).sum(axis=1))


def trunnion_ac(pivot: FloatArray) -> Kinematics:
    """Return the kinematics of a trunnion whose axes meet at `pivot`, (3,) mm in the program's frame.

    Raises
    ------
    ValueError
        If `pivot` has another shape, or a number is not finite.
    """
    point = frozen(triple_rows("pivot", np.atleast_2d(pivot), 1)[0])

    def forward(joints: FloatArray, near: FloatArray) -> FloatArray:
        axes = np.empty((len(joints), 5))
        workpiece_positions(rows(joints, 5), point, axes)
        return axes

    def inverse(axes: FloatArray) -> FloatArray:
        joints = np.empty((len(axes), 5))
        machine_positions(rows(axes, 5), point, joints)
        return joints

    def inverse_jacobian(axes: FloatArray) -> FloatArray:
        rates = np.empty((len(axes), 5, 5))
        machine_rates(rows(axes, 5), point, rates)
        return rates

    return Kinematics("trunnion_ac", NAMES, NAMES, forward, inverse, inverse_jacobian, _turn)
