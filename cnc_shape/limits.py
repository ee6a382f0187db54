"""What an axis may do."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of one axis; a rotary axis reads rad for mm."""

    velocity: float  # mm/s
    acceleration: float  # mm/s^2
    jerk: float = inf  # mm/s^3
    travel: tuple[float, float] = (-inf, inf)  # mm
