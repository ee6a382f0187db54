"""A vibration mode of the structure."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf, isfinite, sqrt

from cnc_shape.errors import OptionError
from cnc_shape.units import TWO_PI

LOWEST_FREQUENCY = 1e-3  # Hz
HIGHEST_FREQUENCY = 1e5  # Hz


def _check(natural_frequency: float, damping_ratio: float) -> None:
    if LOWEST_FREQUENCY > natural_frequency > 0.0 or inf > natural_frequency > HIGHEST_FREQUENCY:
        raise OptionError(
            f"a mode's frequency must lie between {LOWEST_FREQUENCY:g} and {HIGHEST_FREQUENCY:g} Hz, "
            f"not {natural_frequency:g} Hz",
            hint="give the undamped natural frequency in Hz",
        )
    if not (isfinite(natural_frequency) and natural_frequency > 0.0):
        raise OptionError(
            f"a mode's frequency must be positive, not {natural_frequency} Hz",
            hint="give the undamped natural frequency in Hz",
        )
    if not 0.0 <= damping_ratio < 1.0:
        raise OptionError(
            f"a damping ratio must be at least 0 and below 1, not {damping_ratio}",
            hint="structures of steel and aluminium have 0.005 to 0.1",
        )


@dataclass(frozen=True, slots=True)
class ModeTable:
    """A mode over the position of an axis: linear between the rows, as at the ends beyond them.

    Raises
    ------
    OptionError
        Fewer than two rows, columns of unlike length, positions that do not increase, or a frequency or
        damping ratio that no mode may have.
    """

    axis: str  # on whose position the mode depends
    position: tuple[float, ...]  # (p,) mm or rad, increasing, p >= 2
    natural_frequency: tuple[float, ...]  # (p,) Hz
    damping_ratio: tuple[float, ...]  # (p,) -

    def __post_init__(self) -> None:
        rows = len(self.position)
        if rows < 2:
            raise OptionError(
                f"a table of a mode needs two positions at least, not {rows}",
                hint="a mode that is the same everywhere needs no table",
            )
        if not rows == len(self.natural_frequency) == len(self.damping_ratio):
            counts = f"{rows}, {len(self.natural_frequency)} and {len(self.damping_ratio)}"
            raise OptionError(
                f"a table of a mode needs as many frequencies and damping ratios as positions, not {counts}",
                hint="give one of each for every position",
            )
        if not all(map(isfinite, self.position)):
            raise OptionError("the positions of a table must be finite")
        for before, after in pairwise(self.position):
            if not before < after:
                raise OptionError(
                    f"the positions of a table must increase: {after:g} follows {before:g}",
                    hint="sort the rows by position",
                )
        for row in range(rows):
            _check(self.natural_frequency[row], self.damping_ratio[row])

    def at(self, position: float) -> tuple[float, float]:
        """Frequency (Hz) and damping ratio where the axis stands at `position` (mm or rad)."""
        if position <= self.position[0]:
            return self.natural_frequency[0], self.damping_ratio[0]
        if position >= self.position[-1]:
            return self.natural_frequency[-1], self.damping_ratio[-1]
        row = bisect_right(self.position, position) - 1
        start, end = self.position[row], self.position[row + 1]
        share = (position - start) / (end - start)
        frequency = self.natural_frequency[row : row + 2]
        damping = self.damping_ratio[row : row + 2]
        return (
            frequency[0] + share * (frequency[1] - frequency[0]),
            damping[0] + share * (damping[1] - damping[0]),
        )

    def scaled(self, factor: float) -> ModeTable:
        """The table of a mode whose frequencies are all `factor` times as high."""
        return replace(self, natural_frequency=tuple(factor * f for f in self.natural_frequency))


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
    table: ModeTable | None = None  # how it changes over an axis; the mode itself is the design point

    def __post_init__(self) -> None:
        _check(self.natural_frequency, self.damping_ratio)
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

    @property
    def longest_period(self) -> float:
        """Period of the damped vibration where it is slowest, s."""
        if self.table is None:
            return self.damped_period
        rows = zip(self.table.natural_frequency, self.table.damping_ratio, strict=True)
        return max(self.damped_period, *(1.0 / (f * sqrt(1.0 - zeta**2)) for f, zeta in rows))

    def at(self, position: float) -> Mode:
        """The mode where the axis of its table stands at `position`, without table; itself without one."""
        if self.table is None:
            return self
        frequency, damping = self.table.at(position)
        return replace(self, natural_frequency=frequency, damping_ratio=damping, table=None)

    def scaled(self, factor: float) -> Mode:
        """The mode with frequencies `factor` times as high, everywhere."""
        table = None if self.table is None else self.table.scaled(factor)
        return replace(self, natural_frequency=factor * self.natural_frequency, table=table)
