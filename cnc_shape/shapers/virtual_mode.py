"""Virtual mode: three impulses that also cancel a mode that is not there, so as to be short (paper 001)."""

from __future__ import annotations

from math import acos, cos, isfinite, pi

from cnc_shape.arrays import frozen
from cnc_shape.errors import InfeasibleError, OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers.shaper import Shaper

LEAST_OUTER_AMPLITUDE = 0.25  # -, half a period apart
LARGEST_AMPLITUDE = 1e6  # -, of impulses that cancel each other to 1


def virtual_mode(
    mode: Mode,
    *,
    virtual_frequency: float | None = None,
    duration: float | None = None,
    duration_periods: float | None = None,
    max_amplitude: float | None = None,
) -> Shaper:
    """Three impulses that cancel an undamped mode and a virtual one: the higher the virtual, the shorter.

    With ``phi = 2 pi f / (f + fv)`` the impulses are ``1 / (2 (1 - cos phi))`` at 0 and at ``2 / (f + fv)``,
    and ``-cos phi / (1 - cos phi)`` half-way (paper 001). Give one of the four: virtual frequency, duration,
    or the amplitude A of the outer impulses.

    A bounds what a *step* asks of the actuator: the shaped step goes to A, to 1 - A and to 1. Above 1 it
    overshoots. Other commands may ask ``4 A - 1`` times as much as unshaped where the middle impulse is
    negative, and an actuator that saturates on them brings the vibration back.

    Parameters
    ----------
    mode
        The vibration to cancel; undamped.
    virtual_frequency
        fv, Hz. Equal to that of the mode it makes ZVD, three times as high ZV, five times UMZV.
    duration
        Time of the last impulse, s.
    duration_periods
        The same in periods of the mode.
    max_amplitude
        A, at least 1/4: the highest step that the actuator can do, over the commanded one.

    Raises
    ------
    OptionError
        A damped mode; none or several of the four; a value that is not positive and finite.
    InfeasibleError
        Two periods or longer, so short that the impulses nearly cancel each other, or A below 1/4.
    """
    if mode.damping_ratio > 0.0:
        raise OptionError(
            f"virtual_mode is for an undamped mode, not for damping {mode.damping_ratio:g}",
            hint="sd of the same duration is exact with damping: its family holds this shaper",
        )
    given = {
        "virtual_frequency": virtual_frequency,
        "duration": duration,
        "duration_periods": duration_periods,
        "max_amplitude": max_amplitude,
    }
    chosen = {name: value for name, value in given.items() if value is not None}
    if len(chosen) != 1:
        raise OptionError(
            f"virtual_mode takes one of virtual frequency, duration and largest amplitude, not {len(chosen)}",
            hint="the virtual frequency is 3 times that of the mode for ZV, 5 times for UMZV, or any other",
        )
    ((name, value),) = chosen.items()
    if not (isfinite(value) and value > 0.0):
        words = name.replace("_", " ")
        raise OptionError(
            f"the {words} must be positive and finite, not {value:g}", hint="check its unit", argument=name
        )
    frequency = mode.natural_frequency
    if virtual_frequency is not None:
        angle = 2.0 * pi * frequency / (frequency + virtual_frequency)
    elif duration is not None:
        angle = pi * duration * frequency
    elif duration_periods is not None:
        angle = pi * duration_periods
    elif value >= LEAST_OUTER_AMPLITUDE:
        angle = acos(1.0 - 0.5 / value)
    else:
        raise InfeasibleError(
            f"the outer impulses of virtual_mode are {LEAST_OUTER_AMPLITUDE:g} high at least, not {value:g}",
            hint="that is ZVD; the shorter, the higher",
            argument=name,
        )
    if not 0.0 < angle < 2.0 * pi:
        raise InfeasibleError(
            f"virtual_mode lasts less than two periods of the mode, not {angle / pi:.4g}",
            hint="the virtual frequency is what shortens it: it is above 0",
            argument=name,
        )
    outer = 0.5 / (1.0 - cos(angle)) if cos(angle) < 1.0 else float("inf")
    if outer > LARGEST_AMPLITUDE:
        raise InfeasibleError(
            f"the impulses would be {outer:.3g} high and cancel each other to 1",
            hint="choose a virtual frequency nearer to that of the mode",
            argument=name,
        )
    half = angle / mode.omega
    return Shaper(times=frozen([0.0, half, 2.0 * half]), amplitudes=frozen([outer, 1.0 - 2.0 * outer, outer]))
