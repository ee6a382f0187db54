"""The controllers that are compared, by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

from cnc_shape.controllers import Control, CrossCoupling, Estimator, Feedforward, Form
from cnc_shape.machine import FirstOrderLag

POSITION_GAIN: Final = 20.0  # 1/s
PAPERS_GAIN: Final = 10.0  # 1/s, half the position gain: where the paper's estimator is at its best
HIGH: Final = 80.0  # 1/s, a cross-coupling gain that leaves the loop well damped
INTEGRAL, DERIVATIVE = 800.0, 1.16  # 1/s^2, -
STEEP: Final = 0.0145 * 95.0  # -, derivative of a PD: the lag of a drive, s, times 95 1/s

COMMON: Final = Feedforward(1.0, 1.0, model_time_constant=0.0148, model_gain=1.0)  # one model for all drives
OWN: Final = Feedforward(1.0, 1.0)  # each drive's own
VELOCITY: Final = Feedforward(1.0, 0.0, model_gain=1.0)  # velocity alone

INDEPENDENT: Final = Control(position_gain=POSITION_GAIN)


def tangent(gain: float, base: Control = INDEPENDENT) -> Control:
    """`base` with the paper's estimator."""
    return replace(base, cross_coupling=CrossCoupling(gain, Estimator.TANGENT))


def foot(gain: float, base: Control = INDEPENDENT, integral: float = 0.0, derivative: float = 0.0) -> Control:
    """`base` with the nearest point of the contour itself."""
    return replace(base, cross_coupling=CrossCoupling(gain, Estimator.FOOT_POINT, integral, derivative))


def fed(feedforward: Feedforward, base: Control = INDEPENDENT) -> Control:
    """`base` with feedforward."""
    return replace(base, feedforward=feedforward)


PAPER: Final = tangent(PAPERS_GAIN)  # P loops and the tangent, without feedforward
SAME_LOOP: Final = foot(PAPERS_GAIN, fed(OWN))  # the same gains

COMPARED: Final[Mapping[str, Control]] = {
    "independent": INDEPENDENT,
    "tangent, Kc 10": PAPER,
    "tangent, Kc 40": tangent(40.0),
    "foot point, Kc 80": foot(HIGH),
    "feedforward": fed(COMMON),
    "feedforward, tangent, Kc 80": tangent(HIGH, fed(COMMON)),
    "feedforward, foot point, Kc 80": foot(HIGH, fed(COMMON)),
    "feedforward, foot point, PID": foot(HIGH, fed(COMMON), INTEGRAL, DERIVATIVE),
}


def variants(plants: Sequence[FirstOrderLag], gain: float) -> Mapping[str, Control]:
    """More controllers, for the fan, at a position gain (1/s) on a machine of `plants`."""
    alone = Control(position_gain=gain)
    matched = replace(alone, joint_gains=tuple(gain / plant.gain for plant in plants))
    fast, common = fed(VELOCITY, alone), fed(COMMON, alone)
    return {
        "independent": alone,
        "independent, gains matched": matched,
        "tangent, Kc 10": tangent(10.0, alone),
        "tangent, Kc 40": tangent(40.0, alone),
        "foot point, Kc 40": foot(40.0, alone),
        "foot point, Kc 80": foot(HIGH, alone),
        "foot point, PD": foot(HIGH, alone, 0.0, STEEP),
        "foot point, PI": foot(HIGH, alone, INTEGRAL),
        "foot point, PID": foot(HIGH, alone, INTEGRAL, DERIVATIVE),
        "circle of curvature, Kc 80": replace(alone, cross_coupling=CrossCoupling(HIGH, Estimator.CIRCLE)),
        "velocity feedforward": fast,
        "velocity feedforward, tangent, Kc 40": tangent(40.0, fast),
        "velocity feedforward, tangent, Kc 80": tangent(HIGH, fast),
        "velocity feedforward, tangent, PID": replace(
            fast, cross_coupling=CrossCoupling(HIGH, Estimator.TANGENT, INTEGRAL, DERIVATIVE)
        ),
        "velocity feedforward, foot point, Kc 80": foot(HIGH, fast),
        "velocity feedforward, foot point, PID": foot(HIGH, fast, INTEGRAL, DERIVATIVE),
        "feedforward, own models": fed(OWN, alone),
        "feedforward": common,
        "feedforward, foot point, Kc 80": foot(HIGH, common),
        "feedforward, tangent, Kc 80": tangent(HIGH, common),
        "feedforward, foot point, PID": foot(HIGH, common, INTEGRAL, DERIVATIVE),
        "tangent, PI of the length": _integrating(alone, Estimator.TANGENT, 10.0, Form.SCALAR),
        "tangent, PI of the vector": _integrating(alone, Estimator.TANGENT, 10.0, Form.VECTOR),
        "foot point, PI of the length": _integrating(alone, Estimator.FOOT_POINT, 40.0, Form.SCALAR),
        "foot point, PI of the vector": _integrating(alone, Estimator.FOOT_POINT, 40.0, Form.VECTOR),
    }


def _integrating(base: Control, estimator: Estimator, gain: float, form: Form) -> Control:
    """PI with an integral gain of ten times the proportional one."""
    return replace(base, cross_coupling=CrossCoupling(gain, estimator, 10.0 * gain, form=form))
