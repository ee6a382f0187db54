"""Shaper: an impulse sequence, and what it does to a vibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.errors import OptionError

MOST_IMPULSES = 2048  # of shapers that are convolved
SUM_TOLERANCE = 1e-9  # -, how far from 1 the amplitudes a user gives may add up


@dataclass(frozen=True, eq=False, slots=True)
class Shaper:
    """Impulse sequence: shaped(t) = sum_i amplitudes[i] * command(t - times[i])."""

    times: FloatArray  # (k,) s, increasing from 0
    amplitudes: FloatArray  # (k,) -, sum 1

    @property
    def duration(self) -> float:
        """Time of the last impulse, s."""
        return float(self.times[-1])

    @property
    def delay(self) -> float:
        """Centroid of the impulses, ``sum A_i t_i``, s: how late the shaped command is on steady motion."""
        return float(self.amplitudes @ self.times)

    @property
    def variance(self) -> float:
        """Second moment of the impulses about their centroid, s^2: what bends curves inward."""
        return float(self.amplitudes @ (self.times - self.delay) ** 2)

    def summary(self) -> str:
        """Impulses and duration, in one line."""
        pairs = zip(self.times.tolist(), self.amplitudes.tolist(), strict=True)
        impulses = ", ".join(f"{amplitude:.4g} at {1e3 * time:.4g} ms" for time, amplitude in pairs)
        return f"{self.times.size} impulses over {1e3 * self.duration:.4g} ms: {impulses}"

    @property
    def sum_abs_amplitude(self) -> float:
        """``sum |A_i|``: the largest gain on velocity and acceleration of any command."""
        return float(np.abs(self.amplitudes).sum())

    @property
    def max_running_sum(self) -> float:
        """Largest ``|A_1 + ... + A_i|``: what a step asks of the actuator."""
        return float(np.abs(np.cumsum(self.amplitudes)).max())


NONE = Shaper(times=frozen([0.0]), amplitudes=frozen([1.0]))


def make_shaper(times: ArrayLike, amplitudes: ArrayLike) -> Shaper:
    """Check an impulse sequence and freeze it.

    Parameters
    ----------
    times
        (k,) s, increasing, the first 0.
    amplitudes
        (k,), sum 1 within 1e-9.

    Raises
    ------
    OptionError
        Empty, of unlike length, not finite, times not increasing from 0, or a sum other than 1.
    """
    t, a = np.asarray(times, dtype=np.float64), np.asarray(amplitudes, dtype=np.float64)
    if t.ndim != 1 or a.shape != t.shape or t.size == 0:
        raise OptionError(
            f"a shaper needs as many times as amplitudes, and one at least; got {t.size} and {a.size}",
            hint="give both as lists of numbers",
        )
    if not (np.isfinite(t).all() and np.isfinite(a).all()):
        raise OptionError("a shaper's times and amplitudes must be finite")
    if t[0] != 0.0 or (np.diff(t) <= 0.0).any():
        raise OptionError(
            f"a shaper's times must increase from 0, not {t.tolist()}",
            hint="subtract the first time from all",
        )
    if abs(a.sum() - 1.0) > SUM_TOLERANCE:
        raise OptionError(
            f"a shaper's amplitudes must add up to 1, not {a.sum():.12g}",
            hint="divide them by their sum: then the machine still arrives where it was sent",
        )
    return Shaper(times=frozen(t), amplitudes=frozen(a))


def convolve(shapers: Sequence[Shaper]) -> Shaper:
    """Run a command through one shaper after the other: all sums of times, all products of amplitudes.

    Raises
    ------
    OptionError
        More than `MOST_IMPULSES` impulses together.
    """
    times, amplitudes = np.zeros(1), np.ones(1)
    for shaper in shapers:
        if times.size * shaper.times.size > MOST_IMPULSES:
            raise OptionError(
                f"the shapers have more than {MOST_IMPULSES} impulses together", hint="leave weak modes out"
            )
        times = np.add.outer(times, shaper.times).ravel()
        amplitudes = np.multiply.outer(amplitudes, shaper.amplitudes).ravel()
        order = np.argsort(times, kind="stable")
        times, amplitudes = times[order], amplitudes[order]
        new = np.concatenate([[True], np.diff(times) > 1e-12 * max(times[-1], 1e-300)])
        amplitudes = np.add.reduceat(amplitudes, np.flatnonzero(new))
        times = times[new]
    return Shaper(times=frozen(times), amplitudes=frozen(amplitudes))
