"""Array types and the one way to freeze an array."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]


def frozen(values: ArrayLike) -> FloatArray:
    """Return `values` as a C-contiguous float64 array that nobody can write to.

    A view is frozen, not a copy made: the caller hands the memory over.
    """
    view = np.ascontiguousarray(values, dtype=np.float64).view()
    view.setflags(write=False)
    return view


def frozen_integers(values: ArrayLike) -> IntArray:
    """Return `values` as a C-contiguous int64 array that nobody can write to."""
    view = np.ascontiguousarray(values, dtype=np.int64).view()
    view.setflags(write=False)
    return view
