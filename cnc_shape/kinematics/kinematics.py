"""The contract of a kinematics: where the drives stand when the tool is at a pose, and back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from cnc_shape.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class Kinematics:
    """Forward and inverse transform, vectorised over time."""

    name: str
    forward: Callable[[FloatArray], FloatArray]  # joints (n,j) -> axes (n,d)
    inverse: Callable[[FloatArray], FloatArray]  # axes (n,d) -> joints (n,j)
