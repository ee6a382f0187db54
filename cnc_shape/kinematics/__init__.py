"""Kinematics of machines: `KINEMATICS` is the registration."""

from cnc_shape.kinematics.cartesian import cartesian
from cnc_shape.kinematics.corexy import corexy
from cnc_shape.kinematics.cubic_parallel import Rails, cubic_parallel, cubic_rails
from cnc_shape.kinematics.kinematics import Kinematics
from cnc_shape.kinematics.linear_delta import linear_delta
from cnc_shape.kinematics.reach import first_refusal
from cnc_shape.kinematics.stewart import stewart
from cnc_shape.kinematics.trunnion_ac import trunnion_ac

KINEMATICS = {
    "cartesian": cartesian,
    "corexy": corexy,
    "linear_delta": linear_delta,
    "cubic_parallel": cubic_parallel,
    "stewart": stewart,
    "trunnion_ac": trunnion_ac,
}

__all__ = [
    "KINEMATICS",
    "Kinematics",
    "Rails",
    "cartesian",
    "corexy",
    "cubic_parallel",
    "cubic_rails",
    "first_refusal",
    "linear_delta",
    "stewart",
    "trunnion_ac",
]
