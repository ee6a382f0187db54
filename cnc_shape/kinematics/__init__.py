"""Kinematics of machines: `KINEMATICS` is the registration."""

from cnc_shape.kinematics.cartesian import cartesian
from cnc_shape.kinematics.kinematics import Kinematics

KINEMATICS = {"cartesian": cartesian}

__all__ = ["KINEMATICS", "Kinematics", "cartesian"]
