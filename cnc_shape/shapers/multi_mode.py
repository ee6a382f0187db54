"""Multi-mode shaper with the fewest impulses: n modes, n + 1 impulses (paper 001, appendix)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import inf, isfinite, pi
from numbers import Integral

import numpy as np

from cnc_shape.arrays import BoolArray, FloatArray, frozen
from cnc_shape.errors import InfeasibleError, OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers.impulse_equations import Conditions, conditions, polish, solve_from
from cnc_shape.shapers.shaper import Shaper

MOST_CONDITIONS = 8  # modes and derivatives together; beyond, the search takes too long to be sure of itself
DEFAULT_MAX_AMPLITUDE = 2.0  # -, the shortest shaper depends on this bound

BATCH = 256  # starts solved together
PATIENCE = 6  # batches without a shorter solution, for each time searched
WIDE = 10.0  # -, fastest over slowest mode: wider apart they have more solutions, up to twice the patience
MOST_BATCHES = 40  # in all, for each time searched
EQUALLY_SPACED = 128  # starts of impulses at equal distances
HORIZONS = (1.05, 2.1, 4.2)  # of the cascade's duration: where solutions are sought, in turn
ELITE = 8  # shortest solutions whose neighbourhood is searched
MOST_SHRUNK = 0.7  # -, a disturbed start is at least this long, relative
DISTURBANCE = 0.25  # of the fastest period, standard deviation of each time
PERIODS = 1.5  # of the fastest mode, by which a start moves, standard deviation
SMALL_DISTURBANCE = 0.05  # of the fastest period, beside whole ones
LOOKS = 8  # solutions polished per batch
SAME = 1e-6  # of the slowest period: times of one and the same solution
SEED = 20010  # the same shaper every time

SUSPICIOUS = 1e-4  # -, of an amplitude or of a gap: such an impulse may be superfluous
SMALLEST_GAP = 1e-7  # of the slowest period: closer impulses are one
RESIDUAL = 1e-12  # -, |F| of a solution
RESIDUAL_OF_FEWER = 1e-10  # -, |F| of one that does with fewer impulses: odd ratios as good as exact
EQUALLY_LONG = 1e-9  # -, relative
NOTHING = 1e-12  # -, rounding of an amplitude


@dataclass(frozen=True, eq=False, slots=True)
class Solution:
    """Impulses that solve the equations, in units of the slowest damped period."""

    times: FloatArray  # (m,)
    amplitudes: FloatArray  # (m,)

    @property
    def duration(self) -> float:
        """Time of the last impulse."""
        return float(self.times[-1])

    @property
    def largest(self) -> float:
        """``max |A_i|``."""
        return float(np.abs(self.amplitudes).max())

    @property
    def rank(self) -> tuple[int, float]:
        """Among equally long ones the lowest is best: few impulses, then the most symmetric."""
        times = self.times + self.times[::-1] - self.duration
        skewness = max(np.abs(times).max(), np.abs(self.amplitudes - self.amplitudes[::-1]).max())
        return self.times.size, round(float(skewness), 9)


@dataclass(frozen=True, slots=True)
class Demand:
    """What the amplitudes must keep."""

    max_amplitude: float
    positive: bool

    def met(self, amplitudes: FloatArray) -> BoolArray:
        """Whether each row of amplitudes (b,m) keeps it."""
        return self._within(amplitudes, NOTHING)

    def nearly_met(self, amplitudes: FloatArray) -> BoolArray:
        """Whether each row of amplitudes not yet polished may keep it."""
        return self._within(amplitudes, SUSPICIOUS)

    def _within(self, amplitudes: FloatArray, slack: float) -> BoolArray:
        small = np.abs(amplitudes).max(axis=-1) <= self.max_amplitude * (1.0 + slack)
        return small & (amplitudes.min(axis=-1) > -slack) if self.positive else small


def multi_mode(
    modes: Sequence[Mode],
    *,
    max_amplitude: float = DEFAULT_MAX_AMPLITUDE,
    positive: bool = False,
    derivatives: Sequence[int] | None = None,
) -> Shaper:
    """Cancel several modes with the fewest impulses: the shortest solution within the amplitude bound.

    K conditions need K + 1 impulses (paper 001, appendix): ``K = sum(d_k + 1)``, one per mode and one more
    per derivative. The equations have many isolated solutions; which of them is the shortest depends on
    `max_amplitude`. Where fewer impulses do (undamped modes at odd ratios: ZV of the slowest), fewer come
    out. Undamped, the mirror image is as good; the one with the larger amplitude first is returned.

    Parameters
    ----------
    modes
        Distinct modes; they may lie as close together as they like.
    max_amplitude
        Bound of every ``|A_i|``.
    positive
        Only positive impulses; the result may be longer than a cascade of ZV shapers.
    derivatives
        One number per mode: how many derivatives of the vibration by frequency vanish at the mode as
        well. None: 0 for each.

    Raises
    ------
    OptionError
        No mode, a mode twice, too many conditions, a bound that is not positive and finite, derivatives
        that are not one whole number >= 0 per mode.
    InfeasibleError
        No solution within the bound, or none with positive impulses.
    """
    orders = _checked(modes, max_amplitude, derivatives)
    period = max(mode.damped_period for mode in modes)
    poles = [
        period * mode.omega * complex(mode.damping_ratio, mode.omega_damped / mode.omega) for mode in modes
    ]
    found = _search(conditions(poles, orders), Demand(max_amplitude, positive))
    times, amplitudes = found.times, found.amplitudes
    undamped = all(mode.damping_ratio == 0.0 for mode in modes)
    if undamped and amplitudes[0] < amplitudes[-1] - NOTHING:
        times, amplitudes = times[-1] - times[::-1], amplitudes[::-1]
    return Shaper(times=frozen(period * times), amplitudes=frozen(amplitudes / amplitudes.sum()))


def _checked(modes: Sequence[Mode], max_amplitude: float, derivatives: Sequence[int] | None) -> Sequence[int]:
    """Orders of the derivatives, or the complaint."""
    if not modes:
        raise OptionError("a multi-mode shaper needs a mode at least", hint="give the frequency of each mode")
    for a, b in combinations(modes, 2):
        if (a.natural_frequency, a.damping_ratio) == (b.natural_frequency, b.damping_ratio):
            raise OptionError(
                f"the mode of {a.natural_frequency:g} Hz, damping ratio {a.damping_ratio:g}, is given twice",
                hint="derivatives = 1 on a single mode is what two equal ones come to; "
                "a cascade takes them as they are",
            )
    if not (isfinite(max_amplitude) and max_amplitude > 0.0):
        raise OptionError(
            f"the largest amplitude must be positive and finite, not {max_amplitude}",
            hint=f"{DEFAULT_MAX_AMPLITUDE:g} is the default",
            argument="max_amplitude",
        )
    orders = [0] * len(modes) if derivatives is None else list(derivatives)
    if len(orders) != len(modes):
        raise OptionError(
            f"derivatives must be one number per mode: {len(orders)} for {len(modes)}",
            hint="1 makes the shaper robust to an error of that mode's frequency, 0 does not",
            argument="derivatives",
        )
    for order in orders:
        if isinstance(order, bool) or not isinstance(order, Integral) or order < 0:
            raise OptionError(
                f"derivatives must be whole numbers from 0 on, not {order}",
                hint="1 makes the shaper robust to an error of that mode's frequency, 0 does not",
                argument="derivatives",
            )
    if sum(orders) + len(orders) > MOST_CONDITIONS:
        raise OptionError(
            f"{len(modes)} modes with {sum(orders)} derivatives make {sum(orders) + len(orders)} conditions; "
            f"at most {MOST_CONDITIONS} can be solved together",
            hint="use a cascade, or leave weak modes out",
            argument=None if derivatives is None else "derivatives",
        )
    return orders


def _search(rows: Conditions, demand: Demand) -> Solution:
    """Shortest solution that meets the demand."""
    cascade = float(np.sum(pi / rows.centres.imag))
    smallest = inf
    for horizon in HORIZONS:
        best, found = _shortest(rows, demand, horizon * cascade)
        if best is not None:
            return best
        smallest = min(smallest, found)
    if demand.positive and not isfinite(smallest):
        raise InfeasibleError(
            f"no solution with {rows.impulses} positive impulses",
            hint="allow negative ones, or use a cascade",
            argument="positive",
        )
    if not isfinite(smallest):
        raise InfeasibleError(
            f"no solution with {rows.impulses} impulses was found",
            hint="use a cascade; heavy damping needs no shaper",
        )
    raise InfeasibleError(
        f"no solution with |A| <= {demand.max_amplitude:g}: the smallest found is {smallest:.4g}",
        hint=f"allow {np.ceil(1e3 * smallest) / 1e3:g}, or use a cascade",
        argument="max_amplitude",
    )


def _shortest(rows: Conditions, demand: Demand, horizon: float) -> tuple[Solution | None, float]:
    """Shortest solution within `horizon` that meets the demand, and the smallest ``max |A_i|`` seen.

    Starts are random at first; once solutions are known, half of the starts are these, compressed and
    disturbed. All starts are shorter than the best so far. The search ends when it has not improved for long.
    """
    random = np.random.default_rng(SEED)
    best: Solution | None = None
    smallest = inf
    elite = np.empty((0, rows.impulses))
    without = 0
    batches = _equally_spaced(rows, horizon)
    spread = float(rows.centres.imag.max() / rows.centres.imag.min())
    patience = round(PATIENCE * min(max(spread / WIDE, 1.0), 2.0)) * rows.centres.size
    for _ in range(MOST_BATCHES * rows.centres.size):
        if without == patience:
            break
        limit = horizon if best is None else best.duration
        starts = next(batches, None)
        if starts is None:
            starts = _starts(random, elite, rows, limit)
        times, amplitudes = _ordered(*solve_from(rows, starts))
        regular = np.diff(times, axis=1).min(axis=1) > SUSPICIOUS
        signs = regular & ((amplitudes.min(axis=1) > 0.0) | (not demand.positive))
        smallest = min(smallest, float(np.abs(amplitudes[signs]).max(axis=1).min(initial=inf)))
        near = demand.nearly_met(amplitudes) & (times[:, -1] <= limit * (1.0 + EQUALLY_LONG))
        times, amplitudes = times[near], amplitudes[near]
        without += 1
        for row in _promising(times, best):
            solution = _settled(rows, times[row], amplitudes[row])
            if solution is None or not demand.met(solution.amplitudes):
                continue
            if best is None or solution.duration < best.duration * (1.0 - EQUALLY_LONG):
                best, without = solution, 0
            elif solution.duration <= best.duration * (1.0 + EQUALLY_LONG) and solution.rank < best.rank:
                best = solution
        if times.shape[1] == rows.impulses:
            elite = np.concatenate([elite, times])
            _, first = np.unique(np.round(elite[:, -1], 6), return_index=True)
            elite = elite[first[:ELITE]]
    return best, smallest


def _equally_spaced(rows: Conditions, horizon: float) -> Iterator[FloatArray]:
    """Equally spaced starts: with fewer impulses than the equations ask for, then with as many."""
    for impulses in range(2, rows.impulses + 1):
        spacing = np.linspace(0.0, horizon / (impulses - 1), EQUALLY_SPACED + 1)[1:]
        yield np.multiply.outer(spacing, np.arange(impulses))


def _starts(random: np.random.Generator, elite: FloatArray, rows: Conditions, limit: float) -> FloatArray:
    """Times (b,m), the first 0, from which to look for solutions no longer than `limit`.

    Half of them are symmetric in time, as light damping likes it. Those near known solutions keep what these
    do to the fastest mode where they move by whole periods of it.
    """
    near = BATCH // 2 if len(elite) else 0
    starts = limit * random.random((BATCH - near, rows.impulses))
    if near:
        fastest = 2.0 * pi / float(rows.centres.imag.max())
        chosen = elite[random.integers(len(elite), size=near)]
        shrunk = chosen * random.uniform(MOST_SHRUNK, 1.0, (near, 1))
        shrunk += DISTURBANCE * fastest * random.standard_normal(chosen.shape)
        periods = np.rint(PERIODS * random.standard_normal(chosen.shape)) * fastest
        moved = chosen + periods + SMALL_DISTURBANCE * fastest * random.standard_normal(chosen.shape)
        starts = np.concatenate([starts, np.where(np.arange(near)[:, None] % 4 < 2, shrunk, moved)])
    starts.sort(axis=1)
    starts -= starts[:, :1]
    starts[::2] = 0.5 * (starts[::2] + starts[::2, -1:] - starts[::2, ::-1])
    return starts


def _ordered(times: FloatArray, amplitudes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sort every row by time, and let it begin at 0: the equations do not mind."""
    order = np.argsort(times, axis=1, kind="stable")
    times = np.take_along_axis(times, order, axis=1)
    return times - times[:, :1], np.take_along_axis(amplitudes, order, axis=1)


