# pyright: basic
"""Friction feedforward: the motor is given what its friction will take.

Friction turns with the motor, and the motor is late: without velocity feedforward by the time constant of the
position loop. So the commanded speed passes a lag like it before its sign is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.controllers.compensation import FrictionFeedforward
from cnc_shape.controllers.lag import remaining
from cnc_shape.kernels import inlined
from cnc_shape.machine import Axis, ServoMotor

COULOMB, VISCOUS, DECAY = 0, 1, 2  # columns of the numbers
STANDSTILL = 1e-3  # rad/s, speed below which there is no direction to push in


class FrictionGains(NamedTuple):
    """Friction of every motor that is fed forward."""

    acts: int
    numbers: FloatArray  # (j,3) Coulomb friction in N m, viscous in N m s, decay of the lag over a sample


def gains(
    feedforward: FrictionFeedforward | None, joints: Sequence[Axis], lags: Sequence[float], sample_time: float
) -> FrictionGains:
    """Gains for joints whose motors are late by time constants `lags`, s."""
    shares = feedforward or FrictionFeedforward(0.0, 0.0)
    rows: list[tuple[float, float, float]] = []
    for joint, lag in zip(joints, lags, strict=True):
        drive, decay = joint.drive, remaining(lag, sample_time)
        coulomb, viscous = (drive.coulomb, drive.viscous) if isinstance(drive, ServoMotor) else (0.0, 0.0)
        rows.append((shares.coulomb * coulomb, shares.viscous * viscous, decay))
    return FrictionGains(int(feedforward is not None), frozen(rows))


@inlined
def follow(gains, j, speed, memory):
    """Take the commanded speed of the coming sample, rad/s. memory (j,)."""
    memory[j] = speed + (memory[j] - speed) * gains.numbers[j, DECAY]


@inlined
def torque(gains, j, memory):
    """Torque that answers friction, N m. memory (j,) rad/s."""
    speed = memory[j]
    pushed = gains.numbers[j, VISCOUS] * speed
    if speed > STANDSTILL:
        pushed += gains.numbers[j, COULOMB]
    elif speed < -STANDSTILL:
        pushed -= gains.numbers[j, COULOMB]
    return pushed
