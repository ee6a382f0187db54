"""Cross-coupling: the axes answer the contour error together, in Cartesian space (paper 004, section 3).

In vector form the controller acts on the contour error as a vector. The paper's own form takes its length,
which has no sign: an integrator can only wind up, and drives the tool across the path and back.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import sqrt
from typing import NamedTuple

from cnc_shape.arrays import FloatArray
from cnc_shape.kernels import inlined


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
    integral: float  # 1/s^2
    derivative: float  # -
    orientation: float  # 1/s
    estimator: int  # value of an `Estimator`
    form: int  # value of a `Form`


VECTOR = Form.VECTOR.value
ERROR, LENGTH = 1, 2  # rows of the memory; row 0 is the integral of the vector


def gains(coupling: CrossCoupling | None) -> CrossCouplingGains:
    """Gains of a cross-coupling; zeros without one."""
    term = coupling or CrossCoupling(0.0)
    return CrossCouplingGains(
        term.proportional, term.integral, term.derivative, term.orientation,
        term.estimator.value, term.form.value,
    )  # fmt: skip


@inlined
def step(
    gains: CrossCouplingGains,
    error: FloatArray,
    frame: FloatArray,
    sample_time: float,
    memory: FloatArray,
    speed: FloatArray,
) -> None:
    """Set the Cartesian velocity that answers a contour error.

    The integral acts from the next tick on; what of it lies along the path is dropped, as the path turns.

    error (3,) mm; frame (2,3): unit tangent, curvature; memory (3,3): the integral, mm s; the error before,
    mm; the integral of its length, its length before, and 1 once there was one. speed (3,) mm/s.
    """
    # at the first tick there is no error before
    damping = gains.derivative / sample_time if memory[LENGTH, 2] > 0.0 else 0.0
    remembers = gains.integral > 0.0 or gains.derivative > 0.0
    if gains.form == VECTOR:
        for i in range(3):
            speed[i] = gains.proportional * error[i]
        if remembers:
            along = 0.0
            for i in range(3):
                speed[i] += gains.integral * memory[0, i] + damping * (error[i] - memory[ERROR, i])
                memory[0, i] += sample_time * error[i]
                memory[ERROR, i] = error[i]
                along += memory[0, i] * frame[0, i]
            for i in range(3):
                memory[0, i] -= along * frame[0, i]
            memory[LENGTH, 2] = 1.0
        return
    length = sqrt(error[0] ** 2 + error[1] ** 2 + error[2] ** 2)
    answer = gains.proportional * length
    if remembers:
        answer += gains.integral * memory[LENGTH, 0] + damping * (length - memory[LENGTH, 1])
        memory[LENGTH, 0] += sample_time * length
        memory[LENGTH, 1] = length
        memory[LENGTH, 2] = 1.0
    for i in range(3):
        speed[i] = answer * error[i] / length if length > 0.0 else 0.0
