"""What an impulse sequence has to achieve and what its impulses may be: the time-optimal problem.

Times are in periods of the slowest mode, so that every number here is near 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, inf, pi, sqrt
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from cnc_shape.arrays import FloatArray

ComplexArray: TypeAlias = NDArray[np.complex128]

SAMPLES_PER_LOBE = 16  # of V over frequency, whose lobes are as wide as one over the duration
DAMPING_SAMPLES = 5
LEAST_BAND = 17  # samples, however narrow a band is
LARGEST_EXPONENT = 50.0  # of times that an iteration tries in the wrong order
SUMMIT_STEPS = 3  # parabolas from a sample to its summit
SUMMIT_SHARE = 0.8  # -, of what a summit must exceed: lower samples cannot belong to it
END_AMPLITUDE = 1e-4  # -, least of a last impulse: the decay in V counts from there


@dataclass(frozen=True, slots=True)
class Zero:
    """A mode that is known: its vibration and the first `order` derivatives must vanish."""

    pole: complex  # omega (zeta + j sqrt(1 - zeta^2)), per period
    order: int


@dataclass(frozen=True, slots=True)
class Band:
    """A mode that is uncertain: its vibration must stay small on a rectangle of frequency and damping."""

    omega: tuple[float, float]  # undamped, per period
    zeta: tuple[float, float]

    def samples(self, duration: float, refinement: int = 1) -> tuple[FloatArray, FloatArray]:
        """Return frequencies and damping ratios, dense enough to see every lobe of V."""
        lobes = (self.omega[1] - self.omega[0]) * duration / (2.0 * pi)
        count = max(ceil(lobes * SAMPLES_PER_LOBE), LEAST_BAND) * refinement
        omegas = (
            np.linspace(*self.omega, count) if self.omega[0] < self.omega[1] else np.array(self.omega[:1])
        )
        many = DAMPING_SAMPLES * refinement
        zetas = np.linspace(*self.zeta, many) if self.zeta[0] < self.zeta[1] else np.array(self.zeta[:1])
        return omegas, zetas


@dataclass(frozen=True, slots=True)
class Bounds:
    """What the impulses may be. With `positive` the running sums rise from 0 to 1 by themselves."""

    positive: bool
    max_amplitude: float
    min_running_sum: float
    max_running_sum: float
    max_sum_abs_amplitude: float
    gap: float  # least distance of two impulses, periods

    @property
    def limits_size(self) -> bool:
        """Whether single impulses are bounded: then two that are close may not count as one."""
        return self.max_amplitude < inf


@dataclass(frozen=True, slots=True)
class Demands:
    """The whole problem: shortest impulses within `bounds` with these zeros and quiet bands."""

    zeros: tuple[Zero, ...]
    bands: tuple[Band, ...]
    tolerance: float  # -, of V on every band
    bounds: Bounds
    fastest: float  # shortest period of a mode, in periods of the slowest


def pole(omega: FloatArray | float, zeta: FloatArray | float) -> ComplexArray:
    """``s = omega (zeta + j sqrt(1 - zeta^2))``."""
    return np.asarray(omega * (zeta + 1j * np.sqrt(1.0 - np.square(zeta))), dtype=np.complex128)


def waves(poles: ComplexArray, times: FloatArray) -> ComplexArray:
    """``e^{s t - Re(s) t_N}``, shape of `poles` + (n,): decayed from the last time, so it cannot overflow."""
    decay = np.minimum(np.multiply.outer(poles.real, times - times[-1]), LARGEST_EXPONENT)
    return np.exp(decay + 1j * np.multiply.outer(poles.imag, times))


def zero_rows(zeros: Sequence[Zero], times: FloatArray) -> ComplexArray:
    """Rows r with ``r @ A = sum A t^k e^{s t}``, decayed, for every zero and every order k."""
    rows = [
        waves(np.array([zero.pole]), times)[0] * times**order
        for zero in zeros
        for order in range(zero.order + 1)
    ]
    return np.array(rows, dtype=np.complex128).reshape(-1, times.size)


def peaks(
    band: Band, times: FloatArray, amplitudes: FloatArray, above: float
) -> tuple[ComplexArray, FloatArray]:
    """Poles and values of the maxima of V over a band that exceed `above`.

    Maxima of a sampled surface, each moved to its summit by parabolas over ever shorter steps.
    """
    omegas, zetas = band.samples(float(times[-1]))
    surface = np.abs(waves(pole(omegas[:, None], zetas[None, :]), times) @ amplitudes)
    walled = np.pad(surface, 1, constant_values=-1.0)
    inner = walled[1:-1, 1:-1]
    is_peak = (inner >= walled[:-2, 1:-1]) & (inner >= walled[2:, 1:-1])
    is_peak &= (inner >= walled[1:-1, :-2]) & (inner >= walled[1:-1, 2:])
    is_peak &= inner > SUMMIT_SHARE * above
    i, j = np.nonzero(is_peak)
    omega, zeta, value = omegas[i], zetas[j], inner[i, j]
    steps = [float(grid[1] - grid[0]) if grid.size > 1 else 0.0 for grid in (omegas, zetas)]
    for _ in range(SUMMIT_STEPS if i.size else 0):
        for axis, step in enumerate(steps):
            if step == 0.0:
                continue
            here, (low, high) = (omega, band.omega) if axis == 0 else (zeta, band.zeta)
            middle = np.clip(here, low + step, high - step)  # at an edge the summit may lie inside
            stencil = np.clip(middle[:, None] + step * np.array([-1.0, 0.0, 1.0]), low, high)
            poles = pole(stencil, zeta[:, None]) if axis == 0 else pole(omega[:, None], stencil)
            v = np.abs(waves(poles, times) @ amplitudes)
            there = _summit(stencil, v)
            tried = np.abs(waves(pole(there, zeta) if axis == 0 else pole(omega, there), times) @ amplitudes)
            options = np.column_stack([v, tried, value])
            which = options.argmax(axis=1)[:, None]
            value = np.take_along_axis(options, which, axis=1)[:, 0]
            there = np.take_along_axis(np.column_stack([stencil, there, here]), which, axis=1)[:, 0]
            omega, zeta = (there, zeta) if axis == 0 else (omega, there)
        steps = [step / 6.0 for step in steps]
    high_enough = value > above
    return pole(omega, zeta)[high_enough], value[high_enough]


def _summit(x: FloatArray, v: FloatArray) -> FloatArray:
    """Vertex of the parabola through three points a row, (m, 3); the best of them where there is none."""
    left, right = x[:, 1] - x[:, 0], x[:, 2] - x[:, 1]
    whole = (left > 0.0) & (right > 0.0)
    rise = np.where(whole, (v[:, 1] - v[:, 0]) / np.where(whole, left, 1.0), 0.0)
    fall = np.where(whole, (v[:, 2] - v[:, 1]) / np.where(whole, right, 1.0), 0.0)
    bend = np.where(whole, (fall - rise) / np.where(whole, left + right, 1.0), 0.0)
    round_ = bend < 0.0
    vertex = 0.5 * (x[:, 0] + x[:, 1]) - rise / (2.0 * np.where(round_, bend, 1.0))
    best = np.take_along_axis(x, v.argmax(axis=1)[:, None], axis=1)[:, 0]
    return np.clip(np.where(round_, vertex, best), x[:, 0], x[:, 2])


def worst(demands: Demands, times: FloatArray, amplitudes: FloatArray) -> float:
    """Largest V over all bands, on a grid eight times as dense as the design's and at its maxima."""
    largest = 0.0
    for band in demands.bands:
        omegas, zetas = band.samples(float(times[-1]), refinement=8)
        for zeta in zetas.tolist():
            v = np.abs(waves(pole(omegas, zeta), times) @ amplitudes)
            largest = max(largest, float(v.max()))
        largest = max([largest, *peaks(band, times, amplitudes, 0.0)[1].tolist()])
    return largest


def keeps(bounds: Bounds, times: FloatArray, amplitudes: FloatArray, slack: float = 1e-10) -> bool:
    """Whether impulses are what they may be, but for rounding."""
    sums = np.cumsum(amplitudes)
    return bool(
        abs(sums[-1] - 1.0) <= slack
        and (np.diff(times) > 0.0).all()
        and np.abs(amplitudes).max() <= bounds.max_amplitude + slack
        and np.abs(amplitudes).sum() <= bounds.max_sum_abs_amplitude + slack
        and sums.min() >= bounds.min_running_sum - slack
        and sums.max() <= bounds.max_running_sum + slack
        and (not bounds.positive or amplitudes.min() >= 0.0)
    )


def pole_of(omega: float, zeta: float) -> complex:
    """`pole` of one mode."""
    return omega * complex(zeta, sqrt(1.0 - zeta * zeta))
