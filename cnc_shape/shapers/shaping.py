"""Shaping: Trajectory to Trajectory, every axis through its own impulses, all axes delayed alike.

Axes with unlike shapers would fall out of step and bend every path, so each axis is delayed to the
largest centroid D of all: axis a's impulses sit at ``t_i + D - D_a``. On steady motion the shaped
command is then the unshaped one, late by D, on all axes. Impulses fall between samples; they are not
rounded to the grid but evaluated on the command's own cubic.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import ceil

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen
from cnc_shape.kernels.taps import delayed_sum
from cnc_shape.shapers.shaper import NONE, Shaper
from cnc_shape.trajectory import Trajectory, with_past

GRID_TOLERANCE = 1e-9  # -, of a sample: an impulse this close to the grid lies on it


@dataclass(frozen=True, eq=False, slots=True)
class Delays:
    """The impulses of all axes on the servo grid: delay ``(whole + share) * sample_time``."""

    whole: IntArray  # (d,k) samples
    share: FloatArray  # (d,k) of a sample, 0 <= share < 1
    amplitude: FloatArray  # (d,k)
    impulses: IntArray  # (d,) impulses of each axis
    common: float  # s, D: how late the shaped command is
    longest: float  # s, delay of the very last impulse


def common_delay(shapers: Mapping[str, Shaper]) -> float:
    """Largest centroid of all axes, s; that of an axis without a shaper is 0."""
    return max([0.0, *(shaper.delay for shaper in shapers.values())])


def delays(
    shapers: Mapping[str, Shaper], axes: tuple[str, ...], sample_time: float, *, aligned: bool = True
) -> Delays:
    """Place the impulses of every axis on the servo grid; an axis without a shaper is only delayed.

    Where the axes are not `aligned`, every first impulse is at 0, and each axis late by its own centroid.
    """
    chosen = [shapers.get(axis, NONE) for axis in axes]
    common = common_delay(shapers)
    most = max(shaper.times.size for shaper in chosen)
    whole = np.zeros((len(axes), most), dtype=np.int64)
    share, amplitude = np.zeros((len(axes), most)), np.zeros((len(axes), most))
    longest = 0.0
    for row, shaper in enumerate(chosen):
        times = shaper.times + (common - shaper.delay if aligned else 0.0)
        longest = max(longest, float(times[-1]))
        samples = times / sample_time
        nearest = np.rint(samples)
        on_grid = np.abs(samples - nearest) <= GRID_TOLERANCE
        k = times.size
        whole[row, :k] = np.where(on_grid, nearest, np.floor(samples))
        share[row, :k] = np.where(on_grid, 0.0, samples - np.floor(samples))
        amplitude[row, :k] = shaper.amplitudes
    return Delays(whole, share, amplitude, np.array([s.times.size for s in chosen]), common, longest)


def shaping(
    shapers: Mapping[str, Shaper], sample_time: float, *, aligned: bool = True
) -> Callable[[Trajectory | None, Trajectory, bool], tuple[Trajectory | None, Trajectory]]:
    """Return the resumable stage that shapes the axis commands.

    Before its first sample the command rests there; after its last it rests there for as long as the
    last impulse needs. Between two chunks the stage keeps the samples that later ones still hark back to.
    """

    def step(
        history: Trajectory | None, command: Trajectory, last: bool
    ) -> tuple[Trajectory | None, Trajectory]:
        placed = delays(shapers, command.axes, sample_time, aligned=aligned)
        kept = max(int(placed.whole.max(initial=0)), int(placed.common / sample_time)) + 2
        if history is None and len(command) == 0:
            return None, command
        after = ceil(placed.longest / sample_time - GRID_TOLERANCE) if last else 0
        whole, first = with_past(history, command, kept, after)
        shaped = delayed_sum(
            whole.position, whole.velocity, whole.acceleration, first, len(whole) - first,
            placed.whole, placed.share, placed.amplitude, placed.impulses, sample_time,
        )  # fmt: skip
        place = whole.late_arc_length(first, placed.common / sample_time)
        return (
            whole.cut(slice(len(whole) - kept, None)),
            Trajectory(command.axes, sample_time, frozen(place), *map(frozen, shaped), rounded=whole.rounded),
        )

    return step


def shape(command: Trajectory, shapers: Mapping[str, Shaper]) -> Trajectory:
    """Shape a whole motion.

    Parameters
    ----------
    command
        The axis commands from rest to rest.
    shapers
        One shaper per axis name; an axis without one is only delayed.

    Returns
    -------
    Trajectory
        Starts at t = 0 where `command` starts, ends where it ends, later by the last impulse.
    """
    return shaping(shapers, command.sample_time)(None, command, True)[1]
