"""What an axis may do, and what the motion along a path may."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite

from cnc_shape.errors import OptionError


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of one axis; a rotary axis reads rad for mm."""

    velocity: float  # mm/s
    acceleration: float  # mm/s^2
    jerk: float = inf  # mm/s^3
    travel: tuple[float, float] = (-inf, inf)  # mm


@dataclass(frozen=True, slots=True)
class PathLimits:
    """Limits of the motion along the path in XYZ, whatever the axes could; rotary axes alone have none.

    A controller that interpolates every `interpolation_period` T and runs straight chords between is off a
    curve of the radius rho by at most `chord_error` h where ``v <= (2/T) sqrt(rho^2 - (rho - h)^2)``
    (paper 004).

    Raises
    ------
    OptionError
        A limit that is not positive, or one of period and chord error without the other.
    """

    acceleration: float = inf  # mm/s^2, of the speed along the path
    interpolation_period: float | None = None  # s
    chord_error: float | None = None  # mm, between path and chord

    def __post_init__(self) -> None:
        if not self.acceleration > 0.0:
            raise OptionError(f"a path acceleration must be positive, not {self.acceleration} mm/s²")
        if (self.interpolation_period is None) != (self.chord_error is None):
            raise OptionError(
                "an interpolation period limits the feed only together with a chord error",
                hint="give both, or neither",
            )
        for name, unit, value in (
            ("an interpolation period", "s", self.interpolation_period),
            ("a chord error", "mm", self.chord_error),
        ):
            if value is not None and not (isfinite(value) and value > 0.0):
                raise OptionError(f"{name} must be positive, not {value} {unit}")

    @property
    def chord(self) -> tuple[float, float] | None:
        """Interpolation period (s) and chord error (mm), where chords limit the feed."""
        if self.interpolation_period is None or self.chord_error is None:
            return None
        return float(self.interpolation_period), float(self.chord_error)


NO_PATH_LIMITS = PathLimits()  # as fast as the axes and the feed allow
