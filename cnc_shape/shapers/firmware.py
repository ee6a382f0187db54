"""Shapers as firmwares compute them: the same names, curve fits and short cuts, and so the same impulses.

Klipper and Marlin take an undamped EI shaper and multiply impulse i by ``K^i``; RepRapFirmware (Duet) and
newer Klippers evaluate polynomials that were fitted to the exact solutions. Off zero damping neither keeps
the tolerance exactly: `cnc_shape.shapers.extra_insensitive` does.

References
----------
T. Singh and W. Singhose, "Tutorial on input shaping/time delay control of maneuvering flexible structures",
Proc. American Control Conference 2002, pp. 1717-1731: the fits of the 5 % shapers.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.errors import InfeasibleError
from cnc_shape.modes import Mode
from cnc_shape.shapers.damped import from_impulse_vectors
from cnc_shape.shapers.extra_insensitive import ei, three_hump_ei, two_hump_ei
from cnc_shape.shapers.shaper import Shaper

# Rows of rising powers of the damping ratio: amplitudes of all impulses but the last, times (in undamped
# periods) of all but the first. They fit the exact shapers to 0.002 for damping ratios up to 0.2.
_TWO_HUMPS = (
    ((0.16054, 0.76699, 2.26560, -1.22750), (0.33911, 0.45081, -2.58080, 1.73650),
     (0.34089, -0.61533, -0.68765, 0.42261)),
    ((0.49890, 0.16270, -0.54262, 6.16180), (0.99748, 0.18382, -1.58270, 8.17120),
     (1.49920, -0.09297, -0.28338, 1.85710)),
)  # fmt: skip
_THREE_HUMPS = (
    ((0.11275, 0.76632, 3.29160, -1.44380), (0.23698, 0.61164, -2.57850, 4.85220),
     (0.30008, -0.19062, -2.14560, 0.13744), (0.23775, -0.73297, 0.46885, -2.08650)),
    ((0.49974, 0.23834, 0.44559, 12.4720), (0.99849, 0.29808, -2.36460, 23.3990),
     (1.49870, 0.10306, -2.01390, 17.0320), (1.99960, -0.28231, -0.61536, 5.40450)),
)  # fmt: skip

Fit = tuple[tuple[tuple[float, ...], ...], tuple[tuple[float, ...], ...]]


def klipper_ei(mode: Mode, *, vibration_tolerance: float = 0.05) -> Shaper:
    """EI as Klipper and Marlin scale it with damping."""
    return _scaled(ei, mode, vibration_tolerance)


def klipper_2hump_ei(mode: Mode, *, vibration_tolerance: float = 0.05) -> Shaper:
    """Two-hump EI as Klipper and Marlin scale it with damping."""
    return _scaled(two_hump_ei, mode, vibration_tolerance)


def klipper_3hump_ei(mode: Mode, *, vibration_tolerance: float = 0.05) -> Shaper:
    """Three-hump EI as Klipper and Marlin scale it with damping."""
    return _scaled(three_hump_ei, mode, vibration_tolerance)


def fitted_ei(mode: Mode, *, vibration_tolerance: float = 0.05) -> Shaper:
    """EI by the published fit to damping ratio and tolerance, as newer Klippers have it.

    Raises
    ------
    InfeasibleError
        So much damping that the fit's impulses are out of order.
    """
    z, v = mode.damping_ratio, vibration_tolerance
    first = (0.24968 + 0.24961 * v) + (0.80008 + 1.23328 * v) * z + (0.49599 + 3.17316 * v) * z**2
    last = (0.25149 + 0.21474 * v) + (-0.83249 + 1.41498 * v) * z + (0.85181 - 4.90094 * v) * z**2
    middle = (
        0.4999
        + (0.46159 + 8.57843 * v) * v * z
        + (4.26169 - 108.644 * v) * v * z**2
        + (1.75601 + 336.989 * v) * v * z**3
    )
    return _in_order(
        mode, np.array([0.0, middle, 1.0]) * mode.damped_period, np.array([first, 1.0 - first - last, last])
    )


def duet_ei2(mode: Mode) -> Shaper:
    """Two-hump EI of 5 % by the published fit, as RepRapFirmware has it.

    Raises
    ------
    InfeasibleError
        So much damping that the fit's impulses are out of order.
    """
    return _fitted(mode, _TWO_HUMPS)


def duet_ei3(mode: Mode) -> Shaper:
    """Three-hump EI of 5 % by the published fit, as RepRapFirmware has it.

    Raises
    ------
    InfeasibleError
        So much damping that the fit's impulses are out of order.
    """
    return _fitted(mode, _THREE_HUMPS)


def _scaled(design: Callable[..., Shaper], mode: Mode, vibration_tolerance: float) -> Shaper:
    """The undamped shaper in half damped periods, impulse i times ``K^i``."""
    undamped = design(Mode(mode.natural_frequency, 0.0), vibration_tolerance=vibration_tolerance)
    return from_impulse_vectors(mode, pi * np.arange(undamped.times.size), undamped.amplitudes)


def _fitted(mode: Mode, fit: Fit) -> Shaper:
    powers = mode.damping_ratio ** np.arange(4)
    amplitudes, times = (np.array(rows) @ powers for rows in fit)
    return _in_order(
        mode,
        np.append(0.0, times) / mode.natural_frequency,
        np.concatenate([amplitudes, [1.0 - amplitudes.sum()]], dtype=np.float64),
    )


def _in_order(mode: Mode, times: FloatArray, amplitudes: FloatArray) -> Shaper:
    """The shaper of a fit, refused where it is so far out of its range that impulses change places."""
    if (np.diff(times) <= 0.0).any():
        raise InfeasibleError(
            f"the published fit is for damping ratios up to 0.2: at {mode.damping_ratio:g} its impulses are "
            "out of order",
            hint="use ei, 2hump_ei or 3hump_ei, which are exact",
        )
    return Shaper(times=frozen(times), amplitudes=frozen(amplitudes))
