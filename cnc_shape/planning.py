"""Planning: the time law of a path within every limit that its axes have.

Without a jerk limit it is the fastest there is (`feedrate.py`); with one, `jerk.py` keeps that as well.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias, cast

from cnc_shape.arrays import FloatArray
from cnc_shape.feedrate import Profile, ScanState, scanning
from cnc_shape.jerk import JerkState, jerk_limited, jerk_planning
from cnc_shape.limits import NO_PATH_LIMITS, Limits, PathLimits
from cnc_shape.smoothing import Path

PlanningState: TypeAlias = ScanState | JerkState
PlanningStep: TypeAlias = Callable[[PlanningState | None, Path, bool], tuple[PlanningState | None, Profile]]


def planning(
    limits: Sequence[Limits], gentleness: FloatArray | None = None, path_limits: PathLimits = NO_PATH_LIMITS
) -> PlanningStep:
    """Return the resumable step from Path to Profile: ``step(state, chunk, last) -> (state, profile)``.

    The profiles do not depend on how the path was cut into chunks. A step takes the states that it has made.

    Parameters
    ----------
    limits
        One per axis of the path, in the order of `path.axes`.
    gentleness
        One factor in (0, 1] for each cell of the program: of the accelerations, its square root of the feed.
    path_limits
        Of the motion along the path.
    """
    make = jerk_planning if jerk_limited(limits) else scanning
    return cast("PlanningStep", make(limits, gentleness, path_limits))


def plan(path: Path, limits: Sequence[Limits], path_limits: PathLimits = NO_PATH_LIMITS) -> Profile:
    """Plan a fast motion along a whole path.

    Every axis keeps its velocity, acceleration and jerk, ``|q'| du/dt`` in XYZ the feed rate (of the rotary
    axes where they move alone) and the `path_limits`. Without a jerk limit it is the fastest such motion.

    Raises
    ------
    InfeasibleError
        An axis moves whose velocity, acceleration or jerk limit is 0, or a move has no feed; names the line.
    """
    _, profile = planning(limits, None, path_limits)(None, path, True)
    return profile
