"""What a shaper leaves of a mode that depends on where an axis stands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.modes import Mode, ModeTable
from cnc_shape.shapers.analysis import vibration
from cnc_shape.shapers.insensitivity import DEFAULT_VIBRATION_TOLERANCE, insensitivity
from cnc_shape.shapers.shaper import Shaper
from cnc_shape.units import TWO_PI

PLACES = 1001  # at which a mode is looked at, beside the rows of its table

Band = tuple[float, float | None]  # Hz, lower and upper end; None: without end


@dataclass(frozen=True, eq=False, slots=True)
class ModeOverPosition:
    """A mode along the axis of its table, against the design point of a shaper."""

    mode: Mode
    table: ModeTable
    position: FloatArray  # (p,) mm or rad, increasing
    frequency: FloatArray  # (p,) Hz
    damping_ratio: FloatArray  # (p,)
    vibration: FloatArray  # (p,) -, V that the shaper leaves there; 1 without a shaper
    band: Band | None  # where V stays small at the damping of the design; None: nowhere

    @property
    def deviation(self) -> tuple[float, float]:
        """How far below and above the design point the frequency goes, relative to it: signed."""
        design = self.mode.natural_frequency
        return float(self.frequency.min() / design - 1.0), float(self.frequency.max() / design - 1.0)

    @property
    def worst(self) -> tuple[float, float]:
        """Largest V, and the position where it is left."""
        row = int(self.vibration.argmax())
        return float(self.vibration[row]), float(self.position[row])

    def calm(self, tolerance: float = DEFAULT_VIBRATION_TOLERANCE) -> tuple[float, float] | None:
        """Ends of the longest stretch of positions where V stays within `tolerance`; None: there is none."""
        edges = np.flatnonzero(
            np.diff(np.concatenate([[0], self.vibration <= tolerance, [0]]).astype(np.int8))
        )
        if edges.size == 0:
            return None
        first, last = edges[::2], edges[1::2] - 1
        longest = int(np.argmax(self.position[last] - self.position[first]))
        return float(self.position[first[longest]]), float(self.position[last[longest]])


def over_position(
    mode: Mode, shaper: Shaper | None, travel: tuple[float, float] | None = None
) -> ModeOverPosition:
    """Follow a mode with a table along its axis.

    Parameters
    ----------
    mode
        Has a table; its own frequency and damping ratio are what the shaper is for.
    shaper
        Of the axis whose mode it is; None where there is none.
    travel
        From where to where, mm or rad; None or without an end: over the rows of the table.

    Raises
    ------
    ValueError
        A mode without a table.
    """
    if (table := mode.table) is None:
        raise ValueError(f"{mode=} has no table")
    low, high = table.position[0], table.position[-1]
    if travel is not None and np.isfinite(travel).all():
        low, high = travel
    rows = np.array(table.position, dtype=np.float64)
    position = np.unique(np.concatenate([np.linspace(low, high, PLACES), rows[(rows > low) & (rows < high)]]))
    frequency = np.interp(position, rows, table.natural_frequency)
    damping = np.interp(position, rows, table.damping_ratio)
    if shaper is None:
        return ModeOverPosition(
            mode, table, frozen(position), frozen(frequency), frozen(damping), frozen(np.ones(position.size)),
            None,
        )  # fmt: skip
    left = vibration(shaper, TWO_PI * frequency, damping)
    interval, design = insensitivity(shaper, [mode]), mode.natural_frequency
    band = None
    if interval.width is None or interval.width > 0.0:
        band = (design * interval.low, None if interval.high is None else design * interval.high)
    return ModeOverPosition(
        mode, table, frozen(position), frozen(frequency), frozen(damping), frozen(left), band
    )
