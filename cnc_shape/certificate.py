"""What a time law asks of the machine beyond its limits, looked for densely, whoever made the law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cnc_shape.feedrate import Profile, rotary_only
from cnc_shape.kernels.jerk_certificate import law_excesses
from cnc_shape.kernels.path_limits import path_excesses
from cnc_shape.limits import NO_PATH_LIMITS, Limits, PathLimits


@dataclass(frozen=True, slots=True)
class Violation:
    """What a time law asks of the machine beyond its limits; 0 or less where the promise is kept."""

    velocity: float  # -, largest relative excess over an axis's velocity
    acceleration: float  # -, the same for acceleration
    jerk: float  # -, the same for jerk; -1 without a limit
    feed: float  # -, the same for the feed rate
    gap: float  # mm or rad, largest jump of the path parameter between pieces
    jump: float  # mm/s or rad/s, largest jump of the path speed between pieces
    step: float  # mm/s^2 or rad/s^2, largest jump of the path acceleration between pieces
    line: int | None  # source line of the largest excess
    path_acceleration: float = -1.0  # -, as above for the acceleration along the path
    chord: float = -1.0  # -, the same for the speed at which chords keep their error

    @property
    def worst(self) -> float:
        """Largest relative excess over any limit but jerk."""
        return max(self.velocity, self.acceleration, self.feed, self.path_acceleration, self.chord)


def worst_violation(
    profile: Profile, limits: Sequence[Limits], points: int = 9, path_limits: PathLimits = NO_PATH_LIMITS
) -> Violation:
    """Evaluate a time law densely against the limits it promises to keep, and its pieces for gaps.

    Parameters
    ----------
    points
        Points in each piece, both ends included. There the acceleration is quadratic in the path parameter
        without a jerk limit; with one, the jerk is a polynomial of degree 6 in time.
    """
    path = profile.path
    bounds = np.array(
        [[getattr(limit, name) for limit in limits] for name in ("velocity", "acceleration", "jerk")]
    )
    worst, where = law_excesses(
        profile.duration, profile.u, profile.velocity, profile.acceleration, profile.jerk, profile.cell,
        path.coefficients, path.length, path.feed_rate, rotary_only(path), path.stop, bounds, points,
    )  # fmt: skip
    ratios, places = worst[:4], where[:4]
    if path_limits != NO_PATH_LIMITS:
        more, more_places = path_excesses(
            profile.duration, profile.u, profile.velocity, profile.acceleration, profile.jerk, profile.cell,
            path.coefficients, rotary_only(path), float(path_limits.acceleration),
            *(path_limits.chord or (0.0, 0.0)), points,
        )  # fmt: skip
        ratios, places = np.append(ratios, more), np.append(places, more_places)
    line = int(path.line[profile.cell[places[int(np.argmax(ratios))]]]) if len(profile) else None
    velocity, acceleration, jerk, feed, *along = (float(ratio) - 1.0 for ratio in ratios)
    gap, jump, step = (float(value) for value in worst[4:])
    return Violation(velocity, acceleration, jerk, feed, gap, jump, step, line, *along)
