"""Unity-magnitude zero vibration: full steps forward, back, forward; the fastest that a relay can do."""

from __future__ import annotations

from math import ceil, pi

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.errors import InfeasibleError
from cnc_shape.modes import Mode
from cnc_shape.shapers.shaper import Shaper

MOST_DAMPING = 0.95  # -, beyond it the last two impulses are one within rounding
CONTINUATION_STEP = 0.05  # -, of the ratio of decay to frequency
NEWTON_STEPS = 50
CONVERGED = 4e-16  # rad, a step of this size is rounding


def umzv(mode: Mode) -> Shaper:
    """Unity-magnitude zero vibration: amplitudes 1, -1, 1; one third of a period long where undamped.

    The angles solve ``1 - e^{s t2} + e^{s t3} = 0``: Newton's method from the undamped 60 and 120 degrees,
    with the damping raised in steps.

    Raises
    ------
    InfeasibleError
        A damping ratio above 0.95.
    """
    if mode.damping_ratio > MOST_DAMPING:
        raise InfeasibleError(
            f"there is no unity-magnitude shaper of a mode with damping {mode.damping_ratio:g}",
            hint="a mode that is damped so well needs no shaper; zv exists for every damping",
        )
    decay = mode.damping_ratio * mode.omega / mode.omega_damped  # of a radian
    angles = np.array([pi / 3.0, 2.0 * pi / 3.0])
    for rate in np.linspace(0.0, decay, ceil(decay / CONTINUATION_STEP) + 1)[1:]:
        angles = _solve(angles, complex(rate, 1.0))
    times = np.concatenate([[0.0], angles / mode.omega_damped])
    return Shaper(times=frozen(times), amplitudes=frozen([1.0, -1.0, 1.0]))


def _solve(angles: FloatArray, rate: complex) -> FloatArray:
    """Newton's method for ``1 - e^{rate a} + e^{rate b} = 0``."""
    for _ in range(NEWTON_STEPS):
        signed = np.array([-1.0, 1.0]) * np.exp(rate * angles)
        value, slopes = 1.0 + signed.sum(), rate * signed
        step = np.linalg.solve(np.stack([slopes.real, slopes.imag]), np.stack([value.real, value.imag]))
        angles = angles - step
        if np.abs(step).max() <= CONVERGED:
            break
    return angles
