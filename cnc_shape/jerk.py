"""The time law of a path under a jerk limit, and its certificate.

Between two stops the law is planned as a whole (`kernels/jerk_law.py`). An axis without a jerk limit is
given one so high that its acceleration rises within a microsecond; where no axis has one, the law without
jerk limit (`feedrate.py`) is the answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray, frozen, frozen_integers
from cnc_shape.errors import InfeasibleError
from cnc_shape.feedrate import Profile, check_executable, plan, rotary_only
from cnc_shape.kernels.jerk_certificate import law_excesses
from cnc_shape.kernels.jerk_law import path_law
from cnc_shape.kernels.jerk_pieces import timed
from cnc_shape.kernels.speed_limits import speed_limits
from cnc_shape.limits import Limits
from cnc_shape.smoothing import Path

RISE_TIME = 1e-6  # s, in which an axis without jerk limit reaches its acceleration
TOLERANCES = frozen([1e-9, 5e-7, 5e-4])  # -, by which the law may exceed speed, acceleration and jerk
MOST_ROUNDS = 100  # of lowering the limits of cells


@dataclass(frozen=True, slots=True)
class JerkViolation:
    """What a time law asks of the machine beyond its limits; 0 or less where the promise is kept."""

    velocity: float  # -, largest relative excess over an axis's velocity
    acceleration: float  # -, the same for acceleration
    jerk: float  # -, the same for jerk
    feed: float  # -, the same for the feed rate
    gap: float  # mm or rad, largest jump of the path parameter between pieces
    jump: float  # mm/s or rad/s, largest jump of the path speed between pieces
    step: float  # mm/s^2 or rad/s^2, largest jump of the path acceleration between pieces
    line: int | None  # source line of the largest excess

    @property
    def worst(self) -> float:
        """Largest relative excess over velocity, acceleration or feed."""
        return max(self.velocity, self.acceleration, self.feed)


def plan_jerk(path: Path, limits: Sequence[Limits]) -> Profile:
    """Plan a fast motion along a whole path that keeps every axis's velocity, acceleration, jerk, and feed.

    Velocity, acceleration and feed are kept to 1e-6, jerk to 1e-3. Not the fastest such motion: on straight
    lines it is, on curves it takes some percent longer.

    Raises
    ------
    InfeasibleError
        A move of an axis without velocity, acceleration or jerk, or without feed; or a section between two
        stops for which no law was found. Names the line.
    """
    if all(np.isinf(limit.jerk) for limit in limits):
        return plan(path, limits)
    velocity = frozen([limit.velocity for limit in limits])
    acceleration = frozen([limit.acceleration for limit in limits])
    jerk = frozen([_jerk(limit) for limit in limits])
    check_executable(path, (("velocity", velocity), ("acceleration", acceleration), ("jerk", jerk)))
    alone = rotary_only(path)
    limit_v2, straight = speed_limits(
        path.coefficients, path.length, path.feed_rate, alone, velocity, acceleration
    )
    pieces, cell, stuck = path_law(
        path.coefficients, path.length, path.stop, path.dwell, path.feed_rate, alone, limit_v2, straight,
        velocity, acceleration, jerk, TOLERANCES, MOST_ROUNDS,
    )  # fmt: skip
    if stuck >= 0:
        raise InfeasibleError("no time law keeps the jerk limit here", line=int(path.line[stuck]))
    timed(pieces)
    return _profile(path, pieces, cell)


def jerk_violation(profile: Profile, limits: Sequence[Limits], points: int = 129) -> JerkViolation:
    """Evaluate a time law densely against the limits it promises to keep, and its pieces for gaps.

    Parameters
    ----------
    points
        Points in each piece, both ends included. The jerk is a polynomial of degree 6 in time there.
    """
    path = profile.path
    bounds = np.array(
        [[getattr(limit, name) for limit in limits] for name in ("velocity", "acceleration", "jerk")]
    )
    worst, where = law_excesses(
        profile.duration, profile.u, profile.velocity, profile.acceleration, profile.jerk, profile.cell,
        path.coefficients, path.length, path.feed_rate, rotary_only(path), path.stop, bounds, points,
    )  # fmt: skip
    line = int(path.line[profile.cell[where[int(np.argmax(worst[:4]))]]]) if len(profile) else None
    velocity, acceleration, jerk, feed = (float(ratio) - 1.0 for ratio in worst[:4])
    gap, jump, step = (float(value) for value in worst[4:])
    return JerkViolation(velocity, acceleration, jerk, feed, gap, jump, step, line)


def _jerk(limit: Limits) -> float:
    return min(limit.jerk, limit.acceleration / RISE_TIME)


def _profile(path: Path, pieces: FloatArray, cell: FloatArray) -> Profile:
    time, duration, u, velocity, acceleration, jerk = (frozen(pieces[:, column]) for column in range(6))
    return Profile(path, time, duration, u, velocity, acceleration, jerk, frozen_integers(cell))
