"""Response: what a machine's drives and tool make of a command."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.controllers.motor_loop import SIGNALS
from cnc_shape.joints import Joints
from cnc_shape.machine import ServoMotor
from cnc_shape.servo import Ticks
from cnc_shape.trajectory import Trajectory


@dataclass(frozen=True, eq=False, slots=True)
class MotorSignals:
    """What the servo motors did, one column for each of them: the signals of the motor loop, in order."""

    joints: tuple[str, ...]  # (m,) joints that have a servo motor
    torque: FloatArray  # (n,m) N m, asked of the motors
    load: FloatArray  # (n,m) N m, load torque that was injected
    estimate: FloatArray  # (n,m) N m, the observer's estimate of it; 0 without an observer
    gain_ratio: FloatArray  # (n,m) -, velocity gain over the nominal one
    effective_inertia: FloatArray  # (n,m) kg m^2, that the compensation makes of the load
    agreement: FloatArray  # (n,m) -, -A: how much of the contour error the load's displacement explains
    inertia: FloatArray  # (n,m) kg m^2, identified; the nominal one without identification


def motor_signals(joints: Joints, ran: Ticks) -> MotorSignals | None:
    """What the servo motors of a machine did, if it has any."""
    driven = [row for row, joint in enumerate(joints.drives) if isinstance(joint.drive, ServoMotor)]
    if not driven:
        return None
    columns = (frozen(ran.signals[: ran.done, driven, column]) for column in range(SIGNALS))
    return MotorSignals(tuple(joints.names[row] for row in driven), *columns)


@dataclass(frozen=True, eq=False, slots=True)
class Response:
    """What drives and tool did under a command: a chunk of samples."""

    command: Trajectory
    reference: FloatArray  # (n,j) mm or rad, what the drives were told
    joint: FloatArray  # (n,j) mm or rad, position of the drives
    position: FloatArray  # (n,d) mm or rad, of the drives through the kinematics
    tool: FloatArray  # (n,d) mm or rad, drives plus structure
    drive: FloatArray  # (n,j) mm/s or rad/s, velocity command of the loop
    turn: FloatArray  # (n,) rad between the tool's direction and what it should be; (0,): it does not turn
    motors: MotorSignals | None = None  # where any joint has a servo motor

    @property
    def following_error(self) -> FloatArray:
        """What the drives were told minus where they are, (n,j) mm or rad."""
        return self.reference - self.joint

    def summary(self) -> str:
        """Largest lag and deflection of every axis, in one line."""
        following = np.abs(self.command.position - self.position).max(axis=0, initial=0.0)
        deflection = np.abs(self.tool - self.position).max(axis=0, initial=0.0)
        told = zip(self.command.axes, following.tolist(), deflection.tolist(), strict=True)
        return "; ".join(f"{axis.upper()} follows to {f:.4g}, bends by {d:.4g}" for axis, f, d in told)
