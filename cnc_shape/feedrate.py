"""Profile: the time law along a path."""

from __future__ import annotations

from dataclasses import dataclass

from cnc_shape.arrays import FloatArray, IntArray
from cnc_shape.smoothing import Path


@dataclass(frozen=True, eq=False, slots=True)
class Profile:
    """A chunk of the time law u(t): pieces of constant path jerk, cut at cell borders.

    In piece m, with ``e = t - time[m]``: ``u = u[m] + v e + a e^2/2 + j e^3/6`` until ``time[m] + duration[m]``.
    """

    path: Path  # the cells that the pieces run through
    time: FloatArray  # (m,) s, start of the piece
    duration: FloatArray  # (m,) s
    u: FloatArray  # (m,) path parameter at the piece's start
    velocity: FloatArray  # (m,) du/dt
    acceleration: FloatArray  # (m,)
    jerk: FloatArray  # (m,)
    cell: IntArray  # (m,) index into path

    def __len__(self) -> int:
        return self.time.size
