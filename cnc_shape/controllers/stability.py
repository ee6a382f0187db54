"""Stability, told before anything is simulated."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.controllers.control import Control
from cnc_shape.errors import InfeasibleError
from cnc_shape.machine import Axis, FirstOrderLag
from cnc_shape.plant import discretise

GAIN_RESOLUTION = 1e-3  # -, of the largest stable gain that is told


def loop_poles(axis: Axis, sample_time: float, gain: float, delay_samples: int) -> FloatArray:
    """Poles in z of a lag drive under proportional position control.

    The modes do not act back on the drive, so they take no part. The delayed inputs are states.
    """
    rigid = Axis(axis.name, axis.limits, axis.drive)
    plant = discretise([rigid], sample_time)
    A, B = plant.transition[0], plant.held[0]
    n = 2 + delay_samples
    loop = np.zeros((n, n))
    loop[:2, :2] = A
    feedback = np.zeros(n)
    feedback[0] = -gain
    if delay_samples == 0:
        loop[:2] += np.outer(B, feedback)
    else:
        loop[:2, 2] = B  # the oldest input acts
        for k in range(delay_samples - 1):
            loop[2 + k, 3 + k] = 1.0
        loop[-1] = feedback
    return np.abs(np.linalg.eigvals(loop))


def check_stability(axes: Sequence[Axis], control: Control) -> None:
    """Refuse a loop that would oscillate without end.

    Along the path every axis is held by the position gain, across it by position plus cross-coupling
    gain; each is held against the poles of each drive.

    Raises
    ------
    InfeasibleError
        Names the axis, the gain and the largest stable one.
    """
    across = control.cross_coupling.proportional if control.cross_coupling else 0.0
    for axis in axes:
        if not isinstance(axis.drive, FirstOrderLag):
            continue
        for gain, name in (
            (control.position_gain, "position gain"),
            (control.position_gain + across, "gain across the path"),
        ):
            if loop_poles(axis, control.sample_time, gain, control.delay_samples).max() < 1.0:
                continue
            largest = _largest_stable_gain(axis, control)
            raise InfeasibleError(
                f"the loop of axis {axis.name} is unstable: {name} {gain:g} 1/s, "
                f"stable below {largest:.4g} 1/s",
                hint="lower position_gain_per_s or cross_coupling.proportional_per_s, or sample faster",
            )


def _largest_stable_gain(axis: Axis, control: Control) -> float:
    low, high = 0.0, 10.0 / control.sample_time
    while high - low > GAIN_RESOLUTION * high:
        middle = 0.5 * (low + high)
        stable = loop_poles(axis, control.sample_time, middle, control.delay_samples).max() < 1.0
        low, high = (middle, high) if stable else (low, middle)
    return low
