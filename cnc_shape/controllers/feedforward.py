"""Feedforward: what the drive's own model needs to move as commanded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.kernels import inlined
from cnc_shape.machine import Axis, FirstOrderLag, ServoMotor


@dataclass(frozen=True, slots=True)
class Feedforward:
    """Shares of the commanded velocity and acceleration that are fed forward through a drive model."""

    velocity: float = 0.0  # -
    acceleration: float = 0.0  # -
    model_time_constant: float | None = None  # s; None: the axis's own
    model_gain: float | None = None  # -; None: the axis's own


class FeedforwardGains(NamedTuple):
    """The shares through the inverse of each drive's model."""

    velocity: FloatArray  # (j,) velocity share / gain
    acceleration: FloatArray  # (j,) s, acceleration share * time constant / gain
    torque: FloatArray  # (j,) N m s^2 per mm or rad, acceleration share * inertia / pitch of a servo motor


def gains(feedforward: Feedforward, axes: Sequence[Axis]) -> FeedforwardGains:
    """Gains of every axis: a lag drive needs ``u = (v + tau a) / k`` (spec: contour control, section 3.5).

    A servo motor needs the velocity and the torque of its believed inertia, unless a time constant is given
    for its velocity loop.
    """
    velocity: list[float] = []
    acceleration: list[float] = []
    torque: list[float] = []
    for axis in axes:
        own = axis.drive if isinstance(axis.drive, FirstOrderLag) else FirstOrderLag(0.0)
        gain = own.gain if feedforward.model_gain is None else feedforward.model_gain
        tau = (
            own.time_constant if feedforward.model_time_constant is None else feedforward.model_time_constant
        )
        velocity.append(feedforward.velocity / gain)
        acceleration.append(feedforward.acceleration * tau / gain)
        needed = 0.0
        if isinstance(axis.drive, ServoMotor) and feedforward.model_time_constant is None:
            needed = axis.drive.believed_inertia / axis.drive.pitch
        torque.append(feedforward.acceleration * needed)
    return FeedforwardGains(frozen(velocity), frozen(acceleration), frozen(torque))


@inlined
def step(
    gains: FeedforwardGains,
    velocity: FloatArray,
    acceleration: FloatArray,
    drive: FloatArray,
    torque: FloatArray,
) -> None:
    """Add the model's input for the coming sample.

    velocity (j,) mm/s and acceleration (j,) mm/s^2 are averages over the coming sample: the value at
    its start alone is half a sample late. drive (j,) mm/s; torque (j,) N m is set.
    """
    for j in range(drive.size):
        drive[j] += gains.velocity[j] * velocity[j] + gains.acceleration[j] * acceleration[j]
        torque[j] = gains.torque[j] * acceleration[j]
