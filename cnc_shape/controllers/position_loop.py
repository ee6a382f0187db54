"""Position loop: proportional control of every drive's position error."""

from __future__ import annotations

from typing import NamedTuple

from cnc_shape.arrays import FloatArray
from cnc_shape.kernels import inlined


class PositionGains(NamedTuple):
    """Gains of the position loop."""

    proportional: FloatArray  # (j,) 1/s


@inlined
def step(gains: PositionGains, following: FloatArray, drive: FloatArray) -> None:
    """Add ``Kp (q_command - q)`` to the velocity command. following, drive (j,) mm, mm/s."""
    for j in range(drive.size):
        drive[j] += gains.proportional[j] * following[j]
