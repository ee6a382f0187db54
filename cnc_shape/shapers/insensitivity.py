"""How far a machine's frequencies may be off before more than a tolerated vibration is left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from cnc_shape.arrays import BoolArray, FloatArray, IntArray
from cnc_shape.errors import OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers.shaper import Shaper

DEFAULT_VIBRATION_TOLERANCE = 0.05  # -, the 5 % of the papers
LARGEST_FREQUENCY_RATIO = 6.0  # -, beyond it an interval of insensitivity counts as open
ROUNDING = 1e-8  # relative: a hump that is designed to touch the tolerance does not cross it
LARGEST_STEP = 4e-3  # -, of the scan over the frequency ratio
STEPS_PER_SWING = 200.0  # of V over the frequency ratio
BLOCK = 128  # points scanned at once
CLOSE = 2e-3  # -, a hump this near to the tolerance is looked at closely
LOOKS, CLOSER = 3, 0.05  # how often, and how much closer each time
HALVINGS = 48  # of a step, to find an end


@dataclass(frozen=True, slots=True)
class Insensitivity:
    """How far a machine's frequencies may be off: the connected interval around 1 where V stays small."""

    tolerance: float  # -, V at the ends
    low: float  # -, actual over modelled frequency
    high: float | None  # -, None: no end below 6

    @property
    def width(self) -> float | None:
        """``high - low``."""
        return None if self.high is None else self.high - self.low

    @property
    def margin(self) -> float:
        """Distance of the nearer end from 1."""
        below = 1.0 - self.low
        return below if self.high is None else min(below, self.high - 1.0)


def insensitivity(
    shaper: Shaper, modes: Sequence[Mode], tolerance: float = DEFAULT_VIBRATION_TOLERANCE
) -> Insensitivity:
    """Connected interval of actual/modelled frequency with ``V <= tolerance`` at every mode.

    All modes move together. An interval that does not hold 1 itself (V above the tolerance at the
    design point) has no width.

    Raises
    ------
    OptionError
        Tolerance outside (0, 1).
    """
    check_tolerance(tolerance)
    low, high = bands(shaper.times[None, :], shaper.amplitudes[None, :], modes, tolerance)
    return Insensitivity(tolerance, float(low[0]), None if high[0] == inf else float(high[0]))


def check_tolerance(tolerance: float) -> None:
    """Refuse a vibration tolerance that is none.

    Raises
    ------
    OptionError
        Outside (0, 1).
    """
    if not 0.0 < tolerance < 1.0:
        raise OptionError(
            f"a vibration tolerance must lie between 0 and 1, not {tolerance}",
            hint="5 % is 0.05",
            argument="vibration_tolerance",
        )


def bands(
    times: FloatArray, amplitudes: FloatArray, modes: Sequence[Mode], tolerance: float
) -> tuple[FloatArray, FloatArray]:
    """Ends of the interval of insensitivity of many shapers at once.

    Parameters
    ----------
    times, amplitudes
        (m,k) s and -, a shaper in each row.
    modes
        What they are for.
    tolerance
        V at the ends.

    Returns
    -------
    low, high
        (m,) -, actual over modelled frequency; `high` is infinite where there is no end below 6.
    """
    curve = _Curve(times, amplitudes, tuple(modes), tolerance)
    low, high = curve.end(-1.0), curve.end(1.0)
    bad = curve.excess(np.arange(len(times)), np.ones((len(times), 1)))[:, 0] > ROUNDING * tolerance
    return np.where(bad, 1.0, low), np.where(bad, 1.0, high)


