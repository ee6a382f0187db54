"""Stability, told before anything is simulated.

Along the path every joint is held by its position gain alone, across it by the cross-coupling as well. So the
joints are looked at one by one first, then the whole loop at poses and directions of the path.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.controllers.control import Control
from cnc_shape.controllers.cross_coupling import CrossCoupling
from cnc_shape.controllers.loop_model import (
    UNBOUNDED,
    LoopModel,
    loop_model,
    pole_radius,
    rows_of,
    with_coupling,
)
from cnc_shape.errors import InfeasibleError
from cnc_shape.machine import Axis, Drive, FirstOrderLag

GAIN_RESOLUTION = 1e-5  # -, of the largest stable gain that is told
GROWTH = 1.5  # -, of the gain from one look to the next, upwards
MOST_GROWTH = 1e6  # -, beyond which a gain has no end
LINEAR = ("x", "y", "z")
HINT = "lower position_gain_per_s or cross_coupling.proportional_per_s, or sample faster"

Place = Callable[[int], str]  # index of a pose -> where that is, in words: "at x 20, y 15"


def _directions() -> FloatArray:
    """Axes, face and body diagonals of the cube, without those that point the other way: (13,3)."""
    corners = [np.array(corner) for corner in product((1.0, 0.0, -1.0), repeat=3)]
    kept = [corner for corner in corners if corner.any() and corner[corner != 0.0][0] > 0.0]
    kept.sort(key=lambda corner: float(corner @ corner))
    return frozen([corner / np.linalg.norm(corner) for corner in kept])


DIRECTIONS = _directions()


def _nowhere(pose: int) -> str:
    return ""


def check_stability(axes: Sequence[Axis], control: Control) -> None:
    """Refuse a loop that would oscillate without end, of a machine whose joints are its axes.

    The path being unknown, the loop is held against `DIRECTIONS`.

    Raises
    ------
    InfeasibleError
        Names what is unstable, its gain and the largest stable one.
    """
    axes, control = cartesian_loop(axes, control)
    names, drives = [f"axis {axis.name}" for axis in axes], [axis.drive for axis in axes]
    _check(names, drives, control, *_everywhere(np.eye(len(drives))[None], DIRECTIONS), _nowhere)


def check_poses(
    drives: Sequence[Drive],
    control: Control,
    inverse_jacobians: FloatArray,
    tangents: FloatArray = DIRECTIONS,
    place: Place = _nowhere,
) -> None:
    """Refuse a loop that is unstable at any of the poses (p,c,c) in any of the directions (t,3).

    Raises as `check_stability`; `place` says where a pose is.
    """
    looked = _everywhere(inverse_jacobians, tangents)
    _check(_joints(drives), drives, control, *looked, lambda row: place(row // len(tangents)))


def check_along(
    drives: Sequence[Drive],
    control: Control,
    inverse_jacobians: FloatArray,
    tangents: FloatArray,
    place: Place = _nowhere,
) -> None:
    """Refuse a loop that is unstable at a pose of a path (p,c,c) along its tangent there (p,3).

    Raises as `check_stability`; `place` says where a pose is.
    """
    _check(_joints(drives), drives, control, inverse_jacobians, tangents, place)


def largest_stable_coupling(
    drives: Sequence[Drive],
    control: Control,
    inverse_jacobians: FloatArray,
    tangents: FloatArray = DIRECTIONS,
) -> float:
    """Largest proportional gain across the path, 1/s, stable at poses (p,c,c) in directions (t,3).

    Integral and derivative gain keep their ratios to it; without a cross-coupling it is proportional.
    Infinite where nothing ends it. The loop must be stable without cross-coupling.
    """
    coupling = control.cross_coupling or CrossCoupling(control.position_gain)
    whole = loop_model(
        drives, replace(control, cross_coupling=coupling), *_everywhere(inverse_jacobians, tangents)
    )
    return coupling.proportional * _largest_coupling(whole)


def largest_stable_position_gain(drive: Drive, control: Control) -> float:
    """Largest position gain with which a joint is stable by itself, 1/s; infinite for an ideal drive."""
    if not isinstance(drive, FirstOrderLag):
        return np.inf
    unit = 1.0 / control.sample_time
    return unit * _largest_factor(lambda factor: _joint_radius(drive, control, unit * factor) < 1.0)


def cartesian_loop(axes: Sequence[Axis], control: Control) -> tuple[tuple[Axis, ...], Control]:
    """Axes of a machine whose joints they are, x, y and z first, and the loop with its gains in that order.

    Of x, y and z, those that the machine lacks are ideal.
    """
    gains = dict(zip((axis.name for axis in axes), control.joint_gains, strict=False))
    by_name = {axis.name: axis for axis in axes}
    lines = tuple(by_name.get(name, Axis(name, UNBOUNDED)) for name in LINEAR)
    ordered = (*lines, *(axis for axis in axes if axis.name not in LINEAR))
    if not gains:
        return ordered, control
    in_order = tuple(gains.get(axis.name, control.position_gain) for axis in ordered)
    return ordered, replace(control, joint_gains=in_order)


def _check(
    names: Sequence[str],
    drives: Sequence[Drive],
    control: Control,
    inverse_jacobians: FloatArray,
    tangents: FloatArray,
    place: Place,
) -> None:
    """Refuse an unstable loop at n pairs of pose (n,c,c) and tangent (n,3)."""
    gains = control.joint_gains or (control.position_gain,) * len(drives)
    for name, drive, gain in zip(names, drives, gains, strict=True):
        if isinstance(drive, FirstOrderLag) and _joint_radius(drive, control, gain) >= 1.0:
            largest = largest_stable_position_gain(drive, control)
            raise InfeasibleError(
                f"the loop of {name} is unstable: position gain {gain:g} 1/s, stable below {largest:.4g} 1/s",
                hint=HINT,
            )
    coupling = control.cross_coupling
    if coupling is None or not len(tangents):
        return
    alike = _alike(drives, gains)
    if alike:
        inverse_jacobians, tangents = inverse_jacobians[:1], tangents[:1]
    model = loop_model(drives, control, inverse_jacobians, tangents)
    radius = pole_radius(model)
    if radius.max() < 1.0:
        return
    turning = pole_radius(with_coupling(model, 0.0))
    if turning.max() >= 1.0:
        raise InfeasibleError(
            f"the loop of the orientation is unstable{_told(place(int(turning.argmax())))}: gain "
            f"{coupling.orientation:g} 1/s besides the position gain",
            hint="lower cross_coupling.orientation_per_s",
        )
    largest = coupling.proportional * _largest_coupling(model)
    worst = int(radius.argmax())
    where = "" if alike else f"{_told(place(worst))}, moving along {_direction(tangents[worst])}"
    share = (
        " with its integral and derivative" if model.coupling.integral or model.coupling.derivative else ""
    )
    raise InfeasibleError(
        f"the loop is unstable across the path{where}: cross-coupling gain {coupling.proportional:g} 1/s"
        f"{share}, stable below {largest:.4g} 1/s",
        hint=HINT,
    )


def _joints(drives: Sequence[Drive]) -> list[str]:
    return [f"joint q{number}" for number in range(1, len(drives) + 1)]


def _everywhere(inverse_jacobians: FloatArray, tangents: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Every pose in every direction: (p t,c,c) and (p t,3)."""
    poses, directions = len(inverse_jacobians), len(tangents)
    return np.repeat(inverse_jacobians, directions, axis=0), np.tile(tangents, (poses, 1))


