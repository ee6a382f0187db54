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

from cnc_shape.arrays import FloatArray
from cnc_shape.controllers.compensation import DisturbanceObserver
from cnc_shape.kernels import inlined

ANGLE, SPEED, LOAD = 0, 1, 2  # columns of an observer's memory: its estimates, rad, rad/s, N m
ONCE, TWICE, THRICE = 3, 4, 5  # the torque given behind the same poles as the estimate: one, two, all three
COLUMNS = 6


class ObserverGains(NamedTuple):
    """An observer for every motor."""

    acts: int  # 1: there is one
    feedforward: float  # -, share of the estimate that is added to the torque
    angle: float  # -, correction of the angle per rad of innovation
    speed: float  # 1/s
    load: float  # 1/s^2, times the believed inertia N m/rad
    pole: float  # -


def gains(observer: DisturbanceObserver | None, period: float) -> ObserverGains:
    """Gains that put all poles at ``exp(-bandwidth period)``, period s (spec: section 3.3)."""
    if observer is None:
        return ObserverGains(0, 0.0, 0.0, 0.0, 0.0, 0.0)
    pole = exp(-observer.bandwidth * period)
    d = 1.0 - pole
    return ObserverGains(
        1, observer.feedforward, 3.0 * d, (3.0 * d**2 - 0.5 * d**3) / period,
        -(d**3) / period**2, pole,
    )  # fmt: skip


def start(reading: FloatArray) -> FloatArray:
    """Memory at rest where the encoders read `reading` (j,) rad, (j,6)."""
    memory = np.zeros((reading.size, COLUMNS))
    memory[:, ANGLE] = reading
    return memory


@inlined
def predicted(gains, period, believed, per_torque, torque, reading, angle, speed, load):
    """Angle, speed and load expected at the next tick, after a reading (rad) and under a torque (N m).

    believed kg m^2; per_torque: speed that a torque held for a tick makes, rad/s per N m.
    """
    innovation = reading - angle
    driven = per_torque * (torque - load)
    return (
        angle + period * (speed + 0.5 * driven) + gains.angle * innovation,
        speed + driven + gains.speed * innovation,
        load + believed * gains.load * innovation,
    )


@inlined
def acceleration(believed, j, memory):
    """Acceleration of motor j that goes with the estimate, as late as that, rad/s^2; believed kg m^2."""
    return (memory[j, THRICE] - memory[j, LOAD]) / believed
