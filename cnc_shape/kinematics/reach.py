"""Reach: whether a machine can be where a program wants it, told in words before anything moves."""

from __future__ import annotations

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.kernels.linear import conditions
from cnc_shape.kinematics.kinematics import Kinematics
from cnc_shape.program import ROTARY

CONDITION_LIMIT = 1e4  # of the inverse Jacobian in the 1-norm, above which a pose counts as singular
BLOCK = 4096  # poses looked at together


def first_refusal(kinematics: Kinematics, axes: FloatArray) -> tuple[int, str] | None:
    """Find the first of the poses (n,d) that the machine cannot hold: its row and the reason, or None.

    A pose is refused where a joint cannot reach it, where joints and axes nearly lose hold of one another
    (see `condition`), and where the way from the pose before leads through one at which they do.
    """
    sign = 0.0
    for begin in range(0, len(axes), BLOCK):
        block = axes[begin : begin + BLOCK]
        joints = kinematics.inverse(block)
        number, determinant = condition(kinematics, block)
        reached = np.all(np.isfinite(joints), axis=1)
        if begin == 0:
            sign = float(np.sign(determinant[0]))
        through = np.sign(determinant) != sign
        refused = np.flatnonzero(~reached | ~(number <= CONDITION_LIMIT) | through)
        if refused.size:
            row = int(refused[0])
            if not reached[row]:
                return begin + row, _unreached(kinematics, joints[row])
            if not number[row] <= CONDITION_LIMIT:
                reason = f"condition number {number[row]:.3g}, limit {CONDITION_LIMIT:g}"
                return begin + row, f"the pose is singular: {reason}"
            return begin + row, "the way to the pose leads through a singular one"
    return None


def condition(kinematics: Kinematics, axes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Condition number in the 1-norm and determinant of the inverse Jacobian at poses (n,d), (n,) each.

    A radian weighs as much as `kinematics.radian` mm, so that both are pure numbers. Where a joint cannot
    reach, the number is nan.
    """
    number, determinant = np.empty(len(axes)), np.empty(len(axes))
    conditions(frozen(kinematics.inverse_jacobian(axes)), *weights(kinematics), number, determinant)
    return number, determinant


def weights(kinematics: Kinematics) -> tuple[FloatArray, FloatArray]:
    """Factors of the rows and columns of an inverse Jacobian, (d,) each, that make its entries mm per mm."""
    mm = kinematics.radian
    rows = frozen([mm if name in ROTARY else 1.0 for name in kinematics.joints])
    columns = frozen([1.0 / mm if name in ROTARY else 1.0 for name in kinematics.axes])
    return rows, columns


def _unreached(kinematics: Kinematics, joints: FloatArray) -> str:
    names = [name for name, joint in zip(kinematics.joints, joints, strict=True) if not np.isfinite(joint)]
    return f"leg {names[0]} cannot reach" if len(names) == 1 else f"legs {', '.join(names)} cannot reach"
