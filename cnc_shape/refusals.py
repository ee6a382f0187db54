"""Refusals: motions that a machine cannot make, told with line, joint and time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.controllers import Control
from cnc_shape.controllers.loop import FURTHEST
from cnc_shape.controllers.stability import check_along, check_poses, check_stability
from cnc_shape.errors import InfeasibleError
from cnc_shape.joints import Joints
from cnc_shape.kinematics import first_refusal
from cnc_shape.program import ROTARY, unit_of
from cnc_shape.servo import Ticks
from cnc_shape.toolpath import Toolpath
from cnc_shape.windows import Windows

LOOKS_EVERY = 1024  # samples from one look at the loop's stability on the way to the next
SAME_PLACE = 1e-6  # mm of path, within which a place is that of a move's end: rounding

Lines = Callable[[int], int | None]  # the program's line that a row of a chunk of poses belongs to


def check_own_loops(joints: Joints, control: Control) -> None:
    """Refuse a loop that is unstable wherever the machine stands.

    Where joints are axes that is the whole loop; elsewhere every joint's own, as the cross-coupling depends
    on the pose.

    Raises
    ------
    InfeasibleError
        Names what is unstable, its gain and the largest stable one.
    """
    alone = control if joints.cartesian else replace(control, cross_coupling=None)
    check_stability(joints.drives, alone)


def check_on_the_way(
    joints: Joints,
    control: Control,
    pose: FloatArray,
    velocity: FloatArray,
    ticks: int,
    lines: Lines,
    source: str,
) -> None:
    """Refuse a cross-coupled loop that is unstable at a pose of the way, before it is simulated there.

    Parameters
    ----------
    joints, control
        The machine and its loop.
    pose
        (n,p) mm or rad, commanded from tick `ticks` on; one of `LOOKS_EVERY` is looked at.
    velocity
        (n,d) mm/s, of x, y and z first. At rest every direction is looked at.
    ticks
        Number of the first of them.
    lines, source
        Of the program.

    Raises
    ------
    InfeasibleError
        Names line, pose, direction, the gain and the largest stable one.
    """
    own, first = joints.coupled, -ticks % LOOKS_EVERY
    looked = pose[first::LOOKS_EVERY]
    if not len(looked):
        return
    toward = velocity[first::LOOKS_EVERY, :3]
    speed = np.sqrt((toward * toward).sum(axis=1))
    drives = [drive.drive for drive in joints.drives[:own]]
    mine = replace(control, joint_gains=control.joint_gains[:own])
    inverse = joints.inverse_jacobian(frozen(looked))
    moving = speed > 0.0
    told: list[int] = []

    def place(row: int) -> str:
        told.append(row)
        return _place(joints, looked[row])

    try:
        if not moving.all():
            still = int(np.argmin(moving))
            check_poses(drives, mine, inverse[still : still + 1], place=lambda _: place(still))
        if moving.any():
            there = np.flatnonzero(moving)
            check_along(
                drives, mine, inverse[moving], toward[moving] / speed[moving, None],
                lambda row: place(int(there[row])),
            )  # fmt: skip
    except InfeasibleError as error:
        error.source = error.source or source or None
        if error.source and told:
            error.line = error.line or lines(first + LOOKS_EVERY * told[-1])
        raise


def _place(joints: Joints, pose: FloatArray) -> str:
    """Say where a pose is."""
    at: list[str] = []
    for axis, value in zip(joints.kinematics.axes, pose.tolist(), strict=False):
        at.append(f"{axis.upper()} {value / unit_of(axis):.6g}{'°' if axis in ROTARY else ''}")
    return f"at {', '.join(at)}"


def refuse_pose(joints: Joints, pose: FloatArray, lines: Lines, source: str) -> None:
    """Stop at the first pose that the machine cannot hold.

    Parameters
    ----------
    joints
        Of the machine.
    pose
        (n,p) mm or rad, commanded.
    lines, source
        Of the program.

    Raises
    ------
    InfeasibleError
        Names the line, the pose, and the leg that cannot reach or the singularity.
    """
    refused = None if joints.cartesian else first_refusal(joints.kinematics, joints.own(pose))
    if refused is None:
        return
    row, reason = refused
    raise InfeasibleError(
        f"{reason} {_place(joints, pose[row])}",
        hint="move the part, or check the machine's geometry under kinematics",
        source=source or None,
        line=lines(row),
    )


def line_in_windows(windows: Windows | None, arc_length: FloatArray, row: int) -> int | None:
    """Line of the move with XYZ travel that a sample runs on; rows past the last are still there."""
    if windows is None or not windows.path.low.size:
        return None
    place = float(arc_length[min(row, arc_length.size - 1)])
    found = min(int(np.searchsorted(windows.path.high, place)), windows.path.line.size - 1)
    return int(windows.path.line[found])


def line_on_toolpath(toolpaths: Sequence[Toolpath], position: FloatArray, place: float) -> int | None:
    """Line of the move that a commanded position belongs to.

    Moves of rotary axes alone have no length: of all moves at the place it is the one nearest the position.

    Parameters
    ----------
    toolpaths
        Consecutive chunks, that of the move among them.
    position
        (d,) mm or rad, in the toolpaths' axes.
    place
        mm of path.
    """
    nearest, line = np.inf, None
    for toolpath in toolpaths:
        low, high = toolpath.arc_length[:-1], toolpath.arc_length[1:]
        here = np.flatnonzero((low <= place + SAME_PLACE) & (high >= place - SAME_PLACE))
        start, chord = toolpath.start[here], toolpath.end[here] - toolpath.start[here]
        square = (chord * chord).sum(axis=1)
        along = ((position - start) * chord).sum(axis=1) / np.where(square > 0.0, square, 1.0)
        away = position - start - np.clip(along, 0.0, 1.0)[:, None] * chord
        distance = (away * away).sum(axis=1)
        if here.size and distance.min() < nearest:
            nearest = float(distance.min())
            line = int(toolpath.line[here[int(distance.argmin())]])
    return line


def refuse_divergence(
    joints: Joints,
    reference: FloatArray,
    ran: Ticks,
    start: float,
    sample_time: float,
    source: str,
    *,
    loaded: bool,
) -> None:
    """Stop where the loop has left all bounds.

    Parameters
    ----------
    joints
        Of the machine.
    reference
        (n+1,j) mm or rad, what they were told.
    ran
        What the ticks came to.
    start, sample_time
        s, of the first tick, and from one to the next.
    source
        Name of the program.
    loaded
        Whether load torques act, which may be more than the motors can hold.

    Raises
    ------
    InfeasibleError
        Names joint and time.
    """
    away = ~np.isfinite(ran.drive[: ran.done]) | ~np.isfinite(ran.tool[: ran.done])
    if away.any():
        row, joint = (int(index) for index in np.argwhere(away)[0])
    elif ran.done < ran.joint.shape[0]:
        row = ran.done
        following = np.abs(reference[row] - ran.joint[row])
        joint = int(np.flatnonzero(~(following <= FURTHEST))[0])
    else:
        return
    kind = "axis" if joints.cartesian else "joint"
    raise InfeasibleError(
        f"the loop diverged: {kind} {joints.names[joint]} has left all bounds at "
        f"t = {start + row * sample_time:.4f} s",
        hint="lower the gains, or the loads: beyond its torque_limit_nm a motor holds none"
        if loaded
        else "lower the gains",
        source=source or None,
    )
