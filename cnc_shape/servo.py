"""Servo: the loop of a machine, its gains and drives made ready for the kernel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from cnc_shape.arrays import FloatArray, frozen, frozen_integers
from cnc_shape.controllers import (
    Control,
    DisturbanceObserver,
    cross_coupling,
    disturbance_observer,
    feedforward,
    friction_feedforward,
    inertia_compensation,
    inertia_identification,
    position_loop,
    servo_drive,
)
from cnc_shape.controllers.compensation import WATCHING
from cnc_shape.controllers.loop import Command, Memory, Poses, Terms, servo_loop
from cnc_shape.controllers.motor_loop import MotorMemory
from cnc_shape.controllers.servo_model import ratio_bounds
from cnc_shape.disturbances import EncoderNoise, LoadTorque
from cnc_shape.joints import Joints, joints_of
from cnc_shape.kernels.foot_point import PathTable
from cnc_shape.machine import IdealDrive, Machine, ServoMotor
from cnc_shape.plant import Plant, discretise
from cnc_shape.program import ROTARY
from cnc_shape.windows import Reach, foot_reach

MOST_PUSHED = 100.0  # mm, by which loads may widen the window of foot points
SLOWEST_LOOP = 2.5  # s, time constant beyond which the window of foot points grows no more
_NOTHING = frozen([])
NO_PATH = PathTable(
    frozen(np.zeros((0, 11))), _NOTHING, _NOTHING, frozen(np.zeros((0, 17))), frozen(np.zeros((0, 6))),
    frozen(np.zeros((0, 6))), frozen_integers(np.zeros(0, np.int64)),
)  # fmt: skip
UNLOADED = frozen(np.zeros((0, 0, 0)))
NO_POSES = Poses(frozen(np.zeros((0, 0, 0))), 0, 1)


class PathWindows(NamedTuple):
    """The path laid out for the search, and every tick's window on it."""

    path: PathTable = NO_PATH
    lower: FloatArray = _NOTHING  # (n,) mm of path
    upper: FloatArray = _NOTHING  # (n,) mm of path


@dataclass(frozen=True, eq=False, slots=True)
class Ticks:
    """What some ticks of the loop came to, (n,j) each."""

    joint: FloatArray  # mm or rad, position of the drives
    rate: FloatArray  # mm/s or rad/s, their velocity
    tool: FloatArray  # mm or rad, drives plus structure where that is behind each of them
    drive: FloatArray  # mm/s or rad/s, velocity command
    signals: FloatArray  # (n,j,7) of the servo motors; (0,j,7) where there are none
    done: int  # ticks until the loop diverged; n where it did not


@dataclass(frozen=True, eq=False, slots=True)
class ServoLoop:
    """The terms of a loop with their gains, and the drives that they move."""

    control: Control
    plant: Plant
    motors: servo_drive.Motors
    terms: Terms

    @property
    def bends(self) -> bool:
        """Whether there is structure behind any drive."""
        return bool((self.plant.states > 2).any())

    def start(self, reference: FloatArray) -> Memory:
        """Memory of a loop at rest at `reference`, (j,) mm or rad."""
        plant = np.zeros(self.plant.held.shape)
        plant[:, 0] = reference
        late = (self.control.delay_samples, reference.size)
        return Memory(
            plant,
            np.zeros(late),
            np.zeros((2, 3)),
            np.zeros((3, 3)),
            np.zeros(4, np.int64),
            MotorMemory(
                motor := servo_drive.start(self.motors, reference),
                disturbance_observer.start(motor[:, servo_drive.READ]),
                inertia_compensation.start(self.control.inertia_compensation, reference.size),
                inertia_identification.start(reference.size),
                np.zeros(reference.size),
                np.zeros(late),
                np.zeros(1, np.int64),
            ),
        )

    def run(
        self,
        memory: Memory,
        command: Command,
        poses: Poses,
        windows: PathWindows,
        load: FloatArray = UNLOADED,
    ) -> Ticks:
        """Run as many ticks as the command has samples but one; `memory` is changed in place.

        load (n,ticks,j) N m on servo motors, or without rows.
        """
        joint, rate, tool, drive, signals, done = servo_loop(
            command, poses, windows.path, windows.lower, windows.upper, load, self.control.sample_time,
            self.plant, self.motors, self.terms, memory,
        )  # fmt: skip
        return Ticks(frozen(joint), frozen(rate), frozen(tool), frozen(drive), frozen(signals), done)


