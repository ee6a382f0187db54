"""Modified ZV: equal steps shorter than half a period, zeros spread over the frequencies above the mode."""

from __future__ import annotations

from math import isfinite, pi

import numpy as np

from cnc_shape.errors import OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers.damped import from_impulse_vectors
from cnc_shape.shapers.shaper import Shaper

MOST_IMPULSES = 20


def mzv(mode: Mode, *, impulses: int = 3, duration_periods: float = 0.75) -> Shaper:
    """Modified zero vibration: n impulses in equal steps, V zero at n - 1 frequencies.

    The zeros lie at ``1 + i / tau`` of the mode's frequency, ``i = 0 ... n-2``, with
    ``tau = t (n - 2) / (n - 2 t - 1)``: symmetric about the middle of the sequence's own period, hence real
    amplitudes. Damping scales impulse i by ``exp(-zeta theta_i / sqrt(1 - zeta^2))``.

    Parameters
    ----------
    mode
        The vibration to cancel: the lowest of the zeros.
    impulses
        n, at least 3.
    duration_periods
        t, damped periods from the first impulse to the last, below n - 1. At t = (n - 1) / 2 all zeros
        meet, and the shaper is ZV with n - 2 derivatives.

    Raises
    ------
    OptionError
        Fewer than 3 or more than 20 impulses; a duration that is not positive or not below n - 1.
    """
    if not 3 <= impulses <= MOST_IMPULSES:
        raise OptionError(
            f"mzv is made of 3 to {MOST_IMPULSES} impulses, not {impulses}",
            hint="zv is the one of 2 impulses",
            argument="impulses",
        )
    if not (isfinite(duration_periods) and 0.0 < duration_periods < impulses - 1):
        raise OptionError(
            f"mzv of {impulses} impulses lasts more than 0 and less than {impulses - 1} damped periods, "
            f"not {duration_periods:g}",
            hint="0.75 is the usual one of 3 impulses",
            argument="duration_periods",
        )
    step = duration_periods / (impulses - 1)
    zeros = np.linspace(1.0, 1.0 / step - 1.0, impulses - 1)
    magnitudes = np.poly(np.exp(2j * pi * step * zeros)).real
    return from_impulse_vectors(mode, 2.0 * pi * step * np.arange(impulses), magnitudes)
