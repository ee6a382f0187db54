"""Applying: a motion through its shapers, measured on its way to a file.

Limits are kept by the planner before shaping; shaping with negative impulses may exceed them, and what it
does to the path is a contour error of its own. Both are told beside the samples.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.contour import MeasuringState, Tally, measuring, tally
from cnc_shape.kernels.sums import largest_ratio
from cnc_shape.limits import Limits
from cnc_shape.machine import Machine
from cnc_shape.motion import Block
from cnc_shape.pipeline import Deviation, deviation
from cnc_shape.shapers.command_shaping import CommandShaping, CommandState, command_shaping
from cnc_shape.trajectory import Trajectory
from cnc_shape.windows import foot_reach


@dataclass(frozen=True, slots=True)
class Load:
    """How much of an axis's limits a command takes; more than 1: it exceeds them."""

    velocity: float  # -, largest over its limit
    acceleration: float  # -

    @property
    def worst(self) -> float:
        """The larger of the two."""
        return max(self.velocity, self.acceleration)


@dataclass(frozen=True, slots=True)
class Applied:
    """What shaping made of a motion."""

    cycle_time: float  # s, unshaped
    shaped_time: float  # s
    samples: int
    sample_time: float  # s
    axes: tuple[str, ...]
    command: Deviation  # contour error of the shaped command
    worst_limit_violation: float  # -, relative excess of the unshaped command; 0: it keeps its limits
    loads: Mapping[str, Load]  # axis: of the shaped command

    @property
    def shaped_acceleration_ratio(self) -> float:
        """Largest shaped acceleration over its limit."""
        return max(load.acceleration for load in self.loads.values())


class Application:
    """A motion being shaped: draw `blocks` to the end, then ask for the `summary`."""

    def __init__(
        self, motion: Iterable[Block], machine: Machine, shaping: CommandShaping, sample_time: float
    ) -> None:
        self._motion = motion
        self._machine = machine
        self._shaping = shaping
        self._sample_time = sample_time
        self._axes: tuple[str, ...] = ()
        self._tally = Tally()
        self._plain = np.zeros(1)  # largest ratio to the limits, of the unshaped command
        self._speed = self._push = np.zeros(0)  # (d,) largest velocity and acceleration, shaped
        self._limits: list[Limits] = []
        self._samples = 0
        self._cycle_time = self._longer = 0.0

    def blocks(self) -> Iterator[Trajectory]:
        """Yield the shaped command, block by block."""
        shaped: CommandState | None = None
        measured: MeasuringState | None = None
        shape = measure = velocity = acceleration = None
        longer = 0.0
        for block in self._motion:
            if shape is None or measure is None or velocity is None or acceleration is None:
                self._axes = block.command.axes
                self._limits = [axis.limits for axis in self._machine.with_axes(self._axes).axes]
                velocity = frozen([limits.velocity for limits in self._limits])
                acceleration = frozen([limits.acceleration for limits in self._limits])
                self._speed = self._push = np.zeros(len(self._axes))
                shape = command_shaping(self._shaping, self._axes, self._sample_time)
                longer = self._shaping.longer(self._axes, self._sample_time)
                measure = measuring(foot_reach(0.0, longer, self._sample_time))
            largest_ratio(block.command.velocity, velocity, self._plain)
            largest_ratio(block.command.acceleration, acceleration, self._plain)
            shaped, command = shape(shaped, block.command, block.last)
            self._speed = np.maximum(self._speed, np.abs(command.velocity).max(axis=0, initial=0.0))
            self._push = np.maximum(self._push, np.abs(command.acceleration).max(axis=0, initial=0.0))
            signals = (command.position,)
            measured, (error,) = measure(measured, block.toolpath, command.arc_length, signals, block.last)
            self._tally = tally(self._tally, error)
            self._samples += len(command)
            law = block.timing.path_shaper if block.timing else None  # has been through its shaper already
            self._longer = longer + (law.duration if law else 0.0)
            self._cycle_time = block.cycle_time + longer - self._longer
            if len(command):
                yield command

    def summary(self) -> Applied:
        """What shaping made of the motion; call it after the last block."""
        peaks = zip(self._axes, self._limits, self._speed.tolist(), self._push.tolist(), strict=True)
        loads = {
            axis: Load(speed / limits.velocity, push / limits.acceleration)
            for axis, limits, speed, push in peaks
        }
        return Applied(
            self._cycle_time,
            self._cycle_time + self._longer,
            self._samples,
            self._sample_time,
            self._axes,
            deviation(self._tally),
            _excess(self._plain),
            loads,
        )


def _excess(ratio: FloatArray) -> float:
    return max(float(ratio[0]) - 1.0, 0.0)
