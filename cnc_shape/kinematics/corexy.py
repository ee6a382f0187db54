"""CoreXY: two motors and one belt move x and y together, q1 = x + y and q2 = x - y."""

from __future__ import annotations

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.kinematics.kinematics import Kinematics, rows
from cnc_shape.program import XYZ

MOTORS = frozen([[1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 0.0, 1.0]])


def _motors(axes: FloatArray) -> FloatArray:
    x, y, z = rows(axes, 3).T
    return np.stack([x + y, x - y, z], axis=1)


def _axes(joints: FloatArray, near: FloatArray) -> FloatArray:
    first, second, third = rows(joints, 3).T
    return np.stack([0.5 * (first + second), 0.5 * (first - second), third], axis=1)


def _rates(axes: FloatArray) -> FloatArray:
    return np.broadcast_to(MOTORS, (len(axes), 3, 3))


def corexy() -> Kinematics:
    """Return the kinematics of a CoreXY machine with a drive of its own for z."""
    return Kinematics("corexy", XYZ, ("q1", "q2", "q3"), _axes, _motors, _rates)
