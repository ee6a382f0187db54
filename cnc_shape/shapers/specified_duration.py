"""Specified-duration shapers: as long as asked, and as insensitive as that allows (paper 002)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from math import inf, isfinite

import numpy as np

from cnc_shape.arrays import BoolArray, FloatArray, frozen
from cnc_shape.errors import InfeasibleError, OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers.insensitivity import (
    DEFAULT_VIBRATION_TOLERANCE,
    LARGEST_FREQUENCY_RATIO,
    bands,
    check_tolerance,
)
from cnc_shape.shapers.sd_family import ON_THE_EDGE, Family, family
from cnc_shape.shapers.shaper import Shaper

LONGEST = 8.0  # damped periods: beyond, the conditions are lost in rounding
SHARES = 401  # of lambda, at first
ENDS = 40  # and at either end, ever nearer to 0 and 1
ZOOM, ZOOMS, PEAKS = 9, 10, 3  # points of a closer look, how often, around how many of the best
HALVINGS = 50  # to find where a bound becomes active
KEPT = 1e-12  # relative: a bound is kept to rounding
EQUAL = 1e-9  # -, robustness that differs by less is the same


class Robustness(Enum):
    """What a specified-duration shaper makes as large as possible."""

    INSENSITIVITY = "insensitivity"  # width of the band in which at most the tolerance is left
    MARGIN = "margin"  # distance of its nearer end from the modelled frequency


@dataclass(frozen=True, eq=False, slots=True)
class _Members:
    """Members of the family as impulses; rows that do not exist are NaN."""

    share: FloatArray  # (m,) lambda
    times: FloatArray  # (m,n) s
    amplitudes: FloatArray  # (m,n)

    @property
    def highest(self) -> FloatArray:
        """(m,) ``max |A_i|``, infinite where the member does not exist."""
        return np.nan_to_num(np.abs(self.amplitudes).max(axis=1), nan=inf)

    @property
    def gap(self) -> FloatArray:
        """(m,) s, the least time between impulses, negative infinity where the member does not exist."""
        return np.nan_to_num(np.diff(self.times, axis=1).min(axis=1), nan=-inf)


def sd(
    mode: Mode,
    *,
    duration: float | None = None,
    duration_periods: float | None = None,
    max_amplitude: float | None = None,
    min_gap: float = 0.0,
    vibration_tolerance: float = DEFAULT_VIBRATION_TOLERANCE,
    metric: Robustness = Robustness.INSENSITIVITY,
    positive: bool = False,
) -> Shaper:
    """Specified-duration shaper: the most insensitive one of a given duration (paper 002, eqs 3-13).

    Up to half a damped period an impulse is negative, and the insensitivity grows with the amplitudes, which
    therefore need a bound; beyond, all are positive. Robustness does not grow steadily with the duration: it
    jumps up where the hump of V beside the mode comes below the tolerance (undamped at 0.860, 1.284 and 1.739
    periods), on one side of the mode only; the margin grows steadily.

    Parameters
    ----------
    mode
        The vibration to cancel.
    duration
        Time of the last impulse, s.
    duration_periods
        The same in damped periods; give one of the two.
    max_amplitude
        Largest ``|A_i|``; must be given up to half a period.
    min_gap
        Least time between two impulses, s.
    vibration_tolerance
        V that the insensitivity is for.
    metric
        What is made as large as possible.
    positive
        No negative impulse.

    Raises
    ------
    OptionError
        None or both of the durations, a value out of its range, a short shaper without a bound.
    InfeasibleError
        No member of the family keeps the bounds; the message has the nearest that one can come.
    """
    periods = _periods(mode, duration, duration_periods)
    check_tolerance(vibration_tolerance)
    length = periods * mode.damped_period
    _check_bounds(periods, length, max_amplitude, min_gap, positive=positive)
    if abs(periods - 0.5) <= ON_THE_EDGE:  # all members are the two impulses of ZV
        return _zero_vibration(mode, max_amplitude, min_gap)
    members = _member_finder(mode, family(periods))

    def robustness(found: _Members, rows: BoolArray) -> FloatArray:
        score = np.full(found.share.size, -inf)
        if rows.any():
            low, high = bands(found.times[rows], found.amplitudes[rows], [mode], vibration_tolerance)
            high = np.minimum(high, LARGEST_FREQUENCY_RATIO)
            margin = metric is Robustness.MARGIN
            score[rows] = np.minimum(1.0 - low, high - 1.0) if margin else high - low
        return score

    def kept(found: _Members) -> BoolArray:
        bound = inf if max_amplitude is None else max_amplitude * (1.0 + KEPT)
        return np.isfinite(found.highest) & (found.highest <= bound) & (found.gap >= min_gap - KEPT * length)

    shares = _shares()
    offered = members(shares)
    if max_amplitude is not None:
        shares = np.append(shares, _crossings(members, offered, lambda m: m.highest - max_amplitude))
    if min_gap > 0.0:
        shares = np.append(shares, _crossings(members, offered, lambda m: min_gap - m.gap))
    offered = members(np.unique(shares))
    if not kept(offered).any():
        offered = _nearest(members, offered, periods, length, max_amplitude, min_gap)
    best = _most_robust(members, offered, robustness, kept)
    return Shaper(times=frozen(best.times[0]), amplitudes=frozen(best.amplitudes[0]))


def _periods(mode: Mode, duration: float | None, duration_periods: float | None) -> float:
    if (duration is None) == (duration_periods is None):
        raise OptionError(
            f"sd takes one duration, not {'none' if duration is None else 'both'}",
            hint="give it in seconds or in damped periods of the mode: 0.8 periods are short and robust",
        )
    argument = "duration" if duration_periods is None else "duration_periods"
    value = duration_periods if duration is None else duration / mode.damped_period
    assert value is not None
    if not (isfinite(value) and value > 0.0):
        raise OptionError(
            f"the duration must be positive and finite, not {value:g}",
            hint="0.8 damped periods are short and robust",
            argument=argument,
        )
    if value > LONGEST:
        raise OptionError(
            f"a duration of {value:.4g} damped periods is longer than {LONGEST:g}",
            hint="two periods cancel V and three of its derivatives",
            argument=argument,
        )
    return value


def _check_bounds(
    periods: float, length: float, max_amplitude: float | None, min_gap: float, *, positive: bool
) -> None:
    short = periods <= 0.5 + ON_THE_EDGE
    if max_amplitude is None and short:
        raise OptionError(
            f"a shaper of {periods:.4g} damped periods needs a bound on its amplitudes",
            hint="the higher its impulses, the more insensitive it is: say how high they may be",
            argument="max_amplitude",
        )
    if max_amplitude is not None and not (isfinite(max_amplitude) and max_amplitude > 0.0):
        raise OptionError(
            f"the largest amplitude must be positive and finite, not {max_amplitude:g}",
            hint="1 is as high as the command itself",
            argument="max_amplitude",
        )
    if positive and short and abs(periods - 0.5) > ON_THE_EDGE:
        raise InfeasibleError(
            f"a shaper of {periods:.4g} damped periods has a negative impulse",
            hint="half a period is the shortest with positive impulses: zv",
            argument="positive",
        )
    if not (isfinite(min_gap) and min_gap >= 0.0):
        raise OptionError(
            f"the least gap must be 0 or more, not {min_gap:g} s",
            hint="leave it out where impulses may be as close as they like",
            argument="min_gap",
        )
    if min_gap >= 0.5 * length:
        raise InfeasibleError(
            f"a gap of {min_gap:g} s does not fit twice into {length:.6g} s",
            hint="three impulses have two gaps",
            argument="min_gap",
        )


def _zero_vibration(mode: Mode, max_amplitude: float | None, min_gap: float) -> Shaper:
    from cnc_shape.shapers.zero_vibration import zv

    shaper = zv(mode)
    highest = float(shaper.amplitudes.max())
    if max_amplitude is not None and highest > max_amplitude * (1.0 + KEPT):
        raise _too_short(0.5, max_amplitude, highest)
    return shaper


def _too_short(periods: float, max_amplitude: float, least: float) -> InfeasibleError:
    return InfeasibleError(
        f"{periods:.4g} damped periods are too short for amplitudes of at most {max_amplitude:g}: "
        f"the smallest largest one is {least:.5g}",
        hint=f"allow {least:.4g} or more, or a longer shaper",
        argument="max_amplitude",
    )


def _shares() -> FloatArray:
    near = np.geomspace(1e-9, 1.0 / (SHARES + 1), ENDS, endpoint=False)
    return np.concatenate([near, np.linspace(0.0, 1.0, SHARES + 2)[1:-1], 1.0 - near[::-1]])


def _member_finder(mode: Mode, vectors: Family) -> Callable[[FloatArray], _Members]:
    """Members as impulses of a mode: damping enters here."""

    def members(share: FloatArray) -> _Members:
        angles, magnitudes = vectors(share)
        times = angles / mode.omega_damped
        amplitudes = magnitudes * np.exp(-mode.damping_ratio * mode.omega * times)
        total = amplitudes.sum(axis=1, keepdims=True)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            amplitudes = amplitudes / total
        bad = ~((np.diff(times, axis=1) > 0.0).all(axis=1) & np.isfinite(amplitudes).all(axis=1))
        times[bad], amplitudes[bad] = np.nan, np.nan
        return _Members(share, times, amplitudes)

    return members


def _crossings(
    members: Callable[[FloatArray], _Members], offered: _Members, excess: Callable[[_Members], FloatArray]
) -> FloatArray:
    """Where `excess` changes its sign, by halving; the side that keeps the bound."""
    value = excess(offered)
    change = np.flatnonzero((value[:-1] > 0.0) != (value[1:] > 0.0))
    falls = value[change] > 0.0
    kept = np.where(falls, offered.share[change + 1], offered.share[change])
    broken = np.where(falls, offered.share[change], offered.share[change + 1])
    for _ in range(HALVINGS if change.size else 0):
        middle = 0.5 * (kept + broken)
        out = excess(members(middle)) > 0.0
        kept, broken = np.where(out, kept, middle), np.where(out, middle, broken)
    return kept


def _nearest(
    members: Callable[[FloatArray], _Members],
    offered: _Members,
    periods: float,
    length: float,
    max_amplitude: float | None,
    min_gap: float,
) -> _Members:
    """Look for members that keep the bounds between those offered; refuse with the nearest there is."""
    roomy = offered.gap >= min_gap - KEPT * length
    if not roomy.any():
        raise InfeasibleError(
            f"no shaper of {periods:.4g} damped periods has gaps of {min_gap:g} s: the widest is "
            f"{float(offered.gap.max()):.5g} s",
            hint="allow shorter gaps, or a longer shaper",
            argument="min_gap",
        )

    def lowness(found: _Members) -> FloatArray:
        return np.where(found.gap >= min_gap - KEPT * length, -found.highest, -inf)

    best = _zoomed(members, offered, lowness, int(lowness(offered).argmax()))
    least = float(best.highest[0])
    assert max_amplitude is not None
    if least > max_amplitude * (1.0 + KEPT):
        raise _too_short(periods, max_amplitude, least)
    return best


def _most_robust(
    members: Callable[[FloatArray], _Members],
    offered: _Members,
    robustness: Callable[[_Members, BoolArray], FloatArray],
    kept: Callable[[_Members], BoolArray],
) -> _Members:
    """The member with the largest robustness: the best peaks among those offered, looked at ever closer."""

    def score(found: _Members) -> FloatArray:
        return robustness(found, kept(found))

    value = score(offered)
    peaks = np.argsort(-value, kind="stable")
    chosen = list[int]()
    for row in peaks.tolist():
        if len(chosen) < PEAKS and all(abs(row - other) > 1 for other in chosen):
            chosen.append(row)
    best, top = None, -inf
    for row in chosen:
        found = _zoomed(members, offered, score, row)
        reached = float(score(found)[0])
        if reached > top + EQUAL or best is None:
            best, top = found, reached
    assert best is not None
    middle = members(np.array([0.5]))
    if float(score(middle)[0]) >= top - EQUAL:
        return middle
    mirrored = members(1.0 - best.share)
    earlier = mirrored.amplitudes[0, 0] > best.amplitudes[0, 0]
    return mirrored if earlier and float(score(mirrored)[0]) >= top - EQUAL else best


def _zoomed(
    members: Callable[[FloatArray], _Members],
    offered: _Members,
    score: Callable[[_Members], FloatArray],
    row: int,
) -> _Members:
    """The best member near `row` of those offered, one row."""
    low = float(offered.share[max(row - 1, 0)])
    high = float(offered.share[min(row + 1, offered.share.size - 1)])
    best = float(offered.share[row])
    for _ in range(ZOOMS):
        share = np.append(np.linspace(low, high, ZOOM), best)
        best = float(share[int(score(members(share)).argmax())])
        reach = (high - low) / (ZOOM - 1)
        low, high = max(best - reach, low), min(best + reach, high)
    return members(np.array([best]))
