"""Trajectory: the command of every axis at the servo period."""

from __future__ import annotations

from dataclasses import dataclass

from cnc_shape.arrays import FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class Trajectory:
    """A chunk of samples of the axis commands, analytic in position, velocity and acceleration.

    The first sample of a motion is at t = 0; the last is the first at or after its end, at rest.
    """

    axes: tuple[str, ...]
    sample_time: float  # s
    arc_length: FloatArray  # (n,) mm, place on the toolpath that the sample belongs to
    position: FloatArray  # (n,d) mm or rad
    velocity: FloatArray  # (n,d) mm/s or rad/s
    acceleration: FloatArray  # (n,d) mm/s^2 or rad/s^2

    def __len__(self) -> int:
        return self.arc_length.size
