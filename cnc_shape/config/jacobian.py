"""Jacobian of a machine at a pose, by every formula there is for it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.config.kinematics import rails_of
from cnc_shape.config.setup import Setup
from cnc_shape.errors import InfeasibleError, OptionError
from cnc_shape.kinematics import Kinematics, Rails
from cnc_shape.kinematics.cubic_parallel import reciprocal_jacobian
from cnc_shape.kinematics.cubic_parallel_screws import screw_jacobian
from cnc_shape.kinematics.legs import orientation
from cnc_shape.kinematics.reach import first_refusal, weights
from cnc_shape.program import ROTARY, unit_of

STEP = 1e-4  # of central differences: mm, and rad by the machine's own weight of a radian


def check_jacobian(setup: Setup, pose: Sequence[float] = ()) -> dict[str, object]:
    """Return how a machine's joints and axes hold on to each other at a pose, ready for JSON.

    Rates are in mm/s and rad/s. Where both stand in one number (condition, differences), a radian weighs
    as much as the kinematics says.

    Parameters
    ----------
    setup
        The machine.
    pose
        Its axes in their order, mm and degrees; those that are left out are 0.

    Raises
    ------
    OptionError
        More numbers than the machine has axes.
    InfeasibleError
        A pose that is out of reach or singular.
    """
    kinematics = setup.kinematics
    axes = _pose(kinematics, pose)
    if refused := first_refusal(kinematics, axes):
        raise InfeasibleError(f"pose: {refused[1]}", hint="take a pose inside the machine's space")
    joints, inverse = kinematics.inverse(axes)[0], kinematics.inverse_jacobian(axes)[0]
    rails = rails_of(setup.kinematics_choice)
    return {
        "file": setup.source,
        "dialect": "machine",
        "name": setup.machine.name,
        "kinematics": kinematics.name,
        "axes": list(kinematics.axes),
        "joints": list(kinematics.joints),
        "pose": _outside(kinematics.axes, axes[0]),
        "joint_positions": _outside(kinematics.joints, joints),
        "jacobian": np.linalg.inv(inverse).tolist(),
        "inverse_jacobian": inverse.tolist(),
        "central_difference_error": _difference(kinematics, axes, inverse),
        "condition_number": float(np.linalg.cond(_weighed(kinematics, inverse))),
        "radian_mm": None if set(ROTARY).isdisjoint(kinematics.axes) else kinematics.radian,
        "formulas": None if rails is None else _formulas(rails, kinematics, axes),
    }


def _pose(kinematics: Kinematics, given: Sequence[float]) -> FloatArray:
    names = kinematics.axes
    if len(given) > len(names):
        told = ",".join(name.upper() for name in names)
        reason = f"a pose of this machine has {len(names)} numbers, not {len(given)}"
        raise OptionError(reason, hint=f"give {told}, in mm and degrees", argument="pose")
    pose = np.zeros((1, len(names)))
    pose[0, : len(given)] = given
    return frozen(pose * [unit_of(name) for name in names])


def _outside(names: Sequence[str], values: FloatArray) -> dict[str, float]:
    """Positions by name, in mm and degrees."""
    pairs = zip(names, values.tolist(), strict=True)
    return {name: value / unit_of(name) for name, value in pairs}


def _weighed(kinematics: Kinematics, inverse: FloatArray) -> FloatArray:
    """An inverse Jacobian (j,d) in mm per mm alone."""
    rows, columns = weights(kinematics)
    return inverse * rows[:, None] * columns


def _difference(kinematics: Kinematics, axes: FloatArray, inverse: FloatArray) -> float:
    """Largest difference from central differences, relative to the largest entry."""
    steps = STEP * weights(kinematics)[1]
    there, back = (kinematics.inverse(frozen(axes + sign * np.diag(steps))) for sign in (1.0, -1.0))
    numerical = ((there - back) / (2.0 * steps[:, None])).T
    return _apart(_weighed(kinematics, numerical), _weighed(kinematics, inverse))


def _formulas(rails: Rails, kinematics: Kinematics, axes: FloatArray) -> dict[str, object]:
    """Twist (v of the tool centre point; omega, in base axes) per joint rates, by both formulas."""
    position, rotation = axes[0, :3], orientation(axes)[0]
    by_screws = screw_jacobian(rails, position, rotation)
    by_reciprocals = np.linalg.inv(reciprocal_jacobian(rails, position, rotation)).astype(np.float64)
    weights = np.repeat(np.array([1.0, kinematics.radian]), 3)[:, None]
    return {
        "screws": by_screws.tolist(),
        "reciprocal_screws": by_reciprocals.tolist(),
        "largest_relative_difference": _apart(weights * by_screws, weights * by_reciprocals),
    }


def _apart(one: FloatArray, other: FloatArray) -> float:
    return float(np.abs(one - other).max() / np.abs(other).max())
