"""Cartesian: one drive per axis."""

from __future__ import annotations

from cnc_shape.arrays import FloatArray
from cnc_shape.kinematics.kinematics import Kinematics


def _same(values: FloatArray) -> FloatArray:
    return values


def cartesian() -> Kinematics:
    """Return the kinematics whose joints are its axes."""
    return Kinematics("cartesian", forward=_same, inverse=_same)
