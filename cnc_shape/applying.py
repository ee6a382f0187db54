"""Applying: a motion through its shapers, measured on its way to a file.

Limits are kept by the planner before shaping; shaping with negative impulses may exceed them, and what it
does to the path is a contour error of its own. Both are told beside the samples.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.contour import MeasuringState, Tally, measuring, tally
from cnc_shape.kernels.sums import largest_ratio
from cnc_shape.machine import Machine
from cnc_shape.motion import Block
from cnc_shape.pipeline import WINDOW_MARGIN, Deviation, deviation, window
from cnc_shape.shapers.command_shaping import CommandShaping, CommandState, command_shaping
from cnc_shape.trajectory import Trajectory


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
    shaped_acceleration_ratio: float  # -, largest shaped acceleration over its limit


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
        self._plain, self._shaped = np.zeros(1), np.zeros(1)  # largest ratios to the limits
        self._samples = 0
        self._cycle_time = self._longer = 0.0

    def blocks(self) -> Iterator[Trajectory]:
        """Yield the shaped command, block by block."""
        shaped: CommandState | None = None
        measured: MeasuringState | None = None
        shape = measure = velocity = acceleration = None
        for block in self._motion:
            if shape is None or measure is None or velocity is None or acceleration is None:
                self._axes = block.command.axes
                limits = [axis.limits for axis in self._machine.with_axes(self._axes).axes]
                velocity = frozen([limit.velocity for limit in limits])
                acceleration = frozen([limit.acceleration for limit in limits])
                shape = command_shaping(self._shaping, self._axes, self._sample_time)
                self._longer = self._shaping.longer(self._axes, self._sample_time)
                measure = measuring(*window(0.0, self._longer, self._sample_time), WINDOW_MARGIN)
            largest_ratio(block.command.velocity, velocity, self._plain)
            largest_ratio(block.command.acceleration, acceleration, self._plain)
            shaped, command = shape(shaped, block.command, block.last)
            largest_ratio(command.acceleration, acceleration, self._shaped)
            signals = (command.position,)
            measured, (error,) = measure(measured, block.toolpath, command.arc_length, signals, block.last)
            self._tally = tally(self._tally, error)
            self._samples += len(command)
            self._cycle_time = block.cycle_time
            if len(command):
                yield command

    def summary(self) -> Applied:
        """What shaping made of the motion; call it after the last block."""
        return Applied(
            self._cycle_time,
            self._cycle_time + self._longer,
            self._samples,
            self._sample_time,
            self._axes,
            deviation(self._tally),
            _excess(self._plain),
            float(self._shaped[0]),
        )


def _excess(ratio: FloatArray) -> float:
    return max(float(ratio[0]) - 1.0, 0.0)
