"""Profile: the time law along a path, as fast as the axes and the feed allow, without a limit of the jerk.

The scan backwards finds how fast each node may be passed at most if all that follows is to be kept, the
scan forwards drives up to that (`kernels/time_law.py`). A chunk is planned as if the path rested at its
end, the most cautious of all futures. Where the scan backwards nevertheless arrives at a cell's own limit,
the past cannot depend on the future: up to there the law is final. So the look-ahead is a stopping
distance, whatever the number of blocks.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from cnc_shape.arrays import BoolArray, FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.errors import InfeasibleError
from cnc_shape.kernels.path_limits import chord_speeds, straight_along
from cnc_shape.kernels.speed_limits import almost_straight, speed_limits
from cnc_shape.kernels.time_law import backward, forward
from cnc_shape.limits import NO_PATH_LIMITS, Limits, PathLimits
from cnc_shape.smoothing import Path, join_paths

PATIENCE = 1024  # cells that gather before a new attempt, so that short chunks do not repeat the scan


@dataclass(frozen=True, eq=False, slots=True)
class Profile:
    """A chunk of the time law u(t): pieces of constant path jerk, cut at cell borders.

    In piece m, with ``e = t - time[m]``: ``s = u[m] + v e + a e^2/2 + j e^3/6`` until ``time[m + 1]``, where
    s is the path parameter counted from the start of the piece's cell. The last piece of a program is
    its rest at the end.
    """

    path: Path  # the cells that the pieces run through
    time: FloatArray  # (m,) s, start of the piece
    duration: FloatArray  # (m,) s
    u: FloatArray  # (m,) path parameter at the piece's start, from the start of its cell
    velocity: FloatArray  # (m,) du/dt
    acceleration: FloatArray  # (m,)
    jerk: FloatArray  # (m,)
    cell: IntArray  # (m,) index into path

    def __len__(self) -> int:
        return self.time.size

    @property
    def end_time(self) -> float:
        """Time at the end of the last piece, s: the cycle time, if the chunk is the last one."""
        return float(self.time[-1] + self.duration[-1]) if len(self) else 0.0


@dataclass(frozen=True, eq=False, slots=True)
class ScanState:
    """Between two chunks: cells whose speed depends on what follows, and the motion at their start."""

    parts: tuple[Path, ...]
    clock: FloatArray  # (3,) s, its rounding error, squared speed at the first cell
    before_v2: float  # squared speed limit of the cell before the first one
    patience: int  # cells to gather before the next attempt
    passed: int  # cells of the program before the first one


ScanStep: TypeAlias = Callable[[ScanState | None, Path, bool], tuple[ScanState | None, Profile]]


def scanning(
    limits: Sequence[Limits], gentleness: FloatArray | None = None, path_limits: PathLimits = NO_PATH_LIMITS
) -> ScanStep:
    """Return the resumable step from Path to Profile: ``step(state, chunk, last) -> (state, profile)``.

    Parameters
    ----------
    limits
        One per axis of the path, in the order of `path.axes`. Jerk is not limited.
    gentleness
        One factor in (0, 1] for each cell of the program: of the accelerations, its square root of the feed.
    path_limits
        Of the motion along the path.
    """
    velocity = frozen([limit.velocity for limit in limits])
    acceleration = frozen([limit.acceleration for limit in limits])

    def step(state: ScanState | None, path: Path, last: bool) -> tuple[ScanState | None, Profile]:
        check_executable(path, (("velocity", velocity), ("acceleration", acceleration)))
        before = state or ScanState((), frozen(np.zeros(3)), np.inf, PATIENCE, 0)
        parts = (*before.parts, path) if len(path) else before.parts
        gathered = sum(len(part) for part in parts)
        if gathered == 0 or (not last and gathered < before.patience):
            waiting = None if last else replace(before, parts=parts)
            return waiting, _no_pieces(path.cut(slice(0, 0)))
        whole = join_paths(parts)
        asked, feed_rate = gentle(whole, chord_feed_rate(whole, path_limits), gentleness, before.passed)
        limit_v2, straight = speed_limits(
            asked, whole.length, feed_rate, rotary_only(whole), velocity, acceleration
        )
        along = accelerations_along(whole, path_limits)
        if along.size:
            straight = straight_along(asked, straight, along)
        else:
            limit_v2, straight = almost_straight(asked, whole.length, limit_v2, straight, acceleration)
        reach_v2, free = backward(
            asked, whole.length, whole.stop, limit_v2, straight, acceleration, along, before.before_v2
        )
        final = len(whole) if last else int(np.flatnonzero(free[:-1])[-1]) if free[:-1].any() else 0
        clock = before.clock.copy()
        done = whole.cut(slice(0, final))
        pieces, cell = forward(
            asked[:final],
            done.length,
            done.stop,
            done.dwell,
            limit_v2,
            straight,
            acceleration,
            along,
            reach_v2,
            clock,
        )
        if not np.isfinite(clock[0]):
            stuck = int(cell[np.flatnonzero(~np.isfinite(pieces[:, 1]))[0]])
            raise InfeasibleError(
                "a single curved cell between two stops has no time law", line=int(done.line[stuck])
            )
        profile = profile_of(done, pieces, cell)
        if last:
            return None, profile
        rest = whole.cut(slice(final, None))
        limit_before = float(limit_v2[final - 1, 1]) if final else before.before_v2
        patience, passed = 2 * len(rest) + PATIENCE, before.passed + final
        return ScanState((rest,), frozen(clock), limit_before, patience, passed), profile

    return step


def scan_path(path: Path, limits: Sequence[Limits], path_limits: PathLimits = NO_PATH_LIMITS) -> Profile:
    """Plan the fastest motion along a whole path whose axes have no jerk limit.

    Every axis keeps its velocity and acceleration, ``|q'| du/dt`` in XYZ the feed rate (of the rotary axes
    where they move alone) and the `path_limits`.

    Raises
    ------
    InfeasibleError
        A move of an axis without velocity or acceleration, or without feed; names the line.
    """
    _, profile = scanning(limits, None, path_limits)(None, path, True)
    return profile


def rotary_only(path: Path) -> IntArray:
    """Mark the cells in which rotary axes move alone, (k,)."""
    return frozen_integers(path.stretch == 0.0)


def chord_feed_rate(path: Path, path_limits: PathLimits) -> FloatArray:
    """Feed rate of each cell, (k,) mm/s, at which chords keep their error on its tightest curve."""
    if path_limits.chord is None:
        return path.feed_rate
    return frozen(
        chord_speeds(path.coefficients, path.length, path.feed_rate, rotary_only(path), *path_limits.chord)
    )


def accelerations_along(path: Path, path_limits: PathLimits) -> FloatArray:
    """Return the limit of the acceleration along each cell, (k,) mm/s^2; (0,) where there is none."""
    if np.isinf(path_limits.acceleration):
        return frozen(np.empty(0))
    return frozen(np.where(path.stretch == 0.0, np.inf, path_limits.acceleration))


def gentle(
    path: Path, feed_rate: FloatArray, gentleness: FloatArray | None, passed: int
) -> tuple[FloatArray, FloatArray]:
    """What the scans plan for: a path whose derivatives, and whose accelerations with them, are larger.

    A cell with the factor g is planned as ``q/g`` at the feed ``F/sqrt(g)``: then ``q'' <= g a`` and the
    speed is at most ``sqrt(g) F``.
    """
    if gentleness is None:
        return path.coefficients, feed_rate
    factor = gentleness[passed : passed + len(path)]
    return frozen(path.coefficients / factor[:, None, None]), frozen(feed_rate / np.sqrt(factor))


def check_executable(path: Path, limits: Sequence[tuple[str, FloatArray]]) -> None:
    """Refuse a path without feed, or one that moves an axis whose limit is 0.

    Raises
    ------
    InfeasibleError
        Names the line.
    """
    if any(values.size != len(path.axes) for _, values in limits):
        raise ValueError(f"{limits[0][1].size} limits for the axes {path.axes}")
    moves = path.length > 0.0
    idle = moves & ~(path.feed_rate > 0.0)
    if idle.any():
        first = int(np.argmax(idle))
        raise InfeasibleError(
            f"a move with feed rate {path.feed_rate[first]:g}",
            hint="give F before it",
            line=int(path.line[first]),
        )
    for column, axis in enumerate(path.axes):
        for name, values in limits:
            if values[column] > 0.0:
                continue
            used: BoolArray = moves & (path.coefficients[:, 1:, column] != 0.0).any(axis=1)
            if used.any():
                raise InfeasibleError(
                    f"{axis.upper()} moves, but its {name} limit is {values[column]:g}",
                    hint=f"give the axis a {name} limit above 0",
                    line=int(path.line[int(np.argmax(used))]),
                )


def profile_of(path: Path, pieces: FloatArray, cell: IntArray) -> Profile:
    """Pieces (m,5) of constant acceleration, or (m,6) of constant jerk, as a profile of `path`."""
    time, duration, u, velocity, acceleration = (frozen(pieces[:, column]) for column in range(5))
    jerk = frozen(pieces[:, 5] if pieces.shape[1] > 5 else np.zeros(time.size))
    return Profile(path, time, duration, u, velocity, acceleration, jerk, frozen_integers(cell))


def _no_pieces(path: Path) -> Profile:
    return profile_of(path, np.empty((0, 5)), np.empty(0, np.int64))
