"""Contour error: the distance from a position to the programmed path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False, slots=True)
class ContourError:
    """Distance of every sample to the programmed geometry and its foot point there."""

    distance: FloatArray  # (n,) mm, >= 0
    foot: FloatArray  # (n,3) mm
    arc_length: FloatArray  # (n,) mm, of the foot point on the toolpath
    line: IntArray  # (n,) source line of the foot's segment

    @property
    def rms(self) -> float:
        """Root mean square over all samples, mm."""
        return float(np.sqrt(np.mean(self.distance**2))) if self.distance.size else 0.0

    @property
    def max(self) -> float:
        """Largest distance, mm."""
        return float(self.distance.max(initial=0.0))