def _alike(drives: Sequence[Drive], gains: Sequence[float]) -> bool:
    """Whether all joints answer alike: then the loop across the path is one joint's, whatever the pose."""
    return len(set(drives)) == 1 and len(set(gains)) == 1


def _joint_radius(drive: Drive, control: Control, gain: float) -> float:
    alone = replace(control, cross_coupling=None, joint_gains=(gain,))
    return float(pole_radius(loop_model((drive,), alone, np.ones((1, 1, 1)), np.zeros((1, 3))))[0])


def _largest_coupling(model: LoopModel) -> float:
    """Factor by which the gains across the path may grow before any row becomes unstable."""
    suspects = model

    def stable(factor: float) -> bool:
        nonlocal suspects
        unstable = np.flatnonzero(pole_radius(with_coupling(suspects, factor)) >= 1.0)
        if unstable.size:  # what is stable here is so below, and what ends the gain is among the rest
            suspects = rows_of(suspects, unstable)
        return not unstable.size

    return _largest_factor(stable)


def _largest_factor(stable: Callable[[float], bool]) -> float:
    """Largest factor with which a loop that is stable at 0 is stable, from 1 upwards or below 1."""
    low, high = 0.0, 1.0
    while stable(high):
        low, high = high, GROWTH * high
        if high > MOST_GROWTH:
            return np.inf
    while high - low > GAIN_RESOLUTION * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low


def _told(place: str) -> str:
    return f" {place}" if place else ""


def _direction(tangent: FloatArray) -> str:
    """Say a direction: along x, or along (0.71, 0.71, 0)."""
    axis = int(np.abs(tangent).argmax())
    if abs(tangent[axis]) > 1.0 - 1e-9:
        return LINEAR[axis]
    return "(" + ", ".join(f"{part + 0.0:.2g}" for part in np.round(tangent, 4)) + ")"
