"""Cartesian: one drive per axis."""

from __future__ import annotations

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.kinematics.kinematics import Kinematics
from cnc_shape.program import XYZ


def _same(values: FloatArray) -> FloatArray:
    return values


def _there(joints: FloatArray, near: FloatArray) -> FloatArray:
    return joints


def _unity(axes: FloatArray) -> FloatArray:
    return np.broadcast_to(np.eye(axes.shape[1]), (*axes.shape, axes.shape[1]))


def cartesian() -> Kinematics:
    """Return the kinematics whose joints are its axes."""
    return Kinematics("cartesian", XYZ, XYZ, forward=_there, inverse=_same, inverse_jacobian=_unity)
