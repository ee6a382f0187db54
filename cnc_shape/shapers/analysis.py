"""What a shaper does to a vibration, to a wrong model, and to a curve."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil
from typing import cast

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.errors import OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers.shaper import Shaper

DEFAULT_VIBRATION_TOLERANCE = 0.05  # -, the 5 % of the papers
LARGEST_FREQUENCY_RATIO = 6.0  # -, beyond it an interval of insensitivity counts as open
SCAN_STEP = 1e-3  # -, first look for the ends of an interval of insensitivity


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


@dataclass(frozen=True, slots=True)
class Insensitivity:
    """How far a machine's frequencies may be off: the connected interval around 1 where V stays small."""

    tolerance: float  # -, V at the ends
    low: float  # -, actual over modelled frequency
    high: float | None  # -, None: no end below 6

    @property
    def width(self) -> float | None:
        """``high - low``."""
        return None if self.high is None else self.high - self.low

    @property
    def margin(self) -> float:
        """Distance of the nearer end from 1."""
        below = 1.0 - self.low
        return below if self.high is None else min(below, self.high - 1.0)


def insensitivity(
    shaper: Shaper, modes: Sequence[Mode], tolerance: float = DEFAULT_VIBRATION_TOLERANCE
) -> Insensitivity:
    """Connected interval of actual/modelled frequency with ``V <= tolerance`` at every mode.

    All modes move together. An interval that does not hold 1 itself (V above the tolerance at the
    design point) has no width.

    Raises
    ------
    OptionError
        Tolerance outside (0, 1).
    """
    if not 0.0 < tolerance < 1.0:
        raise OptionError(
            f"a vibration tolerance must lie between 0 and 1, not {tolerance}", hint="5 % is 0.05"
        )

    def excess(ratio: FloatArray | float) -> FloatArray:
        worst = np.stack([residual_vibration(shaper, mode, ratio) for mode in modes]).max(axis=0)
        return worst - tolerance

    if float(excess(1.0)) > 0.0:
        return Insensitivity(tolerance, 1.0, 1.0)
    return Insensitivity(
        tolerance,
        _end(excess, np.linspace(1.0, 0.0, ceil(1.0 / SCAN_STEP) + 1)) or 0.0,
        _end(excess, np.linspace(1.0, LARGEST_FREQUENCY_RATIO, ceil(5.0 / SCAN_STEP) + 1)),
    )


def _end(excess: Callable[[FloatArray | float], FloatArray], ratios: FloatArray) -> float | None:
    """First crossing of `excess` from below along `ratios`, refined by Brent's method."""
    from scipy.optimize import brentq  # pyright: ignore[reportUnknownVariableType]  # scipy ships no types

    outside = np.flatnonzero(excess(ratios) > 0.0)
    if outside.size == 0:
        return None
    first = int(outside[0])
    bracket = (float(ratios[first - 1]), float(ratios[first]))
    find = cast("Callable[..., float]", brentq)
    return find(excess, *bracket, xtol=1e-13, rtol=1e-13)


def contour_factor(shaper: Shaper, modes: Sequence[Mode]) -> float | None:
    """Tool error on a curve over the unshaped one: ``kappa = 1 - sigma^2 / (2 sum_k g_k / omega_k^2)``.

    The shaper pulls a curve inward by half its variance times the acceleration, the structure pushes the
    tool outward by ``sum g/omega^2`` times it; kappa is what is left, as a share of the latter. A structure
    that does not push (no modes, or shares that cancel) has none.
    """
    compliance = sum(mode.participation / mode.omega**2 for mode in modes)
    return 1.0 - shaper.variance / (2.0 * compliance) if compliance != 0.0 else None
