"""Disturbances: what acts on a machine that nobody has commanded."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import cache
from math import cos, pi, sin
from typing import TypeAlias

import numpy as np

from cnc_shape.arrays import FloatArray


class PathDirection(Enum):
    """A direction of the path where the command is."""

    NORMAL = "path_normal"  # away from the centre of curvature
    TANGENT = "path_tangent"  # where the command is going
    BINORMAL = "path_binormal"  # tangent x (direction to the centre)


Direction: TypeAlias = PathDirection | str  # of the path, or along the axis of that name


@dataclass(frozen=True, slots=True)
class SineBurst:
    """Some periods of a sine under a cosine-squared window: ``sin(2 pi f t) cos(pi t / length)^2``.

    t counts from `centre`, the burst is zero beyond half its length from there, and is scaled to a peak of 1
    (spec: inertia compensation, section 2, F3).
    """

    frequency: float  # Hz
    length: float  # s
    centre: float  # s, of the command


@dataclass(frozen=True, slots=True)
class Pulses:
    """Pulses one after another, their edges raised cosines (spec: section 2, F2)."""

    start: float  # s, when the first begins to rise
    rise: float  # s, from zero to the top, and as long back again
    hold: float  # s, at the top
    gap: float  # s, at zero between two of them
    peaks: tuple[float, ...]  # -, of the disturbance's peak, one a pulse


@dataclass(frozen=True, slots=True)
class Steps:
    """A level that holds from each time on until the next; zero before the first."""

    times: tuple[float, ...]  # s, increasing
    levels: tuple[float, ...]  # -, of the disturbance's peak


@dataclass(frozen=True, slots=True)
class ProfileTable:
    """Measured values, linear in between; zero before the first and after the last."""

    times: tuple[float, ...]  # s, increasing
    levels: tuple[float, ...]  # -, of the disturbance's peak


Profile: TypeAlias = SineBurst | Pulses | Steps | ProfileTable


@dataclass(frozen=True, slots=True)
class LoadTorque:
    """A torque that the motors have to hold, as a vector over the axes.

    Positive torque pushes the axes against the direction: to stay, the motors must make as much.
    """

    direction: Direction
    peak: float  # N m
    profile: Profile


@dataclass(frozen=True, slots=True)
class EncoderNoise:
    """Normally distributed noise on every reading of every encoder, before it is rounded to counts."""

    standard_deviation: float  # counts
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Disturbances:
    """All that disturbs a machine."""

    loads: tuple[LoadTorque, ...] = ()
    noise: EncoderNoise | None = None

    def __bool__(self) -> bool:
        return bool(self.loads) or self.noise is not None


UNDISTURBED = Disturbances()


def value(profile: Profile, t: FloatArray) -> FloatArray:
    """A profile at times `t` s of the command, any shape, as shares of its disturbance's peak.

    Every value depends on its own time alone, bit for bit.
    """
    match profile:
        case SineBurst():
            return _burst(profile, t)
        case Pulses():
            return _pulses(profile, t)
        case Steps():
            return np.array([0.0, *profile.levels])[np.searchsorted(profile.times, t, side="right")]
        case ProfileTable():
            return np.interp(t, profile.times, profile.levels, left=0.0, right=0.0)


@cache
def burst_peak(frequency: float, length: float) -> float:
    """Largest ``|sin(2 pi f t) cos(pi t / length)^2|``.

    The window falls from t = 0 on, so the peak lies before the sine's first crest, or within the window where
    that ends sooner. There the logarithm of the burst is concave: it has one stationary point, where
    ``w cos(w t) cos(p t)`` falls below ``2 p sin(w t) sin(p t)``, with w = 2 pi f and p = pi / length.
    """
    w, p = 2.0 * pi * frequency, pi / length
    low, high = 0.0, min(0.25 / frequency, 0.5 * length)
    while low < (t := 0.5 * (low + high)) < high:
        if w * cos(w * t) * cos(p * t) > 2.0 * p * sin(w * t) * sin(p * t):
            low = t
        else:
            high = t
    return sin(w * t) * cos(p * t) ** 2


def _burst(burst: SineBurst, t: FloatArray) -> FloatArray:
    late = t - burst.centre
    inside = np.abs(late) < 0.5 * burst.length
    window = np.cos(np.pi / burst.length * late) ** 2
    wave = np.sin(2.0 * np.pi * burst.frequency * late) / burst_peak(burst.frequency, burst.length)
    return np.where(inside, wave * window, 0.0)


def _pulses(pulses: Pulses, t: FloatArray) -> FloatArray:
    width = 2.0 * pulses.rise + pulses.hold
    late = t - pulses.start
    number = np.clip(np.floor(late / (width + pulses.gap)), 0, len(pulses.peaks) - 1).astype(np.int64)
    late = late - number * (width + pulses.gap)
    inside = (late >= 0.0) & (late < width)
    top = np.array(pulses.peaks)[number]
    if pulses.rise > 0.0:
        share = np.clip(np.minimum(late, width - late) / pulses.rise, 0.0, 1.0)
        top = top * (0.5 - 0.5 * np.cos(np.pi * share))
    return np.where(inside, top, 0.0)
