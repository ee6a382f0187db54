"""What paper 001 designs: the shaper of a 1 Hz mode and a virtual one, and what follows from it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.modes import Mode
from cnc_shape.shapers import Shaper, multi_mode, virtual_mode
from cnc_shape.shapers.insensitivity import Insensitivity, insensitivity
from cnc_shape.shapers.measures import step_response

REAL = Mode(natural_frequency=1.0, damping_ratio=0.0)  # the paper's example: one period is one second
FREE = 1e3  # -, bound of the amplitudes where the paper has none
SLOW, FAST = Mode(30.0, 0.0), Mode(100.0, 0.0)  # the stage of papers 000 and 001, undamped


def with_virtual(ratio: float) -> Shaper:
    """Shaper for the virtual frequency f* = fv / fs."""
    return virtual_mode(REAL, virtual_frequency=ratio * REAL.natural_frequency)


def frequency_ratio(shaper: Shaper) -> float:
    """f* of a shaper whose impulses are equally spaced: eq 6 turned round."""
    return 1.0 / (REAL.natural_frequency * float(shaper.times[1])) - 1.0


@cache
def two_modes(ratio: float) -> Shaper:
    """Shortest three impulses for `REAL` and a mode `ratio` as fast, found by search, not by formula."""
    other = Mode(ratio * REAL.natural_frequency, 0.0)
    return multi_mode([REAL, other], max_amplitude=FREE)


def band(ratio: float) -> Insensitivity:
    """Where the vibration left is 5 % at most, for f*."""
    return insensitivity(with_virtual(ratio), [REAL])


def width(ratio: float) -> float:
    """Full width of `band`, over the modelled frequency."""
    found = band(ratio)
    return (found.high or np.inf) - found.low


def largest_difference(one: Shaper, other: Shaper) -> float:
    """Largest difference of times, in periods of `REAL`, and amplitudes; impulses of nothing left out."""
    some = np.abs(one.amplitudes) > 1e-12
    times, amplitudes = one.times[some], one.amplitudes[some]
    if times.size != other.times.size:
        return float("inf")
    late = np.abs(times - other.times).max() * REAL.natural_frequency
    return float(max(late, np.abs(amplitudes - other.amplitudes).max()))


def equation_error(shaper: Shaper, modes: Sequence[Mode]) -> float:
    """Norm of eq A7: how far the sum is from 1, and ``sum A_i e^{s t_i}`` from 0 at every mode."""
    values = [complex(shaper.amplitudes.sum() - 1.0)]
    for mode in modes:
        s = complex(mode.damping_ratio * mode.omega, mode.omega_damped)
        values.append(complex(np.exp(s * shaper.times) @ shaper.amplitudes))
    return float(np.linalg.norm(values))


def response(shaper: Shaper, time: FloatArray) -> FloatArray:
    """Position of the 1 Hz system after a step of 1 through the shaper."""
    return step_response(shaper, [REAL], time)


def overshoot(shaper: Shaper) -> float:
    """How far the step response goes beyond 1."""
    return float(response(shaper, np.linspace(0.0, 3.0, 6001)).max() - 1.0)


def ripple(shaper: Shaper) -> float:
    """Largest distance from 1 after the last impulse."""
    after = shaper.duration + np.linspace(0.0, 1.0, 1001)
    return float(np.abs(response(shaper, after) - 1.0).max())


def rise_time(shaper: Shaper) -> float:
    """Time from 10 % to 90 % of the step response, s."""
    time = np.linspace(0.0, max(shaper.duration, 0.5), 20001)
    position = response(shaper, time)
    low, high = (float(time[int(np.argmax(position >= level))]) for level in (0.1, 0.9))
    return high - low


def crossing(level: float) -> float:
    """f* at which the width of the 5 % band has fallen to `level`, by halving."""
    low, high = 3.0, 100.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if width(middle) > level else (low, middle)
    return 0.5 * (low + high)
