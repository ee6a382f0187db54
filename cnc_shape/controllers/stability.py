"""Stability, told before anything is simulated.

Along the path every joint is held by its position gain alone, across it by the cross-coupling as well. So the
joints are looked at one by one first, then the whole loop at poses and directions of the path.

Before both, each servo motor's velocity loop is looked at by itself (`velocity_loops`). Where a compensation
moves its gain, all this is done with the gain held, at ratios between the lowest and the highest that it may
come to: a loop that is unstable at one of them is so for as long as a load keeps the gain there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.controllers.control import Control
from cnc_shape.controllers.cross_coupling import CrossCoupling
from cnc_shape.controllers.gain_limits import (
    first_unstable,
    largest_coupling,
    largest_gain,
    reserve,
    stable_joint,
)
from cnc_shape.controllers.loop_model import (
    UNBOUNDED,
    LoopModel,
    lags,
    loop_model,
    with_coupling,
    without_turn,
)
from cnc_shape.controllers.servo_model import at_ratio, gain_ratios, held_apart
from cnc_shape.controllers.velocity_loops import out_of_ratio, settles, unsettled
from cnc_shape.errors import InfeasibleError
from cnc_shape.machine import Axis, Drive, ServoMotor
from cnc_shape.program import ROTARY, XYZ

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
    names = [f"{'axis' if axis.name in (*XYZ, *ROTARY) else 'joint'} {axis.name}" for axis in axes]
    drives = [axis.drive for axis in axes]
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
    coupled, looked = replace(control, cross_coupling=coupling), _everywhere(inverse_jacobians, tangents)
    factors = [largest_coupling(loop_model(drives, held, *looked)) for held in held_apart(drives, coupled)]
    return coupling.proportional * min(factors)


def largest_stable_position_gain(drive: Drive, control: Control) -> float:
    """Largest position gain with which a joint is stable by itself, 1/s.

    Infinite for an ideal drive; 0 for a servo motor whose velocity loop does not settle.
    """
    if not lags(drive):
        return np.inf
    if not all(_settles(drive, at_ratio(control, ratio)) for ratio in gain_ratios((drive,), control)):
        return 0.0
    return _largest_gain_of(drive, control)[0]


def cartesian_loop(axes: Sequence[Axis], control: Control) -> tuple[tuple[Axis, ...], Control]:
    """Axes of a machine whose joints they are, x, y and z first, and the loop with its gains in that order.

    Of x, y and z, those that the machine lacks are ideal.
    """
    gains = dict(zip((axis.name for axis in axes), control.joint_gains, strict=False))
    by_name = {axis.name: axis for axis in axes}
    lines = tuple(by_name.get(name, Axis(name, UNBOUNDED)) for name in XYZ)
    ordered = (*lines, *(axis for axis in axes if axis.name not in XYZ))
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
    alike = len(set(drives)) == 1 and len(set(control.joint_gains)) < 2
    if alike:  # across the path the loop is one joint's under Kp + Kc, whatever the pose
        inverse_jacobians, tangents = inverse_jacobians[:1], tangents[:1]
    gains = control.gains(len(drives))
    for name, drive, gain in zip(names, drives, gains, strict=True):
        if lags(drive):
            _check_joint(name, drive, replace(_uncoupled(control), position_gain=gain))
    coupling = control.cross_coupling
    if coupling is None or not any(lags(drive) for drive in drives):
        return
    models = [loop_model(drives, held, inverse_jacobians, tangents) for held in held_apart(drives, control)]
    stable = True
    for model in models:
        held = with_coupling(model, 0.0)
        if coupling.orientation:
            _check_turn(held, _nowhere if alike else place)
        stable = stable and bool(reserve(held, model).min(initial=1.0) > 0.0)
    if stable:
        return
    factors = [largest_coupling(model) for model in models]
    model, factor = models[int(np.argmin(factors))], min(factors)
    largest, worst = coupling.proportional * factor, first_unstable(model, factor)
    where = "" if alike else f"{_told(place(worst))}, moving along {_direction(tangents[worst])}"
    pid = model.coupling.integral or model.coupling.derivative
    share = " with its integral and derivative" if pid else ""
    raise InfeasibleError(
        f"the loop is unstable across the path{where}: cross-coupling gain {coupling.proportional:g} 1/s"
        f"{share}, stable below {largest:.4g} 1/s",
        hint=HINT,
    )


def _check_joint(name: str, drive: Drive, control: Control) -> None:
    """Refuse a joint that is unstable by itself, wherever its velocity gain may come to."""

    def stable(ratio: float) -> bool:
        held = at_ratio(control, ratio)
        return _settles(drive, held) and _stable_alone(drive, held)

    ratios = gain_ratios((drive,), control)
    for ratio in ratios:
        if isinstance(drive, ServoMotor) and not settles(drive, at_ratio(control, ratio)):
            raise unsettled(name, drive, control, ratio, stable)
    for ratio in ratios:
        if stable(ratio):
            continue
        if ratio > 1.0 and stable(1.0):
            raise out_of_ratio(f"the loop of {name}", drive, control, ratio, stable)
        largest, worst = _largest_gain_of(drive, control)
        where = "" if worst == 1.0 else f" at {worst:.3g} times its velocity gain"
        raise InfeasibleError(
            f"the loop of {name} is unstable{where}: position gain {control.position_gain:g} 1/s, "
            f"stable below {largest:.4g} 1/s",
            hint=HINT,
        )


def _check_turn(held: LoopModel, place: Place) -> None:
    """Refuse a loop that its orientation term makes unstable before anything acts across the path."""
    left = reserve(without_turn(held), held)
    if left.min(initial=1.0) > 0.0:
        return
    gain = held.coupling.orientation
    raise InfeasibleError(
        f"the loop of the orientation is unstable{_told(place(int(left.argmin())))}: gain {gain:g} 1/s "
        "besides the position gain",
        hint="lower cross_coupling.orientation_per_s",
    )


def _joints(drives: Sequence[Drive]) -> list[str]:
    return [f"joint q{number}" for number in range(1, len(drives) + 1)]


def _everywhere(inverse_jacobians: FloatArray, tangents: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Every pose in every direction: (p t,c,c) and (p t,3)."""
    poses, directions = len(inverse_jacobians), len(tangents)
    return np.repeat(inverse_jacobians, directions, axis=0), np.tile(tangents, (poses, 1))


