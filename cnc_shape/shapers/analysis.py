"""What a shaper does to a vibration, to a wrong model, and to a curve."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.modes import Mode
from cnc_shape.shapers.shaper import Shaper


def phasor(shaper: Shaper, omega: FloatArray | float, damping_ratio: float) -> FloatArray:
    """``|sum A_i e^{s t_i}|`` with ``s = omega (zeta + j sqrt(1 - zeta^2))``.

    This is the shaped vibration over the unshaped one at the same instant (paper 000, eq 1, without
    the decay factor). `omega` is undamped, rad/s, any shape.
    """
    s = np.asarray(omega, dtype=np.float64) * complex(damping_ratio, np.sqrt(1.0 - damping_ratio**2))
    return np.abs(np.exp(np.multiply.outer(s, shaper.times)) @ shaper.amplitudes)


def residual_vibration(shaper: Shaper, mode: Mode, frequency_ratio: FloatArray | float = 1.0) -> FloatArray:
    """Residual vibration V of a mode after the last impulse, over that of one impulse at that time.

    ``V = |sum A_i e^{s t_i - zeta omega t_N}|`` (paper 000, eq 1; paper 002, eqs 7-8), evaluated so that it
    cannot overflow. `frequency_ratio` is actual over modelled frequency: the shaper stays as designed.
    """
    omega = mode.omega * np.asarray(frequency_ratio, dtype=np.float64)
    return vibration(shaper, omega, mode.damping_ratio)


def vibration(shaper: Shaper, omega: FloatArray | float, damping_ratio: FloatArray | float) -> FloatArray:
    """V of an oscillator of undamped angular frequency `omega`, rad/s, whatever the shaper was made for.

    `omega` and `damping_ratio` may be of any shapes that broadcast: on a grid of both V is the surface of
    paper 000, Fig. 4.
    """
    w, zeta = np.asarray(omega, dtype=np.float64)[..., None], np.asarray(damping_ratio)[..., None]
    s = w * (zeta * (shaper.times - shaper.duration) + 1j * np.sqrt(1.0 - zeta**2) * shaper.times)
    return np.abs(np.exp(s) @ shaper.amplitudes)


def contour_factor(shaper: Shaper, modes: Sequence[Mode]) -> float | None:
    """Tool error on a curve over the unshaped one: ``kappa = 1 - sigma^2 / (2 sum_k g_k / omega_k^2)``.

    The shaper pulls a curve inward by half its variance times the acceleration, the structure pushes the
    tool outward by ``sum g/omega^2`` times it; kappa is what is left, as a share of the latter. A structure
    that does not push (no modes, or shares that cancel) has none.
    """
    compliance = sum(mode.participation / mode.omega**2 for mode in modes)
    return 1.0 - shaper.variance / (2.0 * compliance) if compliance != 0.0 else None
