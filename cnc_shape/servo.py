"""Servo: the loop of a machine, its gains and drives made ready for the kernel."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from cnc_shape.arrays import FloatArray, frozen, frozen_integers
from cnc_shape.controllers import Control, cross_coupling, feedforward, position_loop
from cnc_shape.controllers.loop import Command, Memory, Poses, servo_loop
from cnc_shape.joints import Joints, joints_of
from cnc_shape.kernels.foot_point import PathTable
from cnc_shape.machine import IdealDrive, Machine
from cnc_shape.plant import Plant, discretise

SLOWEST_LOOP = 2.5  # s, time constant beyond which the window of foot points grows no more
_NOTHING = frozen([])
NO_PATH = PathTable(
    frozen(np.zeros((0, 11))), _NOTHING, _NOTHING, frozen(np.zeros((0, 17))), frozen(np.zeros((0, 6))),
    frozen(np.zeros((0, 6))), frozen_integers(np.zeros(0, np.int64)),
)  # fmt: skip
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
    done: int  # ticks until the loop diverged; n where it did not


@dataclass(frozen=True, eq=False, slots=True)
class ServoLoop:
    """The terms of a loop with their gains, and the drives that they move."""

    control: Control
    plant: Plant
    position_gains: position_loop.PositionGains
    feed_gains: feedforward.FeedforwardGains
    couple_gains: cross_coupling.CrossCouplingGains

    @property
    def bends(self) -> bool:
        """Whether there is structure behind any drive."""
        return bool((self.plant.states > 2).any())

    def start(self, reference: FloatArray) -> Memory:
        """Memory of a loop at rest at `reference`, (j,) mm or rad."""
        plant = np.zeros(self.plant.held.shape)
        plant[:, 0] = reference
        return Memory(
            plant,
            np.zeros((self.control.delay_samples, reference.size)),
            np.zeros((2, 3)),
            np.zeros((3, 3)),
            np.zeros(4, np.int64),
        )

    def run(self, memory: Memory, command: Command, poses: Poses, windows: PathWindows) -> Ticks:
        """Run as many ticks as the command has samples but one; `memory` is changed in place."""
        joint, rate, tool, drive, done = servo_loop(
            command, poses, windows.path, windows.lower, windows.upper, self.control.sample_time, self.plant,
            self.position_gains, int(self.control.feedforward is not None), self.feed_gains,
            int(self.control.cross_coupling is not None), self.couple_gains, memory,
        )  # fmt: skip
        return Ticks(frozen(joint), frozen(rate), frozen(tool), frozen(drive), done)


def copied(memory: Memory) -> Memory:
    """Copy a memory, so that the one before stays as it was."""
    return Memory(
        memory.plant.copy(), memory.late.copy(), memory.frame.copy(), memory.coupling.copy(),
        memory.cursor.copy(),
    )  # fmt: skip


def make_loop(joints: Joints, control: Control) -> ServoLoop:
    """Make the loop of a machine ready."""
    gains = control.joint_gains or (control.position_gain,) * len(joints.drives)
    if len(gains) != len(joints.drives):
        raise ValueError(f"{len(gains)=} {len(joints.drives)=}")
    return ServoLoop(
        control,
        discretise(joints.drives, control.sample_time),
        position_loop.PositionGains(frozen(gains)),
        feedforward.gains(control.feedforward or feedforward.Feedforward(), joints.drives),
        cross_coupling.gains(control.cross_coupling),
    )


def structure_of(machine: Machine, sample_time: float) -> ServoLoop:
    """What bends behind axes that are moved by others: the modes of ideal drives."""
    still = tuple(replace(axis, drive=IdealDrive()) for axis in machine.axes)
    return make_loop(joints_of(replace(machine, axes=still, joints=())), Control(sample_time))


def settling_time(joints: Joints, control: Control) -> float:
    """Time constant of the position loop, s; 0 where all drives are ideal."""
    lags = any(not isinstance(drive.drive, IdealDrive) for drive in joints.drives)
    slowest = min(control.joint_gains, default=control.position_gain)
    return min(1.0 / slowest, SLOWEST_LOOP) if lags else 0.0
