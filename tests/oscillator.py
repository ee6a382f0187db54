"""What a vibration does, simulated step by step: shapers are judged by it and not by their own formulas."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp


def swing_after(shaper, frequency, damping_ratio):
    """Vibration that is left after the last impulse, over that of one impulse at that time.

    RK45 of ``y'' + 2 zeta omega y' + omega^2 y = sum of impulses``; 1 Hz is 2 pi rad/s undamped.
    """
    omega = 2.0 * np.pi * frequency
    state = np.zeros(2)
    for i, (time, amplitude) in enumerate(zip(shaper.times, shaper.amplitudes, strict=True)):
        state = state + np.array([0.0, amplitude])
        if i + 1 < shaper.times.size:
            state = solve_ivp(
                lambda _, y: [y[1], -2.0 * damping_ratio * omega * y[1] - omega**2 * y[0]],
                (time, shaper.times[i + 1]), state, rtol=1e-12, atol=1e-15,
            ).y[:, -1]  # fmt: skip
    omega_damped = omega * np.sqrt(1.0 - damping_ratio**2)
    return np.hypot(state[0] * omega_damped, state[1] + damping_ratio * omega * state[0])
