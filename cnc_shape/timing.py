"""Timing: what the time law along a path has to heed beyond limits and feed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.shapers.shaper import Shaper
from cnc_shape.smoothing import Path


@dataclass(frozen=True, eq=False, slots=True)
class Slowdown:
    """How much gentler the cells of a program's path are run through than the limits allow."""

    factor: FloatArray  # (k,) -, of the acceleration, its square root of the speed; one for each cell


@dataclass(frozen=True, slots=True)
class Timing:
    """How one motion along a path is timed; motions with equal timing are one motion."""

    stop_dwell: float = 0.0  # s, least rest at every stop on the way
    path_shaper: Shaper | None = None  # of the time law itself
    slowdown: Slowdown | None = None


PLAIN = Timing()


def rested(path: Path, dwell: float, *, first: bool, last: bool) -> Path:
    """`path` resting at least `dwell` s at each stop on the way.

    A program's start and end are no stops on the way: `first` and `last` tell whether the chunk holds them.
    """
    if dwell <= 0.0 or len(path) == 0:
        return path
    inner = path.stop.copy()
    if first:
        inner[0] = False
    if last:
        inner[-1] = False
    return replace(path, dwell=frozen(np.where(inner, np.maximum(path.dwell, dwell), path.dwell)))
