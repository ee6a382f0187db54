"""Disturbances: what acts on a machine that nobody has commanded."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias


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
