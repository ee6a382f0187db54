"""The time law of a path under a jerk limit.

The law is planned in windows that reach a few stopping distances ahead (`kernels/jerk_windows.py`); what
their law depends on is data, never chunks. An axis without a jerk limit is given one so high that its
acceleration rises within a microsecond.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.feedrate import (
    Profile,
    accelerations_along,
    check_executable,
    chord_feed_rate,
    gentle,
    profile_of,
    rotary_only,
)
from cnc_shape.kernels.jerk_pieces import timed
from cnc_shape.kernels.jerk_refine import close_to_fastest
from cnc_shape.kernels.jerk_windows import windows_law
from cnc_shape.kernels.path_limits import straight_along
from cnc_shape.kernels.speed_limits import speed_limits
from cnc_shape.limits import NO_PATH_LIMITS, Limits, PathLimits
from cnc_shape.smoothing import Path, join_paths

RISE_TIME = 1e-6  # s, in which an axis without jerk limit reaches its acceleration
TOLERANCES = frozen([1e-9, 5e-7, 5e-4])  # -, by which the law may exceed speed, acceleration and jerk
MOST_ROUNDS = 1000  # of lowering the limits of cells
WINDOW, LOOK_AHEAD = 4096, 4.0  # cells and stopping distances that are planned at once, at least
REFINED_AT_ONCE = 30_000.0  # nodes whose law is brought close to the fastest, counted again with every try
REFINED_LATER = 0.02  # -, of the cells that a program has passed: how many more
MOST_PARTS = 64  # that wait without being joined
PATIENCE = 1024  # cells that gather before a new attempt


@dataclass(frozen=True, eq=False, slots=True)
class JerkState:
    """Between two chunks: the cells whose law is not final, and what is known of it."""

    parts: tuple[Path, ...]
    clock: FloatArray  # (2,) s, its rounding error
    passed: int  # cells of the program before the first one
    patience: int  # cells to gather before the next attempt
    held: FloatArray  # (m,6) pieces of the window that is held back
    held_cell: IntArray  # (m,)
    marks: IntArray  # (2,) cells of it up to its joint, and up to its end; 0: there is none
    speeds: FloatArray  # (2,) at its start and at its joint
    counts: IntArray  # (6,) what planning has done so far (`kernels/jerk_windows.py`)


JerkStep: TypeAlias = Callable[[JerkState | None, Path, bool], tuple[JerkState | None, Profile]]


def jerk_limited(limits: Sequence[Limits]) -> bool:
    """Whether any axis has a jerk limit."""
    return any(np.isfinite(limit.jerk) for limit in limits)


def jerk_planning(
    limits: Sequence[Limits], gentleness: FloatArray | None = None, path_limits: PathLimits = NO_PATH_LIMITS
) -> JerkStep:
    """Return the resumable step from Path to Profile, as `planning.planning` does.

    Velocity, acceleration and feed are kept to 1e-6, jerk to 1e-3. It is not the fastest such motion: on
    straight lines it is, on curves it takes some percent longer; more where the acceleration along the path
    is limited, because then `close_to_fastest` leaves the law as the scans make it.
    """
    velocity = frozen([limit.velocity for limit in limits])
    acceleration = frozen([limit.acceleration for limit in limits])
    jerk = frozen([_jerk(limit) for limit in limits])

    def step(state: JerkState | None, path: Path, last: bool) -> tuple[JerkState | None, Profile]:
        check_executable(path, (("velocity", velocity), ("acceleration", acceleration), ("jerk", jerk)))
        before = state or _START
        parts = (*before.parts, path) if len(path) else before.parts
        if len(parts) > MOST_PARTS:
            parts = (join_paths(parts),)
        gathered = sum(len(part) for part in parts)
        if gathered == 0 or (not last and gathered < before.patience):
            waiting = None if last else replace(before, parts=parts)
            return waiting, profile_of(path.cut(slice(0, 0)), _NO_PIECES, _NO_CELLS)
        whole = join_paths(parts)
        asked, feed_rate = gentle(whole, chord_feed_rate(whole, path_limits), gentleness, before.passed)
        alone, clock = rotary_only(whole), before.clock.copy()
        marks, speeds, counts = before.marks.copy(), before.speeds.copy(), before.counts.copy()
        limit_v2, straight = speed_limits(asked, whole.length, feed_rate, alone, velocity, acceleration)
        along = accelerations_along(whole, path_limits)
        if along.size:
            straight = straight_along(asked, straight, along)
        pieces, cell, spans, held, held_cell, final = windows_law(
            asked, whole.length, whole.stop, whole.dwell, limit_v2, straight, along, acceleration, jerk,
            TOLERANCES, MOST_ROUNDS, last, WINDOW, LOOK_AHEAD, before.held.copy(), before.held_cell.copy(),
            marks, speeds, counts,
        )  # fmt: skip
        pieces, cell = close_to_fastest(
            pieces, cell, spans, asked, whole.length, limit_v2, straight, along, acceleration, jerk,
            TOLERANCES, counts, before.passed, REFINED_AT_ONCE, REFINED_LATER,
        )  # fmt: skip
        timed(pieces, clock)
        profile = profile_of(whole.cut(slice(0, final)), pieces, cell)
        if last:
            return None, profile
        rest = whole.cut(slice(final, None))
        now = JerkState(
            (rest,), frozen(clock), before.passed + final, 2 * len(rest) + PATIENCE, frozen(held),
            frozen_integers(held_cell), frozen_integers(marks), frozen(speeds), frozen_integers(counts),
        )  # fmt: skip
        return now, profile

    return step


def _jerk(limit: Limits) -> float:
    return min(limit.jerk, limit.acceleration / RISE_TIME)


_NO_PIECES, _NO_CELLS = np.empty((0, 6)), np.empty(0, np.int64)
_START = JerkState(
    (), frozen(np.zeros(2)), 0, 0, frozen(_NO_PIECES), frozen_integers(_NO_CELLS),
    frozen_integers(np.zeros(2, np.int64)), frozen(np.zeros(2)), frozen_integers(np.zeros(6, np.int64)),
)  # fmt: skip
