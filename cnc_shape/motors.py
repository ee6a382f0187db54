"""Motors: what the servo motors of a machine had to do, in a few numbers each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import sqrt

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.joints import Joints
from cnc_shape.kernels.sums import add_squares
from cnc_shape.machine import ServoMotor
from cnc_shape.response import MotorSignals


@dataclass(frozen=True, slots=True)
class MotorDuty:
    """What one motor had to do over all samples of a case."""

    joint: str
    peak_torque: float  # N m
    rms_torque: float  # N m
    peak_load: float  # N m, of the load torque that was injected
    peak_gain_ratio: float  # -, velocity gain over the nominal one
    saturated_share: float  # -, of the samples with the torque at its limit
    identified_inertia: float  # kg m^2, at the end; the nominal one without identification


@dataclass(frozen=True, eq=False, slots=True)
class DutyTally:
    """Running sums of every motor; they do not depend on how the signals were cut into chunks."""

    joints: tuple[str, ...]  # (m,)
    count: int
    peak_torque: FloatArray  # (m,) N m
    square_torque: FloatArray  # (m,) (N m)^2, sum over the samples
    peak_load: FloatArray  # (m,) N m
    peak_gain_ratio: FloatArray  # (m,) -
    saturated: IntArray  # (m,) samples
    inertia: FloatArray  # (m,) kg m^2, at the last sample


def servo_motors(joints: Joints) -> Mapping[str, ServoMotor]:
    """The joints that have a servo motor, in their order."""
    return {joint.name: joint.drive for joint in joints.drives if isinstance(joint.drive, ServoMotor)}


def tally_duty(state: DutyTally | None, signals: MotorSignals, limits: FloatArray) -> DutyTally:
    """Add the next samples to a tally; None starts one. limits: (m,) N m, torque that the motors can make."""
    if state is None:
        none = np.zeros(len(signals.joints))
        state = DutyTally(signals.joints, 0, none, none, none, none, none.astype(np.int64), none)
    count = signals.torque.shape[0]
    if count == 0:
        return state
    torque = np.abs(signals.torque)
    square_torque = state.square_torque.copy()
    add_squares(torque, square_torque)
    return DutyTally(
        state.joints,
        state.count + count,
        frozen(np.maximum(state.peak_torque, torque.max(axis=0))),
        frozen(square_torque),
        frozen(np.maximum(state.peak_load, np.abs(signals.load).max(axis=0))),
        frozen(np.maximum(state.peak_gain_ratio, signals.gain_ratio.max(axis=0))),
        frozen_integers(state.saturated + np.count_nonzero(torque >= limits, axis=0)),
        frozen(signals.inertia[-1]),
    )


def duties(state: DutyTally) -> tuple[MotorDuty, ...]:
    """What every motor had to do."""
    columns = (
        state.peak_torque, state.square_torque, state.peak_load, state.peak_gain_ratio, state.saturated,
        state.inertia,
    )  # fmt: skip
    rows = zip(state.joints, *(column.tolist() for column in columns), strict=True)
    count = max(state.count, 1)
    return tuple(
        MotorDuty(joint, peak, sqrt(square / count), load, gain, saturated / count, inertia)
        for joint, peak, square, load, gain, saturated, inertia in rows
    )
