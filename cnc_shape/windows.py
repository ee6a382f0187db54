"""Windows: the stretch of the programmed path that a sample can be meant to be on.

A window is one of time: at sample k it reaches from the place that the command had `back` samples ago to
the one it has `ahead` samples on. A position loop of gain Kp follows what it was told over the last few
1/Kp, a shaper mixes what was commanded within its duration, so nothing else of the path can be meant. A
window of fixed length would do at constant feed only: at a corner, where a machine creeps, it would reach
around to the next side, and on a raster across to the neighbouring line, and find a small distance to a
place that the tool is not due at. In time it shrinks where the machine slows down.
What loads may push the drives along the path knows no time, and is added in mm.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.segments import NO_SEGMENTS, Segments, join, segments, since
from cnc_shape.toolpath import Toolpath

MARGIN = 0.5  # mm, of a window on both sides
LOOPS_BACK = 4.0  # of the position loop's time constant 1/Kp
LOOPS_AHEAD = 1.5  # of the position loop's time constant 1/Kp
BACKTRACK = 0.1  # mm of path kept for commands that run backwards by rounding, or between samples


@dataclass(frozen=True, slots=True)
class Reach:
    """How far a window reaches from a sample's own place on the path."""

    back: int  # samples
    ahead: int  # samples
    margin: float  # mm, added on both sides


def foot_reach(settling: float, longest: float, sample_time: float, pushed: float = 0.0) -> Reach:
    """How far a sample's foot point may be from its own place on the path.

    settling: time constant of the position loop, s, 0 for ideal drives; longest: of the shapers' delays, s;
    pushed: how far loads may push the drives along the path, mm.
    """
    back, ahead = LOOPS_BACK * settling + longest, LOOPS_AHEAD * settling + longest
    return Reach(ceil(back / sample_time) + 1, ceil(ahead / sample_time) + 1, MARGIN + pushed)


@dataclass(frozen=True, eq=False, slots=True)
class WindowState:
    """What later samples still need: path within reach, places before and of those waiting."""

    path: Segments
    arc_length: FloatArray  # (back + w,) mm


@dataclass(frozen=True, eq=False, slots=True)
class Windows:
    """The windows that are decided by now, in order, and the path they lie on."""

    path: Segments
    lower: FloatArray  # (n,) mm of path
    upper: FloatArray  # (n,) mm of path


def windowing(
    reach: Reach,
) -> Callable[[WindowState | None, Toolpath | None, FloatArray, bool], tuple[WindowState, Windows]]:
    """Return the resumable stage from places on the path to windows.

    Its step takes the toolpath that has come in (or None), the samples' places on it, and whether that was
    all. The toolpath must come before the samples that run on it. A window is decided `ahead` samples
    later, and when the path has arrived that far; so each step returns the windows decided by now, and the
    last step all that are left.
    """
    back, ahead, margin = reach.back, reach.ahead, reach.margin

    def step(
        state: WindowState | None, toolpath: Toolpath | None, arc_length: FloatArray, last: bool
    ) -> tuple[WindowState, Windows]:
        path = NO_SEGMENTS if state is None else state.path
        if toolpath is not None and len(toolpath):
            path = join(path, segments(toolpath, first=path.low.size == 0))
        before = frozen([]) if state is None else state.arc_length
        if before.size == 0 and arc_length.size:
            before = np.full(back, arc_length[0])
        places = np.concatenate([before, arc_length])
        samples = max(places.size - back, 0)
        if last and samples:
            places = np.concatenate([places, np.full(ahead, places[-1])])
        upper = places[back + ahead :] + margin
        decided = upper.size
        if not last and decided:
            # a move still to come may begin at the very end of those that are here: beyond, not at it
            arrived = path.high[-1] if path.low.size else -np.inf
            reached = upper < arrived
            decided = decided if reached.all() else int(reached.argmin())
        windows = Windows(path, frozen(places[:decided] - margin), frozen(upper[:decided]))
        if samples:  # no later window begins before that of the next sample
            following = float(places[min(decided, samples + back - 1)])
            path = since(path, following - margin - BACKTRACK)
        return WindowState(path, frozen(places[decided : samples + back])), windows

    return step


def foot_windows(
    arc_length: FloatArray, back: int, ahead: int, margin: float
) -> tuple[FloatArray, FloatArray]:
    """Window of every sample of a whole motion: lower and upper end, (n,) mm of path each.

    Parameters
    ----------
    arc_length
        (n,) mm, place of each sample's command on the toolpath; it never runs back by more than `BACKTRACK`.
    back, ahead
        Samples.
    margin
        mm, added on both sides.
    """
    rows = np.arange(arc_length.size)
    lower = arc_length[np.maximum(rows - back, 0)] - margin
    upper = arc_length[np.minimum(rows + ahead, arc_length.size - 1)] + margin
    return lower, upper
