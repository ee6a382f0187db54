"""The paper's own search: one amplitude in steps of 0.01, the rest from the conditions, the most robust wins.

Equations 5, 9 and 11 have one freedom left. The text steps A_1 by 0.01 for them, but A_2 for the closed form
of eq 6, and once speaks of "a given A_3"; so the amplitude that is stepped is an argument here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.experiments.specified_duration.equations import Equation
from cnc_shape.modes import Mode
from cnc_shape.shapers.insensitivity import DEFAULT_VIBRATION_TOLERANCE, bands
from cnc_shape.shapers.sd_family import Family, family
from cnc_shape.shapers.shaper import Shaper

STEP = 0.01  # of the amplitude, as in the paper
SHARES = np.linspace(0.0, 1.0, 602)[1:-1]  # of lambda, between which a step is looked for
HALVINGS = 46
KEPT = 1e-9  # relative: a bound is kept to rounding


@dataclass(frozen=True, eq=False, slots=True)
class Found:
    """What the search ends with."""

    shaper: Shaper
    width: float  # -, I_0.05
    offered: int  # how many shapers it had to choose from


def search(equation: Equation, impulse: int = 0) -> Found:
    """Step the amplitude of `impulse` (0 is the first) by 0.01; keep the largest I_0.05."""
    assert equation.periods is not None
    vectors, mode = family(equation.periods), equation.mode
    top = equation.largest if equation.largest < np.inf else 1.0 - STEP
    levels = STEP * np.arange(1, round(top / STEP) + 1, dtype=np.float64)
    shares = _shares_at(vectors, mode, impulse, levels)
    times, amplitudes = impulses(vectors, mode, shares)
    kept = (np.abs(amplitudes).max(axis=1) <= equation.largest * (1.0 + KEPT)) & (
        np.diff(times, axis=1).min(axis=1) >= equation.gap
    )
    times, amplitudes = times[kept], amplitudes[kept]
    low, high = bands(times, amplitudes, [mode], DEFAULT_VIBRATION_TOLERANCE)
    best = int((high - low).argmax())
    shaper = Shaper(times=frozen(times[best]), amplitudes=frozen(amplitudes[best]))
    return Found(shaper, float(high[best] - low[best]), len(times))


def impulses(vectors: Family, mode: Mode, shares: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Impulse vectors as impulses (eq 1): times (m,N) s and amplitudes (m,N), sum 1."""
    angles, magnitudes = vectors(shares)
    times = angles / mode.omega_damped
    amplitudes = magnitudes * np.exp(-mode.damping_ratio * mode.omega * times)
    return times, amplitudes / amplitudes.sum(axis=1, keepdims=True)


def _shares_at(vectors: Family, mode: Mode, impulse: int, levels: FloatArray) -> FloatArray:
    """Every lambda whose `impulse` has one of the amplitudes `levels`, by halving."""
    value = impulses(vectors, mode, SHARES)[1][:, impulse]
    above = value[:, None] > levels
    known = np.isfinite(value[:-1]) & np.isfinite(value[1:])
    row, level = np.nonzero((above[:-1] != above[1:]) & known[:, None])
    low, high, start = SHARES[row], SHARES[row + 1], above[row, level]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        same = (impulses(vectors, mode, middle)[1][:, impulse] > levels[level]) == start
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return low