def _promising(times: FloatArray, best: Solution | None) -> list[int]:
    """Rows worth a closer look, the shortest first: distinct, and not the best so far or its mirror image."""
    rows: list[int] = []
    known = [] if best is None else [best.times, best.duration - best.times[::-1]]
    for row in np.argsort(times[:, -1], kind="stable").tolist():
        if all(old.size != times[row].size or np.abs(old - times[row]).max() > SAME for old in known):
            rows.append(row)
            known.append(times[row])
        if len(rows) == LOOKS:
            break
    return rows


def _settled(rows: Conditions, times: FloatArray, amplitudes: FloatArray) -> Solution | None:
    """Polish a solution, without the impulses it can do without; None if nothing solid is left.

    An impulse of amplitude 0 may sit anywhere, and two at one time share their sum in any way: the
    solution is then one of a family, and the family's shaper has fewer impulses.
    """
    if times.size > 2:
        gaps = np.diff(times)
        weakest = 1 + int(np.argmin(np.abs(amplitudes[1:-1])))
        if abs(amplitudes[weakest]) < SUSPICIOUS:
            fewer = _settled(rows, np.delete(times, weakest), np.delete(amplitudes, weakest))
            if fewer is not None:
                return fewer
        closest = int(np.argmin(gaps))
        if gaps[closest] < SUSPICIOUS:
            joined = np.delete(amplitudes, closest)
            joined[closest] += amplitudes[closest]
            fewer = _settled(rows, np.delete(times, closest + (closest == 0)), joined)
            if fewer is not None:
                return fewer
    tolerance = RESIDUAL if times.size == rows.impulses else RESIDUAL_OF_FEWER
    times, amplitudes, error = polish(rows, times, amplitudes)
    if error > tolerance or np.diff(times).min() < SMALLEST_GAP:
        return None
    return Solution(times, amplitudes)