def copied(memory: Memory) -> Memory:
    """Copy a memory, so that the one before stays as it was."""
    return Memory(
        memory.plant.copy(), memory.late.copy(), memory.frame.copy(), memory.coupling.copy(),
        memory.cursor.copy(), _copied_motors(memory.motors),
    )  # fmt: skip


def _copied_motors(motors: MotorMemory) -> MotorMemory:
    return MotorMemory(
        motors.motor.copy(), motors.observer.copy(), motors.compensation.copy(), motors.identification.copy(),
        motors.friction.copy(), motors.late.copy(), motors.clock.copy(),
    )  # fmt: skip


def make_loop(joints: Joints, control: Control, noise: EncoderNoise | None = None) -> ServoLoop:
    """Make the loop of a machine ready.

    Raises
    ------
    ValueError
        Not one position gain for every joint, or velocity loops that do not tick together.
    """
    drives, period = joints.drives, control.sample_time
    gains = control.gains(len(drives))
    if len(gains) != len(drives):
        raise ValueError(f"{len(gains)=} {len(drives)=}")
    reading = noise or EncoderNoise(0.0)
    motors = servo_drive.motors(drives, period, reading.standard_deviation, reading.seed)
    late = 1.0 - (control.feedforward.velocity if control.feedforward else 0.0)
    lags = [late / gain for gain in gains]
    terms = Terms(
        position_loop.PositionGains(frozen(gains)),
        int(control.feedforward is not None),
        feedforward.gains(control.feedforward or feedforward.Feedforward(), drives),
        int(control.cross_coupling is not None),
        cross_coupling.gains(control.cross_coupling),
        friction_feedforward.gains(control.friction_feedforward, drives, lags, period),
        disturbance_observer.gains(observer_of(control), motors.period),
        inertia_compensation.gains(control.inertia_compensation, drives, gains, period),
        inertia_identification.gains(control.inertia_identification, period),
    )
    return ServoLoop(control, discretise(drives, period, motors.period), motors, terms)


def observer_of(control: Control) -> DisturbanceObserver | None:
    """The observer of a loop: its own, or one that only watches where another term needs it."""
    if control.disturbance_observer is not None:
        return control.disturbance_observer
    needed = control.inertia_compensation is not None or control.inertia_identification is not None
    return WATCHING if needed else None


def structure_of(machine: Machine, sample_time: float) -> ServoLoop:
    """What bends behind axes that are moved by others: the modes of ideal drives."""
    still = tuple(replace(axis, drive=IdealDrive()) for axis in machine.axes)
    return make_loop(joints_of(replace(machine, axes=still, joints=())), Control(sample_time))


def settling_time(joints: Joints, control: Control) -> float:
    """Time constant of the position loop, s; 0 where all drives are ideal."""
    lags = any(not isinstance(drive.drive, IdealDrive) for drive in joints.drives)
    slowest = min(control.joint_gains, default=control.position_gain)
    return min(1.0 / slowest, SLOWEST_LOOP) if lags else 0.0


def pushed_aside(joints: Joints, control: Control, loads: Sequence[LoadTorque]) -> float:
    """How far loads may push the joints, mm: what motors yield to all of them at once, without integral.

    A load beyond a motor's torque limit takes it along.
    """
    torque, ratio = sum(abs(load.peak) for load in loads), ratio_bounds(control)[0]
    gains = control.gains(len(joints.drives))
    yielding = [
        drive.pitch * torque / (drive.velocity_gain * ratio * gain)
        if torque < drive.torque_limit
        else MOST_PUSHED
        for joint, gain in zip(joints.drives, gains, strict=True)
        if isinstance(drive := joint.drive, ServoMotor) and joint.name not in ROTARY
    ]
    return min(max(yielding, default=0.0), MOST_PUSHED)


def loop_reach(
    joints: Joints, control: Control, longest: float = 0.0, loads: Sequence[LoadTorque] = ()
) -> Reach:
    """Reach of the windows in which a loop's samples find their foot points; longest: of the shapers, s."""
    pushed = pushed_aside(joints, control, loads)
    return foot_reach(settling_time(joints, control), longest, control.sample_time, pushed)
