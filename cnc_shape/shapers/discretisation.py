"""Shapers on a sample grid: impulses between samples become taps on them.

A live chain has nothing but samples of the position, one every `sample_time`. An impulse that falls between
two samples must be made from its neighbours, and what that does to the vibration is a matter of how:

========  ==========================================  =============================================
rounded   the nearest sample                          worst ``V = sin(pi D / 2T)``
linear    two taps, shares of the distance            worst ``V = sin^2(pi D / 2T)``, the square
cubic     four taps through a cubic (Lagrange)        worst ``V = (1 - c)^2 (2 + c) / 4``, c = cos(pi D/T)
exact     the neighbours, with amplitudes solved      none at the modes
          again for what the shaper promises there
========  ==========================================  =============================================

D is the interval, T the period of the vibration, V that of a ZV shaper of an undamped mode (paper 000,
section 2.2, asks for a small interval; these are the numbers).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from math import cos, isfinite, pi, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from cnc_shape.arrays import FloatArray, IntArray, frozen
from cnc_shape.errors import InfeasibleError, OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers.shaper import Shaper

GRID_TOLERANCE = 1e-9  # -, of a sample: an impulse this close to the grid lies on it
VANISHED = 1e-6  # -, of the largest it could be: a derivative this small is one the shaper has made vanish
SOLVED = 1e-12  # -, what may be left of an equation
GROWTH = 1.5  # -, how much larger than the shaper's the sum of |weights| may become
WIDENINGS = 5  # how often more samples are taken to help before there is no answer
MOST_TAPS = 200_000  # samples by which an impulse may be late
COARSE = 0.03  # -, sample time over period beyond which rounding leaves more than 5 per cent


class Interpolation(Enum):
    """How an impulse between two samples is made from samples."""

    ROUNDED = "rounded"
    LINEAR = "linear"
    CUBIC = "cubic"
    EXACT = "exact"


@dataclass(frozen=True, eq=False, slots=True)
class Taps:
    """A shaper as a filter: ``out[n] = sum_k weights[k] * in[n - k]``."""

    weights: FloatArray  # (n,) -, sum 1
    sample_time: float  # s
    latency: int = 0  # samples by which all of it is later than the shaper

    @property
    def delay(self) -> float:
        """Centroid of the taps, s, latency included: how late the output is on steady motion."""
        return float(self.weights @ np.arange(self.weights.size)) * self.sample_time

    @property
    def used(self) -> IntArray:
        """Sample delays whose weights are not zero, increasing."""
        return np.flatnonzero(self.weights)

    @property
    def shaper(self) -> Shaper:
        """The taps as impulses, the first of them at 0: whatever is asked of a shaper can be asked of it."""
        used = self.used
        return Shaper(frozen((used - used[0]) * self.sample_time), frozen(self.weights[used]))


def discretise(
    shaper: Shaper,
    sample_time: float,
    interpolation: Interpolation,
    modes: Sequence[Mode] = (),
    *,
    delay: float | None = None,
) -> Taps:
    """Put a shaper's impulses on a sample grid.

    Parameters
    ----------
    shaper
        The impulses.
    sample_time
        Interval of the samples, s.
    interpolation
        What becomes of an impulse between two samples. Linear and cubic taps keep the centroid of the
        impulses; a cubic needs a sample ahead where an impulse is less than one sample late, and then
        everything is one sample later (`Taps.latency`).
    modes
        Where exact taps do what the shaper does: its residual vibration, and as many derivatives of it as
        vanish.
    delay
        How late the output shall be on steady motion, s, but for `Taps.latency`: every impulse is moved by
        ``delay - shaper.delay``, so that axes with unlike shapers stay in step. Exact taps keep it exactly,
        which takes one more of them. None: the shaper as it is.

    Raises
    ------
    OptionError
        A sample time that is not positive, longer than half the shaper, or far too short for it.
    InfeasibleError
        No exact taps near the impulses.
    ValueError
        `delay` is shorter than that of the shaper.
    """
    check_sample_time(shaper, sample_time)
    late = 0.0 if delay is None else delay - shaper.delay
    if late < -GRID_TOLERANCE * sample_time:
        raise ValueError(f"{delay=} is shorter than {shaper.delay=}")
    times = shaper.times + late
    samples = times / sample_time
    if samples[-1] > MOST_TAPS:
        raise OptionError(
            f"the last impulse would be {samples[-1]:.4g} samples late, more than {MOST_TAPS}",
            hint=f"sample every {1e3 * times[-1] / MOST_TAPS:.4g} ms or less often",
            argument="sample_time",
        )
    nearest = np.rint(samples)
    if interpolation is Interpolation.ROUNDED:
        samples = nearest
    samples = np.where(np.abs(samples - nearest) <= GRID_TOLERANCE, nearest, samples)
    if interpolation is Interpolation.CUBIC:
        return _cubic(samples, shaper.amplitudes, sample_time)
    weights = _linear(samples, shaper.amplitudes)
    if interpolation is Interpolation.EXACT and np.any(samples != np.rint(samples)):
        weights = _exact(
            samples, weights, Shaper(frozen(times), shaper.amplitudes), sample_time, modes, delay
        )
    return Taps(frozen(weights), sample_time)


def check_sample_time(shaper: Shaper, sample_time: float) -> None:
    """Refuse an interval that no shaper, or not this one, can be sampled at.

    Raises
    ------
    OptionError
        Not positive, not finite, or longer than half the shaper.
    """
    if not (isfinite(sample_time) and sample_time > 0.0):
        raise OptionError(
            f"the sample time must be positive and finite, not {sample_time:g} s", argument="sample_time"
        )
    if 0.0 < shaper.duration < 2.0 * sample_time * (1.0 - GRID_TOLERANCE):
        raise OptionError(
            f"a shaper of {1e3 * shaper.duration:.4g} ms cannot be sampled every {1e3 * sample_time:.4g} ms",
            hint=f"sample at least every {1e3 * shaper.duration / 2.0:.4g} ms, half its duration",
            argument="sample_time",
        )


def worst_residual(interpolation: Interpolation, sample_time: float, mode: Mode) -> float:
    """Residual vibration V that a ZV shaper of an undamped mode has at the worst place of its impulse.

    That is half way between two samples. Exact taps have none, whatever the place.
    """
    phase = pi * sample_time / mode.damped_period
    if interpolation is Interpolation.EXACT:
        return 0.0
    if interpolation is Interpolation.ROUNDED:
        return sin(min(phase, pi) / 2.0)
    if interpolation is Interpolation.LINEAR:
        return sin(phase / 2.0) ** 2
    return (1.0 - cos(phase)) ** 2 * (2.0 + cos(phase)) / 4.0


def coarse(interpolation: Interpolation, sample_time: float, modes: Sequence[Mode]) -> str | None:
    """What there is to warn of: impulses rounded to a grid that is coarse for the fastest mode."""
    if interpolation is not Interpolation.ROUNDED or not modes:
        return None
    fastest = min(modes, key=lambda mode: mode.damped_period)
    if sample_time <= COARSE * fastest.damped_period:
        return None
    rounded, linear = (
        worst_residual(way, sample_time, fastest) for way in (Interpolation.ROUNDED, Interpolation.LINEAR)
    )
    return (
        f"impulses rounded to {1e3 * sample_time:.4g} ms leave up to {rounded:.2g} of the vibration "
        f"at {fastest.natural_frequency:.4g} Hz; linear interpolation leaves {linear:.2g}"
    )


def _linear(samples: FloatArray, amplitudes: FloatArray) -> FloatArray:
    """Two taps for each impulse between samples, one for each on the grid."""
    left = np.floor(samples).astype(np.int64)
    share = samples - left
    weights = np.zeros(int(np.ceil(samples[-1])) + 1)
    np.add.at(weights, left, amplitudes * (1.0 - share))
    between = share > 0.0
    np.add.at(weights, left[between] + 1, (amplitudes * share)[between])
    return weights


def _cubic(samples: FloatArray, amplitudes: FloatArray, sample_time: float) -> Taps:
    """Four taps for each impulse between samples: the cubic through the two samples on either side."""
    left = np.floor(samples).astype(np.int64)
    between = samples > left
    latency = int(np.any(between & (left == 0)))
    weights = np.zeros(int(left[-1]) + 3 + latency)
    np.add.at(weights, (left + latency)[~between], amplitudes[~between])
    f, amplitude = (samples - left)[between], amplitudes[between]
    first = (left + latency - 1)[between]
    stencil = (
        -f * (f - 1.0) * (f - 2.0) / 6.0,
        (f + 1.0) * (f - 1.0) * (f - 2.0) / 2.0,
        -(f + 1.0) * f * (f - 2.0) / 2.0,
        (f + 1.0) * f * (f - 1.0) / 6.0,
    )
    for k, share in enumerate(stencil):
        np.add.at(weights, first + k, amplitude * share)
    return Taps(frozen(weights[: np.flatnonzero(weights)[-1] + 1]), sample_time, latency)


def _exact(
    samples: FloatArray,
    linear: FloatArray,
    shaper: Shaper,
    sample_time: float,
    modes: Sequence[Mode],
    delay: float | None,
) -> FloatArray:
    """Weights nearest to the linear ones that keep what the shaper promises.

    With k equations for fewer than k samples there is no answer, and none either where the equations of
    different samples happen to say the same (a ZVD shaper whose last impulse lies on the grid): then samples
    further out help, first beside impulses on the grid, then on both sides of all.
    """
    wanted, target = _promises(shaper, modes, delay)
    largest = GROWTH * shaper.sum_abs_amplitude
    for support in _supports(samples):
        start = np.zeros(support.size)
        inside = support < linear.size
        start[inside] = linear[support[inside]]
        equations = _equations(wanted, frozen(support * sample_time), shaper.duration)
        change = np.linalg.lstsq(equations, target - equations @ start, rcond=SOLVED)[0]
        found = start + change
        found /= found.sum()
        if np.abs(equations @ found - target).max() <= SOLVED and np.abs(found).sum() <= largest:
            weights = np.zeros(int(support[-1]) + 1)
            weights[support] = found
            return weights
    raise InfeasibleError(
        f"no taps every {1e3 * sample_time:.4g} ms near its impulses do what this shaper does at its modes",
        hint="sample more often, or take linear interpolation",
    )


@dataclass(frozen=True, slots=True)
class _Promise:
    """``sum A_i x_i^order e^{s t_i}`` keeps its value, with x from -1 to 1 over the shaper."""

    s: complex  # 1/s; 0: the sum (order 0), the centroid (order 1)
    order: int


def _promises(
    shaper: Shaper, modes: Sequence[Mode], delay: float | None
) -> tuple[list[_Promise], FloatArray]:
    """What is to be kept, and the right-hand sides: sum and centroid first, then two for each promise."""
    kept = [_Promise(0.0, 0)] if delay is None else [_Promise(0.0, 0), _Promise(0.0, 1)]
    for mode in modes:
        s = mode.omega * complex(mode.damping_ratio, sqrt(1.0 - mode.damping_ratio**2))
        kept.append(_Promise(s, 0))
        order = 0
        while order < shaper.times.size - 1 and _vanishes(shaper, kept[-1]):
            order += 1
            if _vanishes(shaper, _Promise(s, order)):
                kept.append(_Promise(s, order))
            else:
                break
    return kept, _equations(kept, shaper.times, shaper.duration) @ shaper.amplitudes


def _vanishes(shaper: Shaper, promise: _Promise) -> bool:
    row = _row(promise, shaper.times, shaper.duration)
    return bool(abs(row @ shaper.amplitudes) <= VANISHED * (np.abs(row) @ np.abs(shaper.amplitudes)))


def _row(promise: _Promise, times: FloatArray, duration: float) -> NDArray[np.complex128]:
    x = 2.0 * times / duration - 1.0
    return np.multiply(x**promise.order, np.exp(complex(promise.s) * times - promise.s.real * duration))


def _equations(promises: Sequence[_Promise], times: FloatArray, duration: float) -> FloatArray:
    rows: list[FloatArray] = []
    for promise in promises:
        row = _row(promise, times, duration)
        rows.append(row.real)
        if promise.s != 0.0:
            rows.append(row.imag)
    return np.array(rows)


def _supports(samples: FloatArray) -> Sequence[IntArray]:
    """Samples that may carry weight: the neighbours of the impulses, then more and more."""
    left, right = np.floor(samples).astype(np.int64), np.ceil(samples).astype(np.int64)
    on_grid = left == right
    found = [np.union1d(left, right)]
    for more in range(WIDENINGS):
        low, high = left - more - on_grid, right + more + on_grid
        reached = {
            k for a, b in zip(low.tolist(), high.tolist(), strict=True) for k in range(max(a, 0), b + 1)
        }
        found.append(np.array(sorted(reached), dtype=np.int64))
    return found
