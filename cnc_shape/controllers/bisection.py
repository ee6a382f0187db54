"""Bisection: how far a gain may go before a loop is no longer stable."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

GAIN_RESOLUTION = 1e-5  # -, of the largest stable gain that is told
GROWTH = 1.5  # -, of the gain from one look to the next, upwards
MOST_GROWTH = 1e6  # -, beyond which a gain has no end; its inverse is as good as none


def largest_factor(stable: Callable[[float], bool]) -> float:
    """Largest factor with which a loop that is stable at 0 is stable, from 1 upwards or below 1."""
    low, high = 0.0, 1.0
    while stable(high):
        low, high = high, GROWTH * high
        if high > MOST_GROWTH:
            return np.inf
    return last_stable(stable, low, high)


def last_stable(stable: Callable[[float], bool], inside: float, outside: float) -> float:
    """Last factor with which a loop is stable, from one with which it is towards one with which it is not."""
    while abs(outside - inside) > GAIN_RESOLUTION * max(outside, inside) > GAIN_RESOLUTION / MOST_GROWTH:
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if stable(middle) else (inside, middle)
    return inside
