"""From an undamped design to a damped one, where the design is by angles.

In impulse vectors ``I_i = A_i e^{zeta omega t_i}`` at ``theta_i = omega_d t_i`` (paper 002, eq 1) the
condition of zero vibration, ``sum I_i e^{j theta_i} = 0``, knows no damping: one set of vectors serves all.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from cnc_shape.arrays import frozen
from cnc_shape.modes import Mode
from cnc_shape.shapers.shaper import Shaper


def from_impulse_vectors(mode: Mode, angles: ArrayLike, magnitudes: ArrayLike) -> Shaper:
    """Shaper of impulse vectors: ``t_i = theta_i / omega_d``, ``A_i ~ I_i e^{-zeta omega t_i}`` with sum 1.

    Parameters
    ----------
    mode
        The vibration the vectors cancel.
    angles
        (k,) rad, theta_i, increasing from 0.
    magnitudes
        (k,) -, I_i, signed; scaled so that the amplitudes add up to 1.
    """
    times = np.asarray(angles, dtype=np.float64) / mode.omega_damped
    amplitudes = np.asarray(magnitudes, dtype=np.float64) * np.exp(-mode.damping_ratio * mode.omega * times)
    return Shaper(times=frozen(times), amplitudes=frozen(amplitudes / amplitudes.sum()))
