"""The contract of a kinematics: where the drives stand when the tool is at a pose, and back.

A pose is given by axes: x, y, z of the tool centre point first, then the rotary axes that the kinematics
turns the tool or the workpiece with. The loop takes all it needs from here as arrays, so a new
kinematics is its file and a line in `KINEMATICS`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from cnc_shape.arrays import FloatArray, frozen

WEIGHT_OF_A_RADIAN = 60.0  # mm


@dataclass(frozen=True, slots=True)
class Kinematics:
    """Forward and inverse transform and the inverse Jacobian, vectorised over time.

    There are as many joints as axes. A joint that cannot reach its pose is nan, and so is every axis of
    a pose that cannot be found from its joints. Forward takes each row's own pose nearby as first guess, so
    what comes of a row depends on no other row.
    """

    name: str
    axes: tuple[str, ...]  # x, y, z first, then rotary axes
    joints: tuple[str, ...]  # names of the drives: q1, q2, ...
    forward: Callable[[FloatArray, FloatArray], FloatArray]  # joints (n,j), poses nearby (n,d) -> axes (n,d)
    inverse: Callable[[FloatArray], FloatArray]  # axes (n,d) -> joints (n,j)
    inverse_jacobian: Callable[[FloatArray], FloatArray]  # axes (n,d) -> joint rates per axis rates (n,j,d)
    turn: Callable[[FloatArray, FloatArray], FloatArray] | None = None  # axes, axes (n,d) -> angle between
    # the tool's directions against the workpiece, (n,) rad; None: the tool does not turn
    radian: float = WEIGHT_OF_A_RADIAN  # mm that count as much as a radian where both stand in one norm


def rows(values: FloatArray, width: int) -> FloatArray:
    """Return `values` (n, width) as kernels take them: read-only, in one piece.

    Raises
    ------
    ValueError
        If they are not rows of that width.
    """
    if values.ndim != 2 or values.shape[1] != width:
        raise ValueError(f"{values.shape=}, not (n, {width})")
    return frozen(values)
