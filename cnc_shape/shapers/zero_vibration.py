"""Zero-vibration shapers of one mode: ZV and its derivatives, with impulses that are not negative."""

from __future__ import annotations

from math import comb, exp, pi

import numpy as np

from cnc_shape.arrays import frozen
from cnc_shape.errors import OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers.shaper import Shaper

MOST_DERIVATIVES = 20  # beyond, the impulses at the ends are less than the rounding of those in the middle


def zv(mode: Mode, *, derivatives: int = 0) -> Shaper:
    """Zero vibration: two impulses, half a damped period apart, convolved with itself for each derivative.

    V and its first `derivatives` derivatives with respect to frequency vanish at the mode. With
    ``K = exp(-pi zeta / sqrt(1 - zeta^2))`` and n = derivatives + 1, impulse i of 0...n has amplitude
    ``binomial(n, i) K^i / (1 + K)^n`` at ``i T_d / 2`` (paper 000, eqs 2-3).

    Parameters
    ----------
    mode
        The vibration to cancel.
    derivatives
        0 for ZV, 1 for ZVD, 2 for ZVDD, and on.

    Raises
    ------
    OptionError
        A number of derivatives below 0 or above 20.
    """
    if not 0 <= derivatives <= MOST_DERIVATIVES:
        raise OptionError(
            f"the derivatives that vanish must be 0 to {MOST_DERIVATIVES}, not {derivatives}",
            hint="0 is ZV, 1 is ZVD",
            argument="derivatives",
        )
    n = derivatives + 1
    decay = exp(-pi * mode.damping_ratio * mode.omega / mode.omega_damped)
    i = np.arange(n + 1)
    weights = np.array([comb(n, k) for k in range(n + 1)]) * decay**i / (1.0 + decay) ** n
    return Shaper(times=frozen(0.5 * mode.damped_period * i), amplitudes=frozen(weights))


def zvd(mode: Mode) -> Shaper:
    """Zero vibration and derivative: three impulses over one damped period (paper 000, eq 3)."""
    return zv(mode, derivatives=1)


def zvdd(mode: Mode) -> Shaper:
    """Zero vibration and two derivatives: four impulses over one and a half damped periods."""
    return zv(mode, derivatives=2)


def zvddd(mode: Mode) -> Shaper:
    """Zero vibration and three derivatives: five impulses over two damped periods."""
    return zv(mode, derivatives=3)
