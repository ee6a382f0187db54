"""A motion along one axis with acceleration in steps, and the exact response of a mode to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.modes import Mode
from cnc_shape.shapers import NONE, Shaper
from cnc_shape.shapers.measures import step_response


@dataclass(frozen=True, eq=False, slots=True)
class StraightMotion:
    """Acceleration that changes by `changes` at `times`."""

    times: FloatArray  # (k,) s
    changes: FloatArray  # (k,) mm/s^2, sum 0

    @property
    def end(self) -> float:
        """Time of the last change, s."""
        return float(self.times.max())

    def shaped(self, shaper: Shaper) -> StraightMotion:
        """The motion through a shaper."""
        times = np.add.outer(self.times, shaper.times).ravel()
        return StraightMotion(frozen(times), frozen(np.outer(self.changes, shaper.amplitudes).ravel()))

    def acceleration(self, time: FloatArray) -> FloatArray:
        """Acceleration, mm/s^2."""
        return (time[:, None] >= self.times) @ self.changes

    def velocity(self, time: FloatArray) -> FloatArray:
        """Velocity, mm/s."""
        return np.maximum(time[:, None] - self.times, 0.0) @ self.changes

    def position(self, time: FloatArray) -> FloatArray:
        """Distance covered, mm."""
        return 0.5 * np.maximum(time[:, None] - self.times, 0.0) ** 2 @ self.changes

    def deflection(self, modes: Sequence[Mode], time: FloatArray) -> FloatArray:
        """Deflection of the tool, mm, exactly.

        Every mode obeys ``y'' + 2 zeta omega y' + omega^2 y = -g a``, g its participation.
        """
        found = np.zeros(time.size)
        for mode in modes:
            give = mode.participation / mode.omega**2
            for at, change in zip(self.times.tolist(), self.changes.tolist(), strict=True):
                found -= give * change * step_response(NONE, [mode], time - at)
        return found

    def ring(self, mode: Mode) -> float:
        """Amplitude, mm, with which the mode swings once the motion has ended, at that very time."""
        s = mode.omega * complex(mode.damping_ratio, sqrt(1.0 - mode.damping_ratio**2))
        left = abs(complex(np.exp(s * (self.times - self.end) + 0j) @ self.changes))
        return mode.participation * left / (mode.omega * mode.omega_damped)


def move(distance: float, speed: float, acceleration: float, start: float = 0.0) -> StraightMotion:
    """From rest to rest in a trapezoid of velocity; a triangle where the speed is not reached.

    Parameters
    ----------
    distance
        mm, signed.
    speed, acceleration
        mm/s and mm/s^2, the most of them.
    start
        s.
    """
    top = min(speed, sqrt(abs(distance) * acceleration))
    ramp = top / acceleration
    cruise = abs(distance) / top - ramp
    times = start + np.array([0.0, ramp, ramp + cruise, 2.0 * ramp + cruise])
    signed = np.copysign(acceleration, distance)
    return StraightMotion(frozen(times), frozen(signed * np.array([1.0, -1.0, -1.0, 1.0])))


def joined(parts: Sequence[StraightMotion]) -> StraightMotion:
    """Several motions, which may overlap, as one."""
    return StraightMotion(
        frozen(np.concatenate([part.times for part in parts])),
        frozen(np.concatenate([part.changes for part in parts])),
    )


def settled(values: FloatArray, time: FloatArray, tolerance: float) -> float:
    """First time, s, from which on `values` stay within `tolerance`; the last time if they never do."""
    outside = np.flatnonzero(np.abs(values) > tolerance)
    if outside.size == 0:
        return float(time[0])
    return float(time[min(int(outside[-1]) + 1, time.size - 1)])