def _uncoupled(control: Control) -> Control:
    return replace(control, cross_coupling=None, joint_gains=())


def _settles(drive: Drive, control: Control) -> bool:
    return not isinstance(drive, ServoMotor) or settles(drive, control)


def _alone(drive: Drive, control: Control) -> LoopModel:
    """The loop of a joint by itself."""
    return loop_model((drive,), _uncoupled(control), np.zeros((0, 1, 1)), np.zeros((0, 3)))


def _largest_gain_of(drive: Drive, control: Control) -> tuple[float, float]:
    """Largest position gain with which a joint is stable by itself, 1/s, and the ratio that ends it."""
    return min(
        (largest_gain(_alone(drive, at_ratio(control, ratio)), 0), ratio)
        for ratio in gain_ratios((drive,), control)
    )


def _stable_alone(drive: Drive, control: Control) -> bool:
    return stable_joint(_alone(drive, control), 0, control.position_gain)


def _told(place: str) -> str:
    return f" {place}" if place else ""


def _direction(tangent: FloatArray) -> str:
    """Say a direction: along x, or along (0.71, 0.71, 0)."""
    axis = int(np.abs(tangent).argmax())
    if abs(tangent[axis]) > 1.0 - 1e-9:
        return XYZ[axis]
    return "(" + ", ".join(f"{part + 0.0:.2g}" for part in np.round(tangent, 4)) + ")"
