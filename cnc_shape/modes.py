"""A vibration mode of the structure."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite, sqrt

from cnc_shape.errors import OptionError
from cnc_shape.units import TWO_PI

LOWEST_FREQUENCY = 1e-3  # Hz
HIGHEST_FREQUENCY = 1e5  # Hz


@dataclass(frozen=True, slots=True)
class ModeTable:
    """A mode where an axis stands: linear between the rows, as at the ends beyond them."""

    axis: str  # on whose position the mode depends
    position: tuple[float, ...]  # (p,) mm or rad, increasing, p >= 2
    natural_frequency: tuple[float, ...]  # (p,) Hz
    damping_ratio: tuple[float, ...]  # (p,) -


@dataclass(frozen=True, slots=True)
class Mode:
    """One flexible mode between drive and tool.

    ``d'' + 2 zeta omega d' + omega^2 d = -participation * q''``, where ``q`` is the drive's position
    and ``d`` the deflection that adds to the tool.

    Raises
    ------
    OptionError
        Frequency not positive, damping ratio outside [0, 1), or a value that is not finite.
    """

    natural_frequency: float  # Hz, undamped
    damping_ratio: float  # -, 0 <= zeta < 1
    participation: float = 1.0  # -, share of the drive's acceleration that excites the mode
    frequency_uncertainty: float = 0.0  # -, how far off the frequency may be, relative
    damping_uncertainty: float = 0.0  # -, how far off the damping ratio may be, relative
    table: ModeTable | None = (
        None  # how it changes over an axis; the mode itself is the shaper's design point
    )

    def __post_init__(self) -> None:
        if (
            LOWEST_FREQUENCY > self.natural_frequency > 0.0
            or inf > self.natural_frequency > HIGHEST_FREQUENCY
        ):
            raise OptionError(
                f"a mode's frequency must lie between {LOWEST_FREQUENCY:g} and {HIGHEST_FREQUENCY:g} Hz, "
                f"not {self.natural_frequency:g} Hz",
                hint="give the undamped natural frequency in Hz",
            )
        if not (isfinite(self.natural_frequency) and self.natural_frequency > 0.0):
            raise OptionError(
                f"a mode's frequency must be positive, not {self.natural_frequency} Hz",
                hint="give the undamped natural frequency in Hz",
            )
        if not 0.0 <= self.damping_ratio < 1.0:
            raise OptionError(
                f"a damping ratio must be at least 0 and below 1, not {self.damping_ratio}",
                hint="structures of steel and aluminium have 0.005 to 0.1",
            )
        if not isfinite(self.participation):
            raise OptionError(f"a mode's participation must be finite, not {self.participation}")
        for name, value in (
            ("frequency", self.frequency_uncertainty),
            ("damping", self.damping_uncertainty),
        ):
            if not 0.0 <= value < 1.0:
                raise OptionError(
                    f"a {name} uncertainty must be at least 0 and below 1, not {value}",
                    hint="0.03 means 3 per cent up or down",
                )
        if self.damping_ratio * (1.0 + self.damping_uncertainty) >= 1.0:
            raise OptionError(
                f"a damping ratio of {self.damping_ratio:g} is 1 when {self.damping_uncertainty:.0%} off",
                hint="a shaper is for a mode that swings: damping below 1",
            )

    @property
    def is_uncertain(self) -> bool:
        """Whether it says how far off it may be."""
        return self.frequency_uncertainty > 0.0 or self.damping_uncertainty > 0.0

    @property
    def omega(self) -> float:
        """Undamped angular frequency, rad/s."""
        return TWO_PI * self.natural_frequency

    @property
    def omega_damped(self) -> float:
        """Damped angular frequency, rad/s."""
        return self.omega * sqrt(1.0 - self.damping_ratio**2)

    @property
    def damped_period(self) -> float:
        """Period of the damped vibration, s."""
        return TWO_PI / self.omega_damped
