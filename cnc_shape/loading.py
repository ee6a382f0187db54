"""Loading: the torques that act on a machine's axes from outside, at every tick of the velocity loops.

A load pushes along an axis, or along a direction of the path where the command is. A direction is that of
a sample and holds until the next; the profile goes on from tick to tick. Before the first motion a path has
no direction, and its loads do not act; at rest the last one holds.

The frame of an analytic command comes from its velocity and acceleration. A replayed command was given by
positions, rounded to some digits: its acceleration is mostly rounding, and is so still once it is shaped.
There the turning of the tangent goes through two exponential windows of `WINDOW` s, one after the other,
which reach into the past alone, and is taken for a curve where it agrees over the second one. On a plane
curve that costs nothing but its first two windows, as the normal is set upright on the tangent of the very
sample; on others the normal turns late by as much.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.disturbances import Disturbances, LoadTorque, PathDirection, value
from cnc_shape.kernels.frames import FRAME_SIZE, path_frames
from cnc_shape.program import XYZ
from cnc_shape.trajectory import Trajectory

WINDOW = 0.01  # s, of the turning of a replayed command
STILL = 1e-3  # mm/s, up to which a command rests
STILL_ROUNDED = 0.1  # mm/s: slower, the rounding of its positions says more than the path does

ROWS = {PathDirection.TANGENT: 0, PathDirection.NORMAL: 1, PathDirection.BINORMAL: 2}  # of a frame


@dataclass(frozen=True, eq=False, slots=True)
class LoadState:
    """Between two chunks: how many samples have gone by, and the frame of the last one."""

    samples: int
    frame: FloatArray  # (FRAME_SIZE,)
    direction: FloatArray  # (loads,d) unit vectors, at the last sample; zeros without a direction


@dataclass(frozen=True, slots=True)
class Loading:
    """The resumable stage from a command to the load torque of its axes."""

    loads: tuple[LoadTorque, ...]
    axes: tuple[str, ...]
    sample_time: float  # s
    ticks: int  # of the velocity loops, a sample

    def __call__(
        self, state: LoadState | None, command: Trajectory, rows: int
    ) -> tuple[LoadState, FloatArray]:
        """Load torque at every tick of the first `rows` samples of a chunk, (rows, ticks, d) N m.

        The samples beyond them are not looked at: they come again as the first of the next chunk.
        """
        now = state or self.start()
        if command.axes != self.axes:
            raise ValueError(f"{command.axes=} {self.axes=}")
        if rows > len(command):
            raise ValueError(f"{rows=} {len(command)=}")
        if not rows:
            return now, self._torque(now.samples, np.zeros((0, len(self.loads), len(self.axes))))
        frame, frames = now.frame.copy(), np.zeros((rows, 3, 3))
        if any(isinstance(load.direction, PathDirection) for load in self.loads):
            share = -np.expm1(-self.sample_time / WINDOW) if command.rounded else 0.0
            still = STILL_ROUNDED if command.rounded else STILL
            path_frames(
                self._space(command.velocity[:rows]), self._space(command.acceleration[:rows]),
                self.sample_time, still, share, frame, frames,
            )  # fmt: skip
        direction = self._directions(frames)
        ended = LoadState(now.samples + rows, frozen(frame), frozen(direction[-1].copy()))
        return ended, self._torque(now.samples, direction)

    def at_rest(self, state: LoadState, rows: int) -> FloatArray:
        """Load torque while the command rests where it ended, (rows, ticks, d) N m; time goes on."""
        direction = np.broadcast_to(state.direction, (rows, *state.direction.shape))
        return self._torque(state.samples, direction)

    def start(self) -> LoadState:
        """The state before the first sample."""
        nowhere = self._directions(np.zeros((1, 3, 3)))[0]
        return LoadState(0, frozen(np.zeros(FRAME_SIZE)), frozen(nowhere))

    def _space(self, rates: FloatArray) -> FloatArray:
        """The x, y and z of axis rates, (n,3); 0 where the command lacks one."""
        space = np.zeros((rates.shape[0], 3))
        for column, axis in enumerate(XYZ):
            if axis in self.axes:
                space[:, column] = rates[:, self.axes.index(axis)]
        return space

    def _directions(self, frames: FloatArray) -> FloatArray:
        """Direction of every load over the axes, (n, loads, d), out of frames (n,3,3)."""
        directions = np.zeros((frames.shape[0], len(self.loads), len(self.axes)))
        for row, load in enumerate(self.loads):
            if isinstance(load.direction, PathDirection):
                for column, axis in enumerate(self.axes):
                    if axis in XYZ:
                        directions[:, row, column] = frames[:, ROWS[load.direction], XYZ.index(axis)]
            elif load.direction in self.axes:
                directions[:, row, self.axes.index(load.direction)] = 1.0
        return directions

    def _torque(self, first: int, direction: FloatArray) -> FloatArray:
        """Torque (rows, ticks, d) from sample number `first` on, by directions (rows, loads, d)."""
        rows = direction.shape[0]
        sample: FloatArray = np.arange(first, first + rows, dtype=np.float64)[:, None]
        t: FloatArray = (sample + np.arange(self.ticks) / self.ticks) * self.sample_time
        torque = np.zeros((rows, self.ticks, len(self.axes)))
        for row, load in enumerate(self.loads):
            push = load.peak * value(load.profile, t)
            for column in range(len(self.axes)):
                torque[:, :, column] += push * direction[:, row, column, None]
        return frozen(torque)


def loading(disturbances: Disturbances, axes: tuple[str, ...], sample_time: float, ticks: int) -> Loading:
    """Return the resumable stage from a command to the load torque of its axes.

    ``state, torque = step(state, command, rows)`` goes on with the command, ``step.at_rest(state, rows)``
    stays where it ended. A load along an axis that the command lacks meets nothing that could move.

    Parameters
    ----------
    disturbances
        The loads among them; they add up.
    axes
        Of the command. Directions of the path are of x, y and z.
    sample_time
        s, of the command.
    ticks
        Of the velocity loops, a sample.
    """
    return Loading(disturbances.loads, axes, sample_time, ticks)
