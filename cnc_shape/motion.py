"""Motion: the unshaped command, block by block, with the toolpath it runs on.

Program -> Toolpath -> Path -> Profile -> Trajectory. A program is planned once; every case runs on the
same blocks. Only what the stages hold back is in memory, whatever the program's length.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias, TypeVar

import numpy as np

from cnc_shape.chunks import with_last
from cnc_shape.errors import InfeasibleError
from cnc_shape.feedrate import Profile
from cnc_shape.limits import NO_PATH_LIMITS, PathLimits
from cnc_shape.machine import Machine
from cnc_shape.planning import PlanningState, planning
from cnc_shape.program import Program
from cnc_shape.shapers.path_shaping import path_sampling
from cnc_shape.smoothing import Path, Smoothing, smoothing
from cnc_shape.timing import PLAIN, Timing, rested
from cnc_shape.toolpath import Toolpath, building, check_travel
from cnc_shape.trajectory import Trajectory, sampling

STILL = 1e-9  # mm or rad, an axis that moves no farther does not move

Drawn: TypeAlias = tuple[float, Trajectory]  # s, end of the motion so far; samples of it


@dataclass(frozen=True, eq=False, slots=True)
class Block:
    """A stretch of the motion: the toolpath that has come in since the last block, and samples on it."""

    toolpath: Toolpath | None
    command: Trajectory
    last: bool
    cycle_time: float  # s, exact duration of the motion so far; of all of it in the last block
    moved: tuple[str, ...]  # axes that have moved so far
    timing: Timing | None = None  # which of the motions that run side by side; None: there is only one
    profile: Profile | None = None  # the time law that has been added since the last block of this motion


@dataclass(frozen=True, eq=False, slots=True)
class Planned:
    """A stretch of a program with its time law, not sampled yet."""

    toolpath: Toolpath  # that has come in since the last stretch
    profile: Profile  # that is final since then
    last: bool
    moved: tuple[str, ...]  # axes that have moved so far
    timing: Timing


def planned(
    program: Iterable[Program],
    machine: Machine,
    path_tolerance: float,
    timings: Sequence[Timing] = (PLAIN,),
    path_limits: PathLimits = NO_PATH_LIMITS,
) -> Iterator[Planned]:
    """Plan a program, chunk by chunk, once for each timing.

    Parameters
    ----------
    program
        Consecutive chunks, at least one.
    machine
        Its limits hold; axes it lacks are ideal.
    path_tolerance
        mm, where the program does not say.
    timings
        Distinct; the stretches come in turns, each timing's in its own order.
    path_limits
        Of the motion along the path, beside those of the axes.

    Raises
    ------
    InfeasibleError
        A move beyond an axis's travel, or one that no motion can satisfy, names the line; a program
        without travel.
    """
    build, smooth = building(), smoothing(Smoothing(path_tolerance))
    built = smoothed = None
    plans: list[_Plan] = []
    moved = np.zeros(0, dtype=np.bool_)
    for chunk, last in with_last(program):
        if not plans:
            machine = machine.with_axes(chunk.axes)
            plans = [_Plan(timing, machine, path_limits) for timing in timings]
            moved = np.zeros(len(chunk.axes), dtype=np.bool_)
        low, high = check_travel(chunk, {axis.name: axis.limits.travel for axis in machine.axes})
        moved |= np.ptp(np.vstack([chunk.start, low, high]), axis=0) > STILL
        if last and not moved.any():
            raise InfeasibleError(
                "the program moves nothing", hint="it has no G1, G2 or G3 with travel", source=chunk.source
            )
        built, toolpath = build(built, chunk, last)
        smoothed, path = smooth(smoothed, toolpath, last)
        names = tuple(axis for axis, seen in zip(chunk.axes, moved, strict=True) if seen)
        for plan in plans:
            yield Planned(toolpath, plan.next(path, chunk.source, last=last), last, names, plan.timing)


def moving(
    program: Iterable[Program],
    machine: Machine,
    path_tolerance: float,
    sample_time: float,
    timings: Sequence[Timing] = (PLAIN,),
    path_limits: PathLimits = NO_PATH_LIMITS,
) -> Iterator[Block]:
    """Plan and sample a program, chunk by chunk, once for each timing.

    Parameters and errors are those of `planned`; `sample_time` in s.
    """
    draws = {timing: drawing(timing, sample_time) for timing in timings}
    for stretch in planned(program, machine, path_tolerance, timings, path_limits):
        toolpath: Toolpath | None = stretch.toolpath
        profile: Profile | None = stretch.profile
        for (end_time, command), end in with_last(draws[stretch.timing](stretch.profile, stretch.last)):
            last = stretch.last and end
            yield Block(toolpath, command, last, end_time, stretch.moved, stretch.timing, profile)
            toolpath = profile = None


class _Plan:
    """One timing's time law of the path that all of them share."""

    def __init__(self, timing: Timing, machine: Machine, path_limits: PathLimits) -> None:
        gentle = None if timing.slowdown is None else timing.slowdown.factor
        self.timing = timing
        self._plan = planning(tuple(axis.limits for axis in machine.axes), gentle, path_limits)
        self._state: PlanningState | None = None
        self._begun = False

    def next(self, path: Path, source: str, *, last: bool) -> Profile:
        path = rested(path, self.timing.stop_dwell, first=not self._begun, last=last)
        self._begun = self._begun or len(path) > 0
        try:
            self._state, profile = self._plan(self._state, path, last)
        except InfeasibleError as error:
            error.source = error.source or source
            raise
        return profile


def drawing(timing: Timing, sample_time: float) -> Callable[[Profile, bool], Iterator[Drawn]]:
    """Return what samples the profiles of one motion, one after the other: the end so far, and samples."""
    if timing.path_shaper is None:
        return _in_turn(sampling(sample_time))
    return _in_turn(path_sampling(timing.path_shaper, sample_time))


class _Timed(Protocol):
    """A state that tells the end of the motion so far."""

    @property
    def end_time(self) -> float: ...


S = TypeVar("S", bound=_Timed)


def _in_turn(
    step: Callable[[S | None, Profile, bool], Iterator[tuple[S, Trajectory]]],
) -> Callable[[Profile, bool], Iterator[Drawn]]:
    """Keep the state of a sampling step from one profile to the next."""
    state: S | None = None

    def draw(profile: Profile, last: bool) -> Iterator[Drawn]:
        nonlocal state
        for now, command in step(state, profile, last):
            state = now
            yield now.end_time, command

    return draw


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
