"""Zero-vibration shapers of one mode: ZV and its derivatives."""

from __future__ import annotations

from math import comb, exp, pi

import numpy as np

from cnc_shape.arrays import frozen
from cnc_shape.modes import Mode
from cnc_shape.shapers.shaper import Shaper


def zero_vibration(mode: Mode, derivatives: int) -> Shaper:
    """ZV convolved with itself: V and its first `derivatives` derivatives vanish at the mode.

    With ``K = exp(-pi zeta / sqrt(1 - zeta^2))`` and n = derivatives + 1, impulse i of 0...n has amplitude
    ``binomial(n, i) K^i / (1 + K)^n`` at ``i T_d / 2`` (paper 000, eqs 2-3).
    """
    n = derivatives + 1
    decay = exp(-pi * mode.damping_ratio * mode.omega / mode.omega_damped)
    i = np.arange(n + 1)
    weights = np.array([comb(n, k) for k in range(n + 1)]) * decay**i / (1.0 + decay) ** n
    return Shaper(times=frozen(0.5 * mode.damped_period * i), amplitudes=frozen(weights))


def zv(mode: Mode) -> Shaper:
    """Zero vibration: two impulses, half a damped period apart."""
    return zero_vibration(mode, 0)


def zvd(mode: Mode) -> Shaper:
    """Zero vibration and derivative: three impulses over one damped period."""
    return zero_vibration(mode, 1)
