"""Refusals: motions that a machine cannot make, told with line, joint and time."""

from __future__ import annotations

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.controllers.loop import FURTHEST
from cnc_shape.errors import InfeasibleError
from cnc_shape.joints import Joints
from cnc_shape.kinematics import first_refusal
from cnc_shape.program import ROTARY
from cnc_shape.servo import Ticks
from cnc_shape.units import DEGREE
from cnc_shape.windows import Windows


def refuse_pose(
    joints: Joints, pose: FloatArray, arc_length: FloatArray, windows: Windows, source: str
) -> None:
    """Stop at the first pose that the machine cannot hold.

    Parameters
    ----------
    joints
        Of the machine.
    pose
        (n,p) mm or rad, commanded.
    arc_length
        (m,) mm, places of the poses on the path; the last pose is at the last place.
    windows
        The path.
    source
        Name of the program.

    Raises
    ------
    InfeasibleError
        Names the line, the pose, and the leg that cannot reach or the singularity.
    """
    refused = None if joints.cartesian else first_refusal(joints.kinematics, _own(joints, pose))
    if refused is None:
        return
    row, reason = refused
    at: list[str] = []
    for axis, value in zip(joints.kinematics.axes, pose[row].tolist(), strict=False):
        rotary = axis in ROTARY
        at.append(f"{axis.upper()} {value / DEGREE if rotary else value:.6g}{'°' if rotary else ''}")
    line = None
    if windows.path.low.size:
        place = arc_length[min(row, arc_length.size - 1)]
        found = min(int(np.searchsorted(windows.path.high, place)), windows.path.line.size - 1)
        line = int(windows.path.line[found])
    raise InfeasibleError(
        f"{reason} at {', '.join(at)}",
        hint="move the part, or check the machine's geometry under kinematics",
        source=source or None,
        line=line,
    )


def _own(joints: Joints, pose: FloatArray) -> FloatArray:
    return frozen(pose[:, : joints.coupled])


def refuse_divergence(
    joints: Joints, reference: FloatArray, ran: Ticks, start: float, sample_time: float, source: str
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
        joint = int(np.argmin(following <= FURTHEST))
    else:
        return
    kind = "axis" if joints.cartesian else "joint"
    raise InfeasibleError(
        f"the loop diverged: {kind} {joints.names[joint]} has left all bounds at "
        f"t = {start + row * sample_time:.4f} s",
        hint="lower the gains",
        source=source or None,
    )
