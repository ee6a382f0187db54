"""Shaper: an impulse sequence, and what it does to a vibration."""

from __future__ import annotations

from dataclasses import dataclass

from cnc_shape.arrays import FloatArray


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
        """Centroid of the impulses, ``amplitudes @ times``, s."""
        return float(self.amplitudes @ self.times)
