"""Contour error: the distance from a position to the programmed path.

Measured against the exact lines and arcs, never against sampled vertices, and only within a window of
the path. The window is one of time: at sample k it reaches from the place that the command had `back`
samples ago to the one it has `ahead` samples on. A position loop of gain Kp follows what it was told
over the last few 1/Kp, a shaper mixes what was commanded within its duration, so nothing else of the
path can be meant. A window of fixed length would do at constant feed only: at a corner, where a machine
creeps, it would reach around to the next side, and on a raster across to the neighbouring line, and find
a small distance to a place that the tool is not due at. In time it shrinks where the machine slows down.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.kernels.foot_point import feet, pack, points_at, stack_boxes
from cnc_shape.kernels.sums import add_squares
from cnc_shape.segments import NO_SEGMENTS, Segments, join, segments, since
from cnc_shape.toolpath import Toolpath
from cnc_shape.units import MICROMETRE

BACKTRACK = 0.1  # mm of path kept for commands that run backwards by rounding, or between samples


@dataclass(frozen=True, eq=False, slots=True)
class ContourError:
    """Distance of every sample to the programmed geometry and its foot point there."""

    distance: FloatArray  # (n,) mm, >= 0
    foot: FloatArray  # (n,3) mm
    arc_length: FloatArray  # (n,) mm, of the foot point on the toolpath
    line: IntArray  # (n,) source line of the foot's segment

    @property
    def rms(self) -> float:
        """Root mean square over all samples, mm."""
        return tally(Tally(), self).rms

    @property
    def max(self) -> float:
        """Largest distance, mm."""
        return float(self.distance.max(initial=0.0))

    def summary(self) -> str:
        """RMS, maximum and its source line, in one line."""
        found = tally(Tally(), self)
        place = "" if found.line is None else f", line {found.line}"
        rms, highest = found.rms / MICROMETRE, found.max / MICROMETRE
        return f"contour error {rms:.3g} µm RMS, {highest:.3g} µm at most{place}"


@dataclass(frozen=True, slots=True)
class Tally:
    """Running sums of a contour error; they do not depend on how it was cut into chunks."""

    count: int = 0
    sum_squares: float = 0.0  # mm^2
    max: float = 0.0  # mm
    line: int | None = None  # source line of the first place where the maximum is reached

    @property
    def rms(self) -> float:
        """Root mean square, mm."""
        return sqrt(self.sum_squares / self.count) if self.count else 0.0


def tally(state: Tally, error: ContourError) -> Tally:
    """Add the next samples to a tally."""
    if error.distance.size == 0:
        return state
    total = np.array([state.sum_squares])
    add_squares(error.distance[:, None], total)
    worst = int(error.distance.argmax())
    highest = float(error.distance[worst])
    beyond = highest > state.max or state.line is None
    return Tally(
        state.count + error.distance.size,
        float(total[0]),
        highest if beyond else state.max,
        int(error.line[worst]) if beyond else state.line,
    )


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


def contour_error(
    position: FloatArray,
    toolpath: Toolpath,
    lower: FloatArray | None = None,
    upper: FloatArray | None = None,
) -> ContourError:
    """Distance of positions to the toolpath, each within its own window.

    Parameters
    ----------
    position
        (n, >= 3) mm; x, y, z come first.
    toolpath
        The programmed path. Moves without XYZ travel are passed over. Open paths clamp at their ends.
    lower, upper
        (n,) mm, window on ``toolpath.arc_length``, from `foot_windows`; None: no bound.

    Raises
    ------
    ValueError
        An empty toolpath, or arrays of unlike length.
    """
    everywhere = np.full(position.shape[0], np.inf)
    lower = -everywhere if lower is None else lower
    upper = everywhere if upper is None else upper
    if not lower.shape == upper.shape == position.shape[:1]:
        raise ValueError(f"{position.shape=} {lower.shape=} {upper.shape=}")
    (error,) = _measure((position,), segments(toolpath, first=True), frozen(lower), frozen(upper))
    return error


def _measure(
    signals: Sequence[FloatArray], path: Segments, lower: FloatArray, upper: FloatArray
) -> tuple[ContourError, ...]:
    """Contour error of every signal, (n, >= 3) mm each, in the same windows."""
    if path.low.size == 0:
        raise ValueError("a contour error needs a path")
    table = frozen(pack(path.start, path.end, path.low, path.high, path.arc))
    tree, first = stack_boxes(path.boxes)
    errors: list[ContourError] = []
    for signal in signals:
        points = frozen(signal[:, :3])
        distance, place, segment = feet(
            points, lower, upper, table, path.low, path.high, path.arcs, path.boxes, tree, first
        )
        foot = points_at(
            frozen(place), frozen_integers(segment),
            path.start, path.end, path.low, path.high, path.arc, path.arcs,
        )  # fmt: skip
        errors.append(
            ContourError(frozen(distance), frozen(foot), frozen(place), frozen_integers(path.line[segment]))
        )
    return tuple(errors)


@dataclass(frozen=True, eq=False, slots=True)
class MeasuringState:
    """What later samples still need: path within reach, samples that wait for what lies ahead."""

    path: Segments
    arc_length: FloatArray  # (back + w,) mm, of the samples before and of those waiting
    waiting: tuple[FloatArray, ...]  # (w,3) mm, one array a signal


def measuring(
    back: int, ahead: int, margin: float
) -> Callable[
    [MeasuringState | None, Toolpath | None, FloatArray, Sequence[FloatArray], bool],
    tuple[MeasuringState, tuple[ContourError, ...]],
]:
    """Return the resumable stage that measures several signals against the same windows.

    Its step takes the toolpath that has come in (or None), the samples' places on it, one position array
    a signal, and whether that was all. The toolpath must come before the samples that run on it. A sample
    is decided when its window is: `ahead` samples later, and when the path has arrived that far; so each
    step returns the errors of the samples decided by now, in order, and the last step all that are left.
    """

    def step(
        state: MeasuringState | None,
        toolpath: Toolpath | None,
        arc_length: FloatArray,
        signals: Sequence[FloatArray],
        last: bool,
    ) -> tuple[MeasuringState, tuple[ContourError, ...]]:
        path = NO_SEGMENTS if state is None else state.path
        if toolpath is not None and len(toolpath):
            path = join(path, segments(toolpath, first=path.low.size == 0))
        if state is None:
            before = np.full(back if arc_length.size else 0, arc_length[0] if arc_length.size else 0.0)
            waiting = [signal[:, :3] for signal in signals]
        else:
            before = state.arc_length
            if before.size == 0 and arc_length.size:
                before = np.full(back, arc_length[0])
            waiting = [
                np.concatenate([old, new[:, :3]]) for old, new in zip(state.waiting, signals, strict=True)
            ]
        places = np.concatenate([before, arc_length])
        samples = waiting[0].shape[0]
        if last and samples:
            places = np.concatenate([places, np.full(ahead, places[-1])])
        upper = places[back + ahead :] + margin
        decided = upper.size
        if not last and decided:
            # a move still to come may begin at the very end of those that are here: beyond, not at it
            arrived = path.high[-1] if path.low.size else -np.inf
            reached = upper < arrived
            decided = decided if reached.all() else int(reached.argmin())
        windows = frozen(places[:decided] - margin), frozen(upper[:decided])
        errors = tuple(_NOTHING for _ in waiting)
        if decided:
            errors = _measure([signal[:decided] for signal in waiting], path, *windows)
        if samples:  # no later window begins before that of the next sample
            following = float(places[min(decided, samples + back - 1)])
            path = since(path, following - margin - BACKTRACK)
        places = places[decided : samples + back]
        return MeasuringState(path, places, tuple(signal[decided:] for signal in waiting)), errors

    return step


_NOTHING = ContourError(
    frozen([]), frozen(np.zeros((0, 3))), frozen([]), frozen_integers(np.zeros(0, np.int64))
)
