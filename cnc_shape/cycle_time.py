"""Cycle time: how long a program takes beside what lengths and feeds promise, and where the rest goes.

A fold over the planned stretches of a program. What it keeps are sums, and two numbers for every line of the
source that moves anything.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.certificate import Violation, worst_violation
from cnc_shape.feedrate import Profile, rotary_only
from cnc_shape.jerk import jerk_limited
from cnc_shape.kernels.passing import add_time_at_feed
from cnc_shape.limits import NO_PATH_LIMITS, Limits, PathLimits
from cnc_shape.machine import Machine
from cnc_shape.motion import Planned
from cnc_shape.passing import Moves, PassingState, passing
from cnc_shape.program import Motion

WORST_LINES = 5  # that are told
POINTS = 9  # of a piece that are held against the limits
POINTS_WITHOUT_JERK = 5  # the acceleration along an axis is quadratic there
AT_FEED = 0.99  # -, of the feed rate: as good as there
DECIMALS = 9  # of a loss in s: the others are rounding
KINDS = ((Motion.FEED, Motion.ARC), (Motion.RAPID,), (Motion.DWELL,))


@dataclass(frozen=True, slots=True)
class LineTime:
    """All moves of one line of the source, however often it was executed."""

    line: int
    time: float  # s
    naive_time: float  # s

    @property
    def lost(self) -> float:
        """Time beyond the naive one, s."""
        return self.time - self.naive_time


@dataclass(frozen=True, slots=True)
class Excess:
    """Largest relative excess over limits; 0 where they are kept."""

    velocity: float = 0.0
    acceleration: float = 0.0
    jerk: float = 0.0
    feed: float = 0.0
    path_acceleration: float = 0.0
    chord: float = 0.0

    def raised(self, more: Violation) -> Excess:
        """The larger of both, limit by limit."""
        return Excess(
            max(self.velocity, more.velocity),
            max(self.acceleration, more.acceleration),
            max(self.jerk, more.jerk),
            max(self.feed, more.feed),
            max(self.path_acceleration, more.path_acceleration),
            max(self.chord, more.chord),
        )


@dataclass(frozen=True, slots=True)
class CycleTime:
    """What the motion through a program amounts to."""

    cycle_time: float  # s, exact
    naive_time: float  # s: lengths over feeds, rapids at the axes' velocities, dwells
    feed_time: float  # s, of feeds and arcs
    rapid_time: float  # s
    dwell_time: float  # s
    stops: int  # rests on the way, start and end apart
    at_feed: float  # s, within a hundredth of the programmed feed
    worst: tuple[LineTime, ...]  # lines that lose most, the worst first
    excess: Excess
    moved: tuple[str, ...]  # axes that move

    @property
    def ratio(self) -> float:
        """Cycle time as a multiple of the naive one."""
        return self.cycle_time / self.naive_time if self.naive_time > 0.0 else np.inf

    @property
    def share_at_feed(self) -> float:
        """Share of the time of feeds and arcs that is spent at the programmed feed."""
        return min(1.0, self.at_feed / self.feed_time) if self.feed_time > 0.0 else 0.0


@dataclass(frozen=True, eq=False, slots=True)
class _Lines:
    """Sums by line, in order of the lines."""

    line: IntArray  # (n,)
    time: FloatArray  # (n,) s
    naive_time: FloatArray  # (n,) s


@dataclass(frozen=True, eq=False, slots=True)
class ClockState:
    """Sums over what has been planned so far."""

    passing: PassingState | None
    sums: FloatArray  # (5,) s: feeds, rapids, dwells, naive time, time at feed
    cycle_time: float  # s
    stops: int  # start and end of the program among them
    lines: tuple[_Lines, ...]  # one after the other, none of them in two
    excess: Excess
    moved: tuple[str, ...]

    def total(self) -> CycleTime:
        """What it comes to."""
        feeds, rapids, dwells, naive, at_feed = (float(value) for value in self.sums)
        return CycleTime(
            self.cycle_time, naive, feeds, rapids, dwells, max(0, self.stops - 2), at_feed,
            _worst(self.lines), self.excess, self.moved,
        )  # fmt: skip


ClockStep: TypeAlias = Callable[[ClockState | None, Planned], tuple[ClockState, Moves]]


def clocking(limits: Sequence[Limits], path_limits: PathLimits = NO_PATH_LIMITS) -> ClockStep:
    """Return the fold ``step(state, stretch) -> (state, moves)`` over the stretches of one timing.

    Parameters
    ----------
    limits
        One per axis of the program: what the motion was planned for.
    path_limits
        Likewise.
    """
    points = POINTS if jerk_limited(limits) else POINTS_WITHOUT_JERK
    passed = passing([limit.velocity for limit in limits])

    def step(state: ClockState | None, stretch: Planned) -> tuple[ClockState, Moves]:
        now = state or ClockState(None, frozen(np.zeros(5)), 0.0, 0, (), Excess(), ())
        profile, excess = stretch.profile, now.excess
        rest, moves = passed(now.passing, stretch.toolpath, profile, stretch.last)
        if len(profile):
            excess = excess.raised(worst_violation(profile, limits, points, path_limits))
        return ClockState(
            rest,
            _summed(now.sums, moves, profile),
            profile.end_time if len(profile) else now.cycle_time,
            now.stops + _rests(profile),
            _by_line(now.lines, moves),
            excess,
            stretch.moved,
        ), moves

    return step


def clocked(
    stretches: Iterable[Planned], machine: Machine, path_limits: PathLimits = NO_PATH_LIMITS
) -> Iterator[tuple[ClockState, Moves]]:
    """Yield, for every stretch of a motion that was planned for `machine`, the sums so far and its moves."""
    state: ClockState | None = None
    step: ClockStep | None = None
    for stretch in stretches:
        if step is None:
            known = machine.with_axes(stretch.toolpath.axes)
            step = clocking([axis.limits for axis in known.axes], path_limits)
        state, moves = step(state, stretch)
        yield state, moves


def cycle_time(
    stretches: Iterable[Planned], machine: Machine, path_limits: PathLimits = NO_PATH_LIMITS
) -> CycleTime:
    """Cycle time of a motion that was planned for `machine` and `path_limits`, by `motion.planned`.

    Raises
    ------
    ValueError
        There is no stretch.
    """
    state: ClockState | None = None
    for sums, _ in clocked(stretches, machine, path_limits):
        state = sums
    if state is None:
        raise ValueError("no stretch was planned")
    return state.total()


def _summed(sums: FloatArray, moves: Moves, profile: Profile) -> FloatArray:
    """Add move by move, piece by piece: the same bits however they were cut into chunks."""
    added = sums.copy()
    for column, kinds in enumerate(KINDS):
        added[column] = _sum(sums[column], moves.time[np.isin(moves.kind, kinds)])
    added[3] = _sum(sums[3], moves.naive_time)
    path = profile.path
    add_time_at_feed(
        profile.duration, profile.u, profile.velocity, profile.acceleration, profile.jerk, profile.cell,
        path.coefficients, path.feed_rate, rotary_only(path), AT_FEED, added[4:],
    )  # fmt: skip
    return frozen(added)


def _sum(before: float, terms: FloatArray) -> float:
    return float(np.cumsum(np.concatenate([[before], terms]))[-1])


def _by_line(parts: tuple[_Lines, ...], moves: Moves) -> tuple[_Lines, ...]:
    """Add moves to the sums of their lines. A program that runs forward touches the last part alone."""
    if not len(moves):
        return parts
    lowest, touched = int(moves.line.min()), len(parts)
    while touched and parts[touched - 1].line[-1] >= lowest:
        touched -= 1
    old = parts[touched:]
    line = np.concatenate([*(part.line for part in old), moves.line])
    lines, place = np.unique(line, return_inverse=True)
    time, naive = np.zeros(lines.size), np.zeros(lines.size)
    np.add.at(time, place, np.concatenate([*(part.time for part in old), moves.time]))
    np.add.at(naive, place, np.concatenate([*(part.naive_time for part in old), moves.naive_time]))
    return (*parts[:touched], _Lines(frozen_integers(lines), frozen(time), frozen(naive)))


def _worst(parts: tuple[_Lines, ...]) -> tuple[LineTime, ...]:
    """Lines that lose most; of those that lose the same but for rounding the first."""
    found: list[LineTime] = []
    for part in parts:
        lost = np.round(part.time - part.naive_time, DECIMALS)
        order = np.argsort(-lost, kind="stable")[:WORST_LINES]
        found += [LineTime(int(part.line[k]), float(part.time[k]), float(part.naive_time[k])) for k in order]
    found.sort(key=lambda line: -round(line.lost, DECIMALS))
    return tuple(line for line in found[:WORST_LINES] if round(line.lost, DECIMALS) > 0.0)


def _rests(profile: Profile) -> int:
    """Stops of the path, and nodes between them at which the law rests all the same."""
    stop = profile.path.stop
    resting = (profile.velocity == 0.0) & (profile.u == 0.0) & ~stop[profile.cell]
    return int(np.count_nonzero(stop)) + int(np.count_nonzero(resting))
