# pyright: basic
"""Friction feedforward: the motor is given what its friction will take.

Friction turns with the motor, and the motor is late: without velocity feedforward by the time constant of the
position loop. So the commanded speed passes a lag like it before its sign is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import exp
from typing import NamedTuple

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.controllers.compensation import FrictionFeedforward
from cnc_shape.kernels import kernel
from cnc_shape.machine import Axis, ServoMotor

STANDSTILL = 1e-3  # rad/s, speed below which there is no direction to push in


class FrictionGains(NamedTuple):
    """Friction of every motor that is fed forward."""

    acts: int
    coulomb: FloatArray  # (j,) N m
    viscous: FloatArray  # (j,) N m s
    decay: FloatArray  # (j,) -, of the lag over a sample


def gains(
    feedforward: FrictionFeedforward | None, joints: Sequence[Axis], lags: Sequence[float], sample_time: float
) -> FrictionGains:
    """Gains for joints whose motors are late by time constants `lags`, s."""
    shares = feedforward or FrictionFeedforward(0.0, 0.0)
    drives = [joint.drive for joint in joints]
    return FrictionGains(
        int(feedforward is not None),
        frozen([shares.coulomb * d.coulomb if isinstance(d, ServoMotor) else 0.0 for d in drives]),
        frozen([shares.viscous * d.viscous if isinstance(d, ServoMotor) else 0.0 for d in drives]),
        frozen([exp(-sample_time / lag) if lag > 0.0 else 0.0 for lag in lags]),
    )


@kernel
def follow(gains, j, speed, memory):
    """Take the commanded speed of the coming sample, rad/s. memory (j,)."""
    memory[j] = speed + (memory[j] - speed) * gains.decay[j]


@kernel
def torque(gains, j, memory):
    """Torque that answers friction, N m. memory (j,) rad/s."""
    if not gains.acts:
        return 0.0
    speed = memory[j]
    pushed = gains.viscous[j] * speed
    if speed > STANDSTILL:
        pushed += gains.coulomb[j]
    elif speed < -STANDSTILL:
        pushed -= gains.coulomb[j]
    return pushed
