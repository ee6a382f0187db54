"""Cross-coupling: the axes answer the contour error together, in Cartesian space.

The tangent estimator takes the contour error to be what is left of the tracking error when its part
along the path is taken out, ``eps = e - <e, t> t`` (paper 004, eqs 6-13). That is the projection which
the paper writes as n <n, e>, without its 0/0 where the error lies along the path.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from cnc_shape.arrays import FloatArray
from cnc_shape.kernels import kernel


class Estimator(Enum):
    """How the loop guesses where the nearest point of the path is."""

    TANGENT = 0  # on the tangent at the commanded point
    CIRCLE = 1  # on the circle of curvature at the commanded point
    FOOT_POINT = 2  # on the programmed path itself


class Form(Enum):
    """What the controller acts on."""

    VECTOR = 0  # the contour error as a vector
    SCALAR = 1  # its length, along its direction: unsigned, as the paper has it


@dataclass(frozen=True, slots=True)
class CrossCoupling:
    """PID control of the estimated contour error, added to the velocity commands."""

    proportional: float  # 1/s
    estimator: Estimator = Estimator.TANGENT
    integral: float = 0.0  # 1/s^2
    derivative: float = 0.0  # -
    form: Form = Form.VECTOR
    orientation: float = 0.0  # 1/s, of the rotary part of the tracking error


class CrossCouplingGains(NamedTuple):
    """Gains of the cross-coupled loop."""

    proportional: float  # 1/s


@kernel
def step(gains: CrossCouplingGains, tracking: FloatArray, tangent: FloatArray, drive: FloatArray) -> None:
    """Add ``Kc eps`` to the Cartesian velocity command.

    tracking (3,) mm, command minus actual; tangent (3,) unit, of the command; drive (>=3,) mm/s.
    """
    along = 0.0
    for i in range(3):
        along += tracking[i] * tangent[i]
    for i in range(3):
        drive[i] += gains.proportional * (tracking[i] - along * tangent[i])