@dataclass(frozen=True, eq=False, slots=True)
class _Curve:
    """V of many shapers over the frequency ratio."""

    times: FloatArray  # (m,k) s
    amplitudes: FloatArray  # (m,k)
    modes: tuple[Mode, ...]
    tolerance: float

    def excess(self, rows: IntArray, ratio: FloatArray) -> FloatArray:
        """V of the worst mode beyond the tolerance: of the shapers in `rows` (n,) at `ratio` (n,p); (n,p)."""
        times, amplitudes = self.times[rows], self.amplitudes[rows]
        after = times - times[:, -1:]
        worst = np.zeros(ratio.shape)
        for mode in self.modes:
            rate = mode.damping_ratio * mode.omega * after + 1j * mode.omega_damped * times
            swing = np.exp(ratio[:, :, None] * rate[:, None, :]) @ amplitudes[:, :, None]
            np.maximum(worst, np.abs(swing[:, :, 0]), out=worst)
        return worst - self.tolerance

    def end(self, direction: float) -> FloatArray:
        """First ratio beyond 1, in `direction`, where V crosses the tolerance; infinite where none does."""
        swings = max(mode.natural_frequency for mode in self.modes) * float(self.times[:, -1].max())
        step = direction * min(LARGEST_STEP, 1.0 / (STEPS_PER_SWING * max(swings, 1e-9)))
        limit = LARGEST_FREQUENCY_RATIO if direction > 0.0 else 0.0
        found = np.full(len(self.times), inf)
        rows = np.arange(len(self.times))
        first = 1.0 if direction > 0.0 else self._calm_from(rows)
        while rows.size and (limit - first) * direction > 0.0:
            line: FloatArray = first + step * np.arange(BLOCK + 2, dtype=np.float64)
            line = np.clip(line, min(limit, 1.0), max(limit, 1.0))
            inside, outside = self._crossing(rows, np.broadcast_to(line, (rows.size, line.size)))
            crossed = np.isfinite(outside)
            found[rows[crossed]] = self._refined(rows[crossed], inside[crossed], outside[crossed])
            rows = rows[~crossed]
            first += step * BLOCK  # the last two points are looked at again: humps have three
            if direction > 0.0:
                rows = rows[~self._calm(rows, first)]
        return found

    def _calm_from(self, rows: IntArray) -> float:
        """A ratio from which on V of all shapers stays within the tolerance up to 1; 1 where it is not known.

        Damping near 1 makes long shapers of many swings, and all of them are over where V is large.
        """
        calm, restless = 1.0, 0.0
        if not self._calm(rows, calm).all():
            return calm
        for _ in range(HALVINGS):
            middle = 0.5 * (calm + restless)
            calm, restless = (middle, restless) if self._calm(rows, middle).all() else (calm, middle)
        return calm

    def _calm(self, rows: IntArray, ratio: float) -> BoolArray:
        """Whether V stays within the tolerance from `ratio` on: (n,).

        ``V <= sum |A_i| exp(-zeta omega ratio (t_N - t_i))``, which only falls as the ratio grows.
        """
        times, amplitudes = self.times[rows], np.abs(self.amplitudes[rows])
        before_last = times[:, -1:] - times
        calm: BoolArray = np.ones(len(rows), dtype=np.bool_)
        for mode in self.modes:
            decay = np.exp(-ratio * mode.damping_ratio * mode.omega * before_last)
            calm = calm & ((amplitudes * decay).sum(axis=1) <= self.tolerance)
        return calm

    def _crossing(self, rows: IntArray, ratio: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The first point outside and the one before it, (n,) each; infinite where all are inside."""
        slack = ROUNDING * self.tolerance
        value, points = self.excess(rows, ratio), ratio.shape[1]
        outside = value > slack
        first: IntArray = np.full(len(rows), points, dtype=np.int64)
        first[outside.any(axis=1)] = outside.argmax(axis=1)[outside.any(axis=1)]
        beyond = np.where(first < points, ratio[0][np.minimum(first, points - 1)], inf)
        before = ratio[0][np.maximum(first - 1, 0)]
        earlier: BoolArray = np.arange(1, points - 1, dtype=np.int64) < first[:, None]
        humps: BoolArray = (value[:, 1:-1] >= value[:, :-2]) & (value[:, 1:-1] >= value[:, 2:])
        humps = humps & (value[:, 1:-1] > -CLOSE) & earlier
        at, where = np.nonzero(humps)
        if at.size == 0:
            return before, beyond
        top, height = self._tops(rows[at], ratio[0][where + 1], abs(float(ratio[0, 1] - ratio[0, 0])))
        for k in np.flatnonzero(height > slack)[::-1].tolist():  # the first hump of a row is written last
            beyond[at[k]], before[at[k]] = top[k], ratio[0][where[k]]
        return before, beyond

    def _tops(self, rows: IntArray, middle: FloatArray, width: float) -> tuple[FloatArray, FloatArray]:
        """Place and height of the humps within `width` of `middle`, by parabolas through three points."""
        best, height = middle, self.excess(rows, middle[:, None])[:, 0]
        for _ in range(LOOKS):
            left, centre, right = self.excess(rows, middle[:, None] + width * np.array([-1.0, 0.0, 1.0])).T
            bend = left - 2.0 * centre + right
            shift = 0.5 * (left - right) / np.where(bend < 0.0, bend, -inf)
            middle = middle + width * np.clip(shift, -1.0, 1.0)
            value = self.excess(rows, middle[:, None])[:, 0]
            best, height = np.where(value > height, middle, best), np.maximum(value, height)
            width *= CLOSER
        return best, height

    def _refined(self, rows: IntArray, inside: FloatArray, outside: FloatArray) -> FloatArray:
        """Where V crosses the tolerance between two points, by halving."""
        for _ in range(HALVINGS):
            middle = 0.5 * (inside + outside)
            crossed = self.excess(rows, middle[:, None])[:, 0] > 0.0
            inside, outside = np.where(crossed, inside, middle), np.where(crossed, middle, outside)
        return 0.5 * (inside + outside)
