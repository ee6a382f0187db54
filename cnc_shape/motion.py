"""Motion: the unshaped command, block by block, with the toolpath it runs on.

Program -> Toolpath -> Path -> Profile -> Trajectory. A program is planned once; every case runs on the
same blocks. Only what the stages hold back is in memory, whatever the program's length.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from cnc_shape.errors import InfeasibleError
from cnc_shape.feedrate import planning
from cnc_shape.machine import Machine
from cnc_shape.program import Program
from cnc_shape.smoothing import Smoothing, smoothing
from cnc_shape.toolpath import Toolpath, building, check_travel
from cnc_shape.trajectory import Trajectory, sampling

STILL = 1e-9  # mm or rad, an axis that moves no farther does not move

T = TypeVar("T")


@dataclass(frozen=True, eq=False, slots=True)
class Block:
    """A stretch of the motion: the toolpath that has come in since the last block, and samples on it."""

    toolpath: Toolpath | None
    command: Trajectory
    last: bool
    cycle_time: float  # s, exact duration of the motion so far; of all of it in the last block
    moved: tuple[str, ...]  # axes that have moved so far


def with_last(items: Iterable[T]) -> Iterator[tuple[T, bool]]:
    """Pair every item with whether it is the last."""
    iterator = iter(items)
    try:
        held = next(iterator)
    except StopIteration:
        return
    for item in iterator:
        yield held, False
        held = item
    yield held, True


def moving(
    program: Iterable[Program], machine: Machine, path_tolerance: float, sample_time: float
) -> Iterator[Block]:
    """Plan and sample a program, chunk by chunk.

    Parameters
    ----------
    program
        Consecutive chunks, at least one.
    machine
        Its limits hold; axes it lacks are ideal.
    path_tolerance
        mm, where the program does not say.
    sample_time
        s.

    Raises
    ------
    InfeasibleError
        A move beyond an axis's travel, or one that no motion can satisfy, names the line; a program
        without travel.
    """
    build, smooth = building(), smoothing(Smoothing(path_tolerance))
    built = smoothed = planned = sampled = None
    plan = None
    draw = sampling(sample_time)
    moved = np.zeros(0, dtype=np.bool_)
    for chunk, last in with_last(program):
        if plan is None:
            machine = machine.with_axes(chunk.axes)
            plan = planning(tuple(axis.limits for axis in machine.axes))
            moved = np.zeros(len(chunk.axes), dtype=np.bool_)
        low, high = check_travel(chunk, {axis.name: axis.limits.travel for axis in machine.axes})
        moved |= np.ptp(np.vstack([chunk.start, low, high]), axis=0) > STILL
        if last and not moved.any():
            raise InfeasibleError(
                "the program moves nothing", hint="it has no G1, G2 or G3 with travel", source=chunk.source
            )
        built, toolpath = build(built, chunk, last)
        smoothed, path = smooth(smoothed, toolpath, last)
        try:
            planned, profile = plan(planned, path, last)
        except InfeasibleError as error:
            error.source = error.source or chunk.source
            raise
        names = tuple(axis for axis, seen in zip(chunk.axes, moved, strict=True) if seen)
        pending: Toolpath | None = toolpath
        for (drawn, command), end in with_last(draw(sampled, profile, last)):
            yield Block(pending, command, last and end, drawn.end_time, names)
            pending, sampled = None, drawn


def replaying(command: Trajectory, toolpath: Toolpath) -> Iterator[Block]:
    """Hand on a time trajectory as it is."""
    duration = (len(command) - 1) * command.sample_time
    moved = tuple(
        axis for axis, column in zip(command.axes, command.position.T, strict=True) if np.ptp(column) > 0.0
    )
    yield Block(toolpath, command, True, duration, moved)


def lacking(machine: Machine, moved: Sequence[str]) -> tuple[str, ...]:
    """Axes that move and that the machine does not describe."""
    known = {axis.name for axis in machine.axes}
    return tuple(axis for axis in moved if axis not in known)
