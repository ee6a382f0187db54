"""Gain limits: how far gains may go before a loop is no longer stable.

By bisection with the poles; by the frequency response at once where delays make too many of them.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.controllers.loop_model import LoopModel, joint_of, pole_radius, rows_of, with_coupling
from cnc_shape.controllers.margins import largest_factors

MOST_STATES = 120  # of a loop whose poles are computed
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


def stable_joint(model: LoopModel, joint: int, gain: float) -> bool:
    """Whether a joint by itself is stable under a position gain, 1/s."""
    return bool(reserve(joint_of(model, joint, 0.0), joint_of(model, joint, gain))[0] > 0.0)


def largest_gain(model: LoopModel, joint: int) -> float:
    """Largest position gain with which a joint is stable by itself, 1/s."""
    unit = 1.0 / model.sample_time
    whole = joint_of(model, joint, unit)
    if whole.states > MOST_STATES:
        return unit * float(largest_factors(joint_of(model, joint, 0.0), whole)[0])
    return unit * largest_factor(lambda factor: stable_joint(model, joint, unit * factor))


def reserve(base: LoopModel, whole: LoopModel) -> FloatArray:
    """What a loop has left before it is unstable, (n,): positive if stable, given that `base` is.

    By the poles; by the frequency response where delays make too many of them.
    """
    if whole.states <= MOST_STATES:
        return 1.0 - pole_radius(whole)
    return largest_factors(base, whole) - 1.0


def largest_coupling(model: LoopModel) -> float:
    """Factor by which the gains across the path may grow before any row becomes unstable."""
    if model.states > MOST_STATES:
        return float(largest_factors(with_coupling(model, 0.0), model).min(initial=np.inf))
    suspects = model

    def stable(factor: float) -> bool:
        nonlocal suspects
        unstable = np.flatnonzero(pole_radius(with_coupling(suspects, factor)) >= 1.0)
        if unstable.size:  # what is stable here is so below, and what ends the gain is among the rest
            suspects = rows_of(suspects, unstable)
        return not unstable.size

    return largest_factor(stable)


def first_unstable(model: LoopModel, factor: float) -> int:
    """Row that ends the gains across the path, given the factor by which they may grow."""
    if model.states > MOST_STATES:
        return int(largest_factors(with_coupling(model, 0.0), model).argmin())
    beyond = max((1.0 + 2.0 * GAIN_RESOLUTION) * factor, 1.0 / MOST_GROWTH)
    return int(pole_radius(with_coupling(model, beyond)).argmax())
