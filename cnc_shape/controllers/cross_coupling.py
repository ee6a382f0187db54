"""Cross-coupling: the axes answer the contour error together, in Cartesian space.

The tangent estimator takes the contour error to be what is left of the tracking error when its part
along the path is taken out, ``eps = e - <e, t> t`` (paper 004, eqs 6-13). That is the projection which
the paper writes as n <n, e>, without its 0/0 where the error lies along the path.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from cnc_shape.arrays import FloatArray
from cnc_shape.kernels import kernel


@dataclass(frozen=True, slots=True)
class CrossCoupling:
    """Proportional cross-coupling with the tangent estimator."""

    proportional: float  # 1/s


class CrossCouplingGains(NamedTuple):
    """Gains of the cross-coupled loop."""

    proportional: float  # 1/s


@kernel
def step(gains: CrossCouplingGains, tracking: FloatArray, tangent: FloatArray, drive: FloatArray) -> None:
    """Add ``Kc eps`` to the Cartesian velocity command.

    tracking (3,) mm, command minus actual; tangent (3,) unit, of the command; drive (>=3,) mm/s.
    """
    along = 0.0
    for i in range(3):
        along += tracking[i] * tangent[i]
    for i in range(3):
        drive[i] += gains.proportional * (tracking[i] - along * tangent[i])
