"""What the tool does at corners and on curves: command and deflection together, in closed form.

Everything is linear in what the axes do there, so the answers are ratios: contour error over an acceleration
(s^2) or over a speed (s). Both axes have the same shaper and the same modes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.modes import Mode
from cnc_shape.shapers.contour_compensation import curve_gain
from cnc_shape.shapers.shaper import Shaper

WATCHED = 3.0  # periods of the slowest mode, around the corner
SCAN = 200  # points in a period of the fastest mode
MOST_POINTS = 40_001  # of a scan: modes far apart are scanned more coarsely


@dataclass(frozen=True, slots=True)
class ToolErrors:
    """Contour error of the tool over what the axes do at a place."""

    curve: float  # s^2, gamma: outward error on a steady curve over its acceleration
    stop: float  # s^2, largest error at a right-angled corner with a stop over the axes' acceleration
    stop_half_dwell: float  # s^2, the same with a pause of half the shaper's duration
    corner_at_speed: float  # s, largest error at a right-angled corner without a stop over the speed


def tool_errors(shaper: Shaper, modes: Sequence[Mode]) -> ToolErrors:
    """Evaluate a shaper on an axis whose structure has `modes` between drive and tool."""
    return ToolErrors(
        curve=-curve_gain(shaper, modes),
        stop=_corner(shaper, modes, 0.0, at_speed=False),
        stop_half_dwell=_corner(shaper, modes, 0.5 * shaper.duration, at_speed=False),
        corner_at_speed=_corner(shaper, modes, 0.0, at_speed=True),
    )


def _corner(shaper: Shaper, modes: Sequence[Mode], dwell: float, *, at_speed: bool) -> float:
    """Largest distance to a right angle that one axis comes to and the other leaves `dwell` s later.

    The axis that comes brakes with acceleration 1 until it rests, or keeps its speed 1 until t = 0; the one
    that leaves does the same backwards in time.
    """
    periods = [mode.damped_period for mode in modes]
    reach = WATCHED * max(periods, default=0.0)
    points = (2.0 * reach + shaper.duration + dwell) / min(periods, default=1.0) * SCAN
    time = np.linspace(-reach, reach + shaper.duration + dwell, int(min(max(points, 1001), MOST_POINTS)))
    coming, leaving = (_coming_at_speed, _leaving_at_speed) if at_speed else (_braking, _starting)
    x, y = np.zeros(time.size), np.zeros(time.size)
    for amplitude, late in zip(shaper.amplitudes.tolist(), shaper.times.tolist(), strict=True):
        x += amplitude * coming(time - late, modes)
        y += amplitude * leaving(time - late - dwell, modes)
    inside = np.where(y > 0.0, np.minimum(-x, y), np.abs(y))
    distance = np.where(x < 0.0, inside, np.where(y >= 0.0, x, np.hypot(x, y)))
    return float(distance.max())


def _braking(time: FloatArray, modes: Sequence[Mode]) -> FloatArray:
    """An axis that brakes with acceleration 1 and rests from t = 0 on: the tool is ahead, then rings."""
    after = np.maximum(time, 0.0)
    return -0.5 * np.minimum(time, 0.0) ** 2 + sum(
        mode.participation / mode.omega**2 * np.where(time < 0.0, 1.0, _released(after, mode))
        for mode in modes
    )


def _starting(time: FloatArray, modes: Sequence[Mode]) -> FloatArray:
    """An axis that starts with acceleration 1 at t = 0; the tool stays behind."""
    after = np.maximum(time, 0.0)
    return 0.5 * after**2 - sum(
        mode.participation / mode.omega**2 * (1.0 - _released(after, mode)) for mode in modes
    )


def _coming_at_speed(time: FloatArray, modes: Sequence[Mode]) -> FloatArray:
    """An axis at speed 1 that stands still from t = 0 on."""
    return np.minimum(time, 0.0) + _struck(np.maximum(time, 0.0), modes)


def _leaving_at_speed(time: FloatArray, modes: Sequence[Mode]) -> FloatArray:
    """An axis at rest that has speed 1 from t = 0 on."""
    after = np.maximum(time, 0.0)
    return after - _struck(after, modes)


def _released(time: FloatArray, mode: Mode) -> FloatArray:
    """A mode let go at t = 0 from the deflection 1."""
    decay, wave = np.exp(-mode.damping_ratio * mode.omega * time), mode.omega_damped * time
    ratio = mode.damping_ratio * mode.omega / mode.omega_damped
    return decay * (np.cos(wave) + ratio * np.sin(wave))


def _struck(time: FloatArray, modes: Sequence[Mode]) -> FloatArray:
    """Deflection of the tool after a change of speed by 1, s."""
    swing = np.zeros(time.size)
    for mode in modes:
        decay = np.exp(-mode.damping_ratio * mode.omega * time)
        swing += mode.participation / mode.omega_damped * decay * np.sin(mode.omega_damped * time)
    return swing
