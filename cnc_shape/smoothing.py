"""Path: the toolpath made C2 within its tolerance."""

from __future__ import annotations

from dataclasses import dataclass

from cnc_shape.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False, slots=True)
class Path:
    """A chunk of the C2 path: cubic cells over the path parameter u, d axes.

    In cell k, ``q(e) = c0 + c1 e + c2 e^2 + c3 e^3`` with ``e = u - u[k]``, ``0 <= e <= length[k]``.
    u is XYZ travel in mm where XYZ moves, rad where rotary axes move alone. Cells follow each other;
    a cell of length 0 only carries a dwell.
    """

    axes: tuple[str, ...]
    u: FloatArray  # (k,) path parameter at the cell's start
    length: FloatArray  # (k,) of the cell in u
    coefficients: FloatArray  # (k,4,d)
    feed_rate: FloatArray  # (k,) mm/s or rad/s, ceiling; inf: none but the axes
    stop: BoolArray  # (k,) the path rests at the cell's start
    dwell: FloatArray  # (k,) s, waiting at the cell's start (only where stop)
    arc_length: FloatArray  # (k,) mm, place on the toolpath that belongs to the cell's start
    stretch: FloatArray  # (k,) d(toolpath arc length)/du within the cell
    line: IntArray  # (k,)

    def __len__(self) -> int:
        return self.u.size
