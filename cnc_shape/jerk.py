"""The time law of a path under a jerk limit.

Between two stops the law is planned as a whole (`kernels/jerk_law.py`): a chunk is planned up to its last
stop, and what follows waits. An axis without a jerk limit is given one so high that its acceleration rises
within a microsecond.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.errors import InfeasibleError
from cnc_shape.feedrate import Profile, check_executable, chord_feed_rate, gentle, rotary_only
from cnc_shape.kernels.jerk_law import path_law
from cnc_shape.kernels.jerk_pieces import timed
from cnc_shape.kernels.speed_limits import speed_limits
from cnc_shape.limits import NO_PATH_LIMITS, Limits, PathLimits
from cnc_shape.smoothing import Path, join_paths

RISE_TIME = 1e-6  # s, in which an axis without jerk limit reaches its acceleration
TOLERANCES = frozen([1e-9, 5e-7, 5e-4])  # -, by which the law may exceed speed, acceleration and jerk
MOST_ROUNDS = 100  # of lowering the limits of cells
MOST_REFINED = 100_000  # cells between two stops whose law is brought close to the fastest one


@dataclass(frozen=True, eq=False, slots=True)
class JerkState:
    """Between two chunks: the cells behind the last stop, and when they begin."""

    parts: tuple[Path, ...]
    clock: FloatArray  # (2,) s, its rounding error
    passed: int  # cells of the program before the first one


JerkStep: TypeAlias = Callable[[JerkState | None, Path, bool], tuple[JerkState | None, Profile]]


def jerk_limited(limits: Sequence[Limits]) -> bool:
    """Whether any axis has a jerk limit."""
    return any(np.isfinite(limit.jerk) for limit in limits)


def jerk_planning(
    limits: Sequence[Limits], gentleness: FloatArray | None = None, path_limits: PathLimits = NO_PATH_LIMITS
) -> JerkStep:
    """Return the resumable step from Path to Profile, as `planning.planning` does.

    Velocity, acceleration and feed are kept to 1e-6, jerk to 1e-3. It is not quite the fastest such motion:
    on straight lines it is, on curves it takes 1 to 4 % longer, and up to 15 % where cells follow each other
    in less than two milliseconds (`kernels/jerk_refine.py`).
    """
    velocity = frozen([limit.velocity for limit in limits])
    acceleration = frozen([limit.acceleration for limit in limits])
    jerk = frozen([_jerk(limit) for limit in limits])

    def step(state: JerkState | None, path: Path, last: bool) -> tuple[JerkState | None, Profile]:
        check_executable(path, (("velocity", velocity), ("acceleration", acceleration), ("jerk", jerk)))
        before = state or JerkState((), frozen(np.zeros(2)), 0)
        whole = join_paths((*before.parts, path)) if before.parts else path
        stops = np.flatnonzero(whole.stop)
        final = len(whole) if last else int(stops[-1]) if stops.size else 0
        done = whole.cut(slice(0, final))
        asked, feed_rate = gentle(done, chord_feed_rate(done, path_limits), gentleness, before.passed)
        alone, clock = rotary_only(done), before.clock.copy()
        limit_v2, straight = speed_limits(asked, done.length, feed_rate, alone, velocity, acceleration)
        pieces, cell, stuck = path_law(
            asked, done.length, done.stop, done.dwell, feed_rate, alone, limit_v2, straight, velocity,
            acceleration, jerk, TOLERANCES, MOST_ROUNDS, MOST_REFINED,
        )  # fmt: skip
        if stuck >= 0:
            raise InfeasibleError("no time law keeps the jerk limit here", line=int(done.line[stuck]))
        timed(pieces, clock)
        profile = _profile(done, pieces, cell)
        if last:
            return None, profile
        return JerkState((whole.cut(slice(final, None)),), frozen(clock), before.passed + final), profile

    return step


def _jerk(limit: Limits) -> float:
    return min(limit.jerk, limit.acceleration / RISE_TIME)


def _profile(path: Path, pieces: FloatArray, cell: IntArray) -> Profile:
    time, duration, u, velocity, acceleration, jerk = (frozen(pieces[:, column]) for column in range(6))
    return Profile(path, time, duration, u, velocity, acceleration, jerk, frozen_integers(cell))
