# pyright: basic
"""Disturbance observer: what load a motor bears, from the torque it is given and what its encoder reads.

The full-order observer of paper 003 (eqs 1-5, with the load against the motor: -1/J), exact under a hold,
its three poles together at ``z0 = exp(-bandwidth h)``. The estimate follows the load through the filter
``(bandwidth / (s + bandwidth))^3``. It is all that the believed inertia does not explain, friction too.
"""

from __future__ import annotations

from math import exp
from typing import NamedTuple

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.controllers.compensation import DisturbanceObserver
from cnc_shape.kernels import kernel

ANGLE, SPEED, LOAD = 0, 1, 2  # columns of an observer's memory: its estimates, rad, rad/s, N m
GIVEN = 3  # the torque given, behind the same poles as the estimate: after one, two and all three of them
COLUMNS = 6


class ObserverGains(NamedTuple):
    """An observer for every motor."""

    watches: int  # 1: there is one
    feedforward: float  # -, share of the estimate that is added to the torque
    angle: float  # -, correction of the angle per rad of surprise
    speed: float  # 1/s
    load: FloatArray  # (j,) N m/rad
    pole: float  # -


def gains(observer: DisturbanceObserver | None, believed: FloatArray, period: float) -> ObserverGains:
    """Gains that put all poles at ``exp(-bandwidth period)`` (spec: inertia compensation, section 3.3).

    believed (j,) kg m^2; period s.
    """
    if observer is None:
        return ObserverGains(0, 0.0, 0.0, 0.0, frozen(np.zeros(believed.size)), 0.0)
    pole = exp(-observer.bandwidth * period)
    d = 1.0 - pole
    return ObserverGains(
        1, observer.feedforward, 3.0 * d, (3.0 * d**2 - 0.5 * d**3) / period,
        frozen(-believed * d**3 / period**2), pole,
    )  # fmt: skip


def start(reading: FloatArray) -> FloatArray:
    """Memory at rest where the encoders read `reading` (j,) rad, (j,6)."""
    memory = np.zeros((reading.size, COLUMNS))
    memory[:, ANGLE] = reading
    return memory


@kernel
def step(gains, motors, j, torque, reading, memory):
    """Take a reading (rad), and predict the next tick under a torque (N m). memory (j,6)."""
    period, believed = motors.period, motors.believed[j]
    surprise = reading - memory[j, ANGLE]
    driven = period / believed * (torque - memory[j, LOAD])
    memory[j, ANGLE] += period * (memory[j, SPEED] + 0.5 * driven) + gains.angle * surprise
    memory[j, SPEED] += driven + gains.speed * surprise
    memory[j, LOAD] += gains.load[j] * surprise
    passing = torque
    for i in range(GIVEN, COLUMNS):
        memory[j, i] += (1.0 - gains.pole) * (passing - memory[j, i])
        passing = memory[j, i]


@kernel
def acceleration(motors, j, memory):
    """Acceleration of motor j that goes with the estimate, as late as that, rad/s^2."""
    return (memory[j, COLUMNS - 1] - memory[j, LOAD]) / motors.believed[j]
