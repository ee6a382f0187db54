"""The shortest impulse sequence for known and uncertain modes within bounds.

How short can impulses be? On a grid of times the question is a linear program, and the duration is found by
bisection: on a coarse grid first, then on a fine one. Its answer shows where the impulses lie; a polish moves
them off the grid, to the duration itself. Nothing is returned that was not checked on a grid much denser than
the one of the design.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from math import ceil, inf, isfinite

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.errors import InfeasibleError, OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers.demands import END_AMPLITUDE, Band, Bounds, Demands, Zero, pole_of
from cnc_shape.shapers.linear_program import Cuts, GridAnswer, best_on_grid, first_cuts
from cnc_shape.shapers.polish import DROPPED, Impulses, polish, repair
from cnc_shape.shapers.shaper import Shaper

MOST_MODES = 6
MOST_ORDER = 3
LARGEST_RATIO = 50.0  # fastest over slowest mode
LARGEST_RUNNING_SUM = 20.0
LONGEST = 12.0  # periods of the slowest mode
SHORTEST = 0.01
CLOSEST = 200.0  # impulses a fastest period, where single impulses are bounded
SAME_MODE = 1e-6  # -, relative distance of frequencies that are one

COARSE, FINE = (36.0, 9.0), (100.0, 16.0)  # grid points a slowest and a fastest period
MOST_POINTS = 900
LEAST_POINTS = 48
NEIGHBOURS = 2  # points of the grid: impulses this close are one that lies between
SMALL = 1e-6  # -, amplitude of an impulse that is none
STRETCHES = 1.0, 1.01, 1.03, 1.1
BRACKET, END = 0.03, 0.002  # -, relative width at which the coarse and the fine bisection stop


def optimal(
    modes: Sequence[Mode],
    *,
    vibration_tolerance: float = 0.05,
    positive: bool = False,
    max_amplitude: float | None = None,
    min_running_sum: float = 0.0,
    max_running_sum: float = 1.0,
    max_sum_abs_amplitude: float | None = None,
    derivatives: Sequence[int] | None = None,
) -> Shaper:
    """Shortest impulses that silence the modes: exactly where they are known, within a tolerance where not.

    Parameters
    ----------
    modes
        A mode with an uncertainty (of frequency, of damping) keeps ``V <= vibration_tolerance`` on the whole
        rectangle; one without is cancelled.
    vibration_tolerance
        Residual vibration V allowed in a rectangle, as of `analysis.residual_vibration`.
    positive
        Amplitudes not negative.
    max_amplitude
        Largest ``|A_i|``; impulses then lie 1/200 of the fastest period apart at least, for two that are
        together would be one.
    min_running_sum, max_running_sum
        Bounds of ``A_1 + … + A_i``: where a step may go on its way from 0 to 1.
    max_sum_abs_amplitude
        Largest ``sum |A_i|``: the gain on any command.
    derivatives
        One number a mode: how many derivatives of V with respect to frequency vanish, too, where the mode
        is known; 1 makes of ZV a ZVD.

    Raises
    ------
    OptionError
        No modes, too many, too far apart, repeated ones, or an option outside what it may be.
    InfeasibleError
        No sequence within the bounds is short enough.

    Notes
    -----
    ``F(s) = sum A_i e^{s t_i}`` and ``V = e^{-zeta omega t_N} |F|`` (paper 000, eq 1); the k-th derivative of
    F vanishes where ``sum A_i t_i^k e^{s t_i}`` does.
    """
    orders = _check(
        modes, vibration_tolerance, max_amplitude, min_running_sum, max_running_sum,
        max_sum_abs_amplitude, derivatives,
    )  # fmt: skip
    period = max(1.0 / mode.natural_frequency for mode in modes)
    fastest = min(1.0 / mode.natural_frequency for mode in modes) / period
    bounds = Bounds(
        positive=positive or max_sum_abs_amplitude == 1.0,
        max_amplitude=inf if max_amplitude is None else max_amplitude,
        min_running_sum=min_running_sum,
        max_running_sum=max_running_sum,
        max_sum_abs_amplitude=inf if max_sum_abs_amplitude is None else max_sum_abs_amplitude,
        gap=fastest / CLOSEST if max_amplitude is not None else 1e-6 * fastest,
    )
    known = [(mode, order) for mode, order in zip(modes, orders, strict=True) if not _uncertain(mode)]
    demands = Demands(
        zeros=tuple(Zero(pole_of(mode.omega * period, mode.damping_ratio), order) for mode, order in known),
        bands=tuple(_band(mode, period) for mode in modes if _uncertain(mode)),
        tolerance=vibration_tolerance,
        bounds=bounds,
        fastest=fastest,
    )
    best = _shortest(demands)
    if best is None:
        raise _nothing_found(demands, max_amplitude, max_sum_abs_amplitude, LONGEST * period)
    return _shaper(best, period)


def _check(
    modes: Sequence[Mode],
    vibration_tolerance: float,
    max_amplitude: float | None,
    min_running_sum: float,
    max_running_sum: float,
    max_sum_abs_amplitude: float | None,
    derivatives: Sequence[int] | None,
) -> list[int]:
    """Refuse what makes no sense; return the order of every mode."""
    _check_modes(modes)
    if not 0.0 < vibration_tolerance < 1.0:
        raise OptionError(
            f"a vibration tolerance must lie between 0 and 1, not {vibration_tolerance}",
            hint="5 % is 0.05",
            argument="vibration_tolerance",
        )
    if max_amplitude is not None and not (isfinite(max_amplitude) and max_amplitude > 0.0):
        raise OptionError(
            f"the largest amplitude must be positive and finite, not {max_amplitude}",
            hint="leave it out to bound the running sums only",
            argument="max_amplitude",
        )
    if not -LARGEST_RUNNING_SUM <= min_running_sum <= 0.0:
        raise OptionError(
            f"the lowest running sum must lie between -{LARGEST_RUNNING_SUM:g} and 0, not {min_running_sum}",
            hint="a step starts at 0; -1 lets it go the wrong way by its own height",
            argument="min_running_sum",
        )
    if not 1.0 <= max_running_sum <= LARGEST_RUNNING_SUM:
        raise OptionError(
            f"the highest running sum must lie between 1 and {LARGEST_RUNNING_SUM:g}, not {max_running_sum}",
            hint="a step ends at 1; 2 lets it overshoot by its own height",
            argument="max_running_sum",
        )
    if max_sum_abs_amplitude is not None:
        if not isfinite(max_sum_abs_amplitude):
            raise OptionError(
                f"the largest sum of |A| must be finite, not {max_sum_abs_amplitude}",
                hint="leave it out to bound the running sums only",
                argument="max_sum_abs_amplitude",
            )
        if max_sum_abs_amplitude < 1.0:
            raise InfeasibleError(
                f"amplitudes that add up to 1 have a sum of |A| of 1 at least, not {max_sum_abs_amplitude}",
                hint="give 1 (no negative impulses) or more",
                argument="max_sum_abs_amplitude",
            )
    return _orders(modes, derivatives)


def _check_modes(modes: Sequence[Mode]) -> None:
    if not 1 <= len(modes) <= MOST_MODES:
        raise OptionError(
            f"a time-optimal shaper takes 1 to {MOST_MODES} modes, not {len(modes)}",
            hint="give the modes that ring most",
            argument="modes",
        )
    frequencies = [mode.natural_frequency for mode in modes]
    if (ratio := max(frequencies) / min(frequencies)) > LARGEST_RATIO:
        raise OptionError(
            f"the fastest mode is {ratio:.4g} times as fast as the slowest; "
            f"a time-optimal shaper takes {LARGEST_RATIO:g} times at most",
            hint="design for the slow modes, and put a short shaper for the fast ones in cascade",
            argument="modes",
        )
    for one, other in combinations([mode for mode in modes if not _uncertain(mode)], 2):
        near = abs(one.natural_frequency / other.natural_frequency - 1.0) < SAME_MODE
        if near and abs(one.damping_ratio - other.damping_ratio) < SAME_MODE:
            raise OptionError(
                f"the mode of {one.natural_frequency:g} Hz is there twice",
                hint="give it once, with a derivative more for more robustness",
                argument="modes",
            )


def _orders(modes: Sequence[Mode], derivatives: Sequence[int] | None) -> list[int]:
    if derivatives is None:
        return [0] * len(modes)
    if len(derivatives) != len(modes):
        raise OptionError(
            f"{len(derivatives)} numbers of derivatives for {len(modes)} modes",
            hint="give one a mode",
            argument="derivatives",
        )
    for order, mode in zip(derivatives, modes, strict=True):
        if not 0 <= order <= MOST_ORDER or order != int(order):
            raise OptionError(
                f"the number of derivatives must be 0 to {MOST_ORDER}, not {order}",
                hint="1 makes of ZV a ZVD",
                argument="derivatives",
            )
        if order and _uncertain(mode):
            raise OptionError(
                f"the mode of {mode.natural_frequency:g} Hz is uncertain: it has no derivatives to cancel, "
                f"but {order} are asked for",
                hint="give 0 for it, or leave its uncertainty out",
                argument="derivatives",
            )
    return [int(order) for order in derivatives]


def _uncertain(mode: Mode) -> bool:
    return mode.frequency_uncertainty > 0.0 or (mode.damping_uncertainty > 0.0 and mode.damping_ratio > 0.0)


def _band(mode: Mode, period: float) -> Band:
    omega, u = mode.omega * period, mode.frequency_uncertainty
    zeta, w = mode.damping_ratio, mode.damping_uncertainty
    return Band((omega * (1.0 - u), omega * (1.0 + u)), (zeta * (1.0 - w), zeta * (1.0 + w)))


def _grid(demands: Demands, duration: float, density: tuple[float, float]) -> FloatArray:
    points = duration * max(density[0], density[1] / demands.fastest)
    points = min(max(ceil(points), LEAST_POINTS), MOST_POINTS)
    if demands.bounds.limits_size:
        points = min(points, max(int(duration / demands.bounds.gap), 1))
    return np.linspace(0.0, duration, 2 * ceil(points / 2) + 1)


def _bracket(
    demands: Demands, cuts: Cuts, guess: float, density: tuple[float, float], width: float, stride: float
) -> tuple[GridAnswer | None, GridAnswer | None, Cuts]:
    """Longest duration seen that is too short, shortest that suffices, by steps and then bisection."""
    below: GridAnswer | None = None
    above: GridAnswer | None = None
    duration, enough = guess, 2.0 * demands.tolerance * 1e-3 if demands.bands else 1e-7
    while True:
        answer, cuts = best_on_grid(demands, _grid(demands, duration, density), cuts, enough)
        if answer.excess <= enough:
            above = answer
        else:
            below = answer
        low = float(below.times[-1]) if below else None
        high = float(above.times[-1]) if above else None
        if low is None:
            duration /= stride
            if duration < SHORTEST:
                break
        elif high is None:
            duration *= stride
            if duration > LONGEST:
                break
        elif high - low <= width * high:
            break
        else:
            duration = 0.5 * (low + high)
    return below, above, cuts


def _shortest(demands: Demands) -> Impulses | None:
    """Coarse and fine bisection, then the best of what polishing makes of their answers."""
    coarse = sum(0.5 * (zero.order + 1) * 2.0 * np.pi / abs(zero.pole) for zero in demands.zeros)
    coarse += sum(2.0 * np.pi / band.omega[1] for band in demands.bands)
    guess = float(coarse) * (1.0 if demands.bounds.positive else 0.6)
    below, above, cuts = _bracket(demands, first_cuts(demands), guess, COARSE, BRACKET, 1.4)
    if above is None:
        return None
    near = float(above.times[-1]) * (1.0 - BRACKET / 2)
    below, fine, cuts = _bracket(demands, cuts, near, FINE, END, 1.0 + BRACKET)
    if demands.bands and below is not None:
        below, cuts = best_on_grid(demands, below.times, cuts)
    best: Impulses | None = None
    for start in _starts(demands, [below, fine, above]):
        found = polish(demands, start)
        if found is not None and (best is None or found.times[-1] < best.times[-1] * (1.0 - 1e-9)):
            best = found
        if best is not None and fine is not None and best.times[-1] <= fine.times[-1] * (1.0 + END):
            break
    return best or _on_grid(demands, float((fine or above).times[-1]), cuts)


def _starts(demands: Demands, answers: Sequence[GridAnswer | None]) -> Iterator[Impulses]:
    known = [answer for answer in answers if answer is not None and answer.excess < inf]
    merged = [_merged(demands, answer, NEIGHBOURS) for answer in known]
    yield from merged
    single = [_merged(demands, answer, 0) for answer in known[:2]]
    yield from (some for some, few in zip(single, merged, strict=False) if some.times.size > few.times.size)


def _on_grid(demands: Demands, duration: float, cuts: Cuts) -> Impulses | None:
    """Impulses that stay on the grid, on durations that leave room for their rounding."""
    for stretch in STRETCHES:
        answer, cuts = best_on_grid(demands, _grid(demands, duration * stretch, FINE), cuts)
        if answer.excess < inf and (found := repair(demands, _merged(demands, answer, 0))) is not None:
            return found
    return None


def _merged(demands: Demands, answer: GridAnswer, neighbours: int) -> Impulses:
    """Impulses on the grid; those of one sign that are `neighbours` points apart at most as one."""
    a = answer.amplitudes.copy()
    a[-1] = a[-1] if abs(a[-1]) > END_AMPLITUDE else END_AMPLITUDE
    kept = np.flatnonzero(np.abs(a) > SMALL)
    times: list[float] = []
    amplitudes: list[float] = []
    previous = -9
    for i in kept.tolist():
        amplitude, time = float(a[i]), float(answer.times[i])
        together = amplitudes[-1] + amplitude if amplitudes else inf
        if (
            i - previous <= 2
            and amplitudes[-1] * amplitude > 0.0
            and abs(together) <= demands.bounds.max_amplitude
        ):
            if times[-1] > 0.0 and i < a.size - 1:
                times[-1] = (amplitudes[-1] * times[-1] + amplitude * time) / together
            elif i == a.size - 1:
                times[-1] = time
            amplitudes[-1] = together
        else:
            times.append(time)
            amplitudes.append(amplitude)
        previous = i
    return Impulses(np.array(times), np.array(amplitudes))


def _shaper(impulses: Impulses, period: float) -> Shaper:
    kept = np.abs(impulses.amplitudes) >= DROPPED
    amplitudes = impulses.amplitudes[kept]
    return Shaper(
        times=frozen(impulses.times[kept] * period), amplitudes=frozen(amplitudes / amplitudes.sum())
    )


def _nothing_found(
    demands: Demands, max_amplitude: float | None, max_sum_abs_amplitude: float | None, longest: float
) -> InfeasibleError:
    within = f"within {LONGEST:g} periods of the slowest mode ({longest:.4g} s)"
    if max_amplitude is not None:
        return InfeasibleError(
            f"no impulses of {max_amplitude:g} at most were found that do it {within}",
            hint="allow a larger amplitude, or more vibration",
            argument="max_amplitude",
        )
    return InfeasibleError(
        f"no impulses were found that leave as little as {demands.tolerance:g} of the vibration {within}",
        hint="allow more vibration, or less uncertainty",
        argument="vibration_tolerance",
    )
