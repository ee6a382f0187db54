"""Joints: what moves a machine's axes, on the axes that a program has.

A pose has the axes of the kinematics first, then those that the program moves besides. Rotary axes of the
kinematics that the program does not name rest at 0; each of the others is a joint of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.kinematics import Kinematics, cartesian
from cnc_shape.machine import LINEAR_DEFAULT, Axis, IdealDrive, Machine, ServoMotor
from cnc_shape.program import ROTARY

CARTESIAN = cartesian()


@dataclass(frozen=True, slots=True)
class Joints:
    """The joints of a machine under one kinematics."""

    kinematics: Kinematics
    drives: tuple[Axis, ...]  # one a joint, the kinematics' own first; with its modes where joints are axes
    columns: tuple[int, ...]  # of the pose, one for every axis of the program

    @property
    def cartesian(self) -> bool:
        """Whether joints are axes."""
        return self.kinematics == CARTESIAN

    @property
    def names(self) -> tuple[str, ...]:
        """Of the joints."""
        return tuple(drive.name for drive in self.drives)

    @property
    def coupled(self) -> int:
        """Joints that the kinematics moves the tool with; the others stand for themselves."""
        return len(self.kinematics.joints)

    def own(self, pose: FloatArray) -> FloatArray:
        """Those columns of poses or joints (n,p) that are the kinematics' own, (n,c)."""
        return frozen(pose[:, : self.coupled])

    def pose(self, axes: FloatArray) -> FloatArray:
        """Positions or rates of the program's axes (n,d) as those of a pose (n,p)."""
        if self.cartesian:
            return axes
        pose = np.zeros((axes.shape[0], len(self.drives)))
        pose[:, self.columns] = axes
        return frozen(pose)

    def axes(self, pose: FloatArray) -> FloatArray:
        """Positions of the program's axes (n,d) in a pose (n,p)."""
        return pose if self.cartesian else frozen(pose[:, self.columns])

    def inverse(self, pose: FloatArray) -> FloatArray:
        """Joints at poses, (n,j); nan where out of reach."""
        if self.cartesian:
            return pose
        joint = self.kinematics.inverse(self.own(pose))
        return frozen(np.hstack([joint, pose[:, self.coupled :]]))

    def inverse_jacobian(self, pose: FloatArray) -> FloatArray:
        """Joint rates per axis rates of the kinematics' own, (n,c,c)."""
        return frozen(self.kinematics.inverse_jacobian(self.own(pose)))

    def rates(self, pose: FloatArray, velocity: FloatArray) -> FloatArray:
        """Joint rates (n,j) at poses and their velocities (n,p)."""
        if self.cartesian:
            return velocity
        rates = np.einsum("nja,na->nj", self.inverse_jacobian(pose), velocity[:, : self.coupled])
        return frozen(np.hstack([rates, velocity[:, self.coupled :]]))

    def torques(self, pose: FloatArray, load: FloatArray) -> FloatArray:
        """Torques on the motors (n,t,j) that hold torques over the axes (n,t,d), at poses (n,p).

        Over an axis that is a joint of its own, a torque is that of its motor. Over those of the kinematics
        it is that of a motor whose screw is like the first joint's, over a rotary one whose gear is like the
        first rotary joint's, if there is one, and what the motors do together must do the same work.
        """
        if self.cartesian:
            return load
        over = np.zeros((*load.shape[:2], len(self.drives)))
        over[:, :, self.columns] = load
        pitches = np.array([_pitch(joint) for joint in self.drives])
        own, coupled = pitches[: self.coupled], slice(self.coupled)
        turning = np.isin(self.names[coupled], ROTARY)
        first = _first(own, 1.0)
        geared = np.where(np.isin(self.kinematics.axes, ROTARY), _first(own[turning], first), first)
        across = self.inverse_jacobian(pose).transpose(0, 2, 1)[:, None]
        force = over[:, :, coupled] / geared
        over[:, :, coupled] = np.linalg.solve(across, force[..., None])[..., 0] * own
        return frozen(over)

    def forward(self, joint: FloatArray, near: FloatArray) -> FloatArray:
        """Poses (n,p) of joints (n,j), each near a pose."""
        if self.cartesian:
            return joint
        pose = self.kinematics.forward(self.own(joint), self.own(near))
        return frozen(np.hstack([pose, joint[:, self.coupled :]]))

    def velocity(self, pose: FloatArray, rates: FloatArray) -> FloatArray:
        """Velocities of poses (n,p) whose joints move at `rates` (n,j)."""
        if self.cartesian:
            return rates
        own = self.coupled
        moving = np.linalg.solve(self.inverse_jacobian(pose), rates[:, :own, None])[:, :, 0]
        return frozen(np.hstack([moving, rates[:, own:]]))


def _pitch(joint: Axis) -> float:
    """Travel of a joint per turn of its servo motor, mm or rad per rad; 0 for another drive."""
    return joint.drive.pitch if isinstance(joint.drive, ServoMotor) else 0.0


def _first(pitches: FloatArray, default: float) -> float:
    """The first pitch that there is."""
    return float(next((pitch for pitch in pitches if pitch > 0.0), default))


def joints_of(machine: Machine, kinematics: Kinematics = CARTESIAN) -> Joints:
    """Joints of a machine whose axes are those of the program, in its order.

    Joints without a drive are ideal.

    Raises
    ------
    ValueError
        Drives of joints without the kinematics that they move, or not as many as it has joints.
    """
    names = tuple(axis.name for axis in machine.axes)
    if kinematics == CARTESIAN:
        if machine.joints:
            raise ValueError(f"{len(machine.joints)=}: give the kinematics that these joints move")
        return Joints(kinematics, machine.axes, tuple(range(len(names))))
    given = machine.joints or (IdealDrive(),) * len(kinematics.joints)
    own = [Axis(n, LINEAR_DEFAULT, d) for n, d in zip(kinematics.joints, given, strict=True)]
    others = [axis for axis in machine.axes if axis.name not in kinematics.axes]
    pose = (*kinematics.axes, *(axis.name for axis in others))
    alone = [Axis(axis.name, axis.limits, axis.drive) for axis in others]
    return Joints(kinematics, (*own, *alone), tuple(pose.index(name) for name in names))
