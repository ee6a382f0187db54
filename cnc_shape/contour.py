"""Contour error: the distance from a position to the programmed path.

Measured against the exact lines and arcs, never against sampled vertices, and only within a window of
the path (`windows`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.kernels.foot_point import feet, points_at
from cnc_shape.kernels.sums import add_squares
from cnc_shape.segments import Segments, path_table, segments
from cnc_shape.toolpath import Toolpath
from cnc_shape.units import MICROMETRE
from cnc_shape.windows import Reach, WindowState, windowing


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
    table = path_table(path)
    errors: list[ContourError] = []
    for signal in signals:
        points = frozen(signal[:, :3])
        distance, place, segment = feet(points, lower, upper, table)
        foot = points_at(frozen(place), frozen_integers(segment), table)
        errors.append(
            ContourError(frozen(distance), frozen(foot), frozen(place), frozen_integers(path.line[segment]))
        )
    return tuple(errors)


@dataclass(frozen=True, eq=False, slots=True)
class MeasuringState:
    """The windows under way, and the samples that wait for theirs."""

    windows: WindowState
    waiting: tuple[FloatArray, ...]  # (w,3) mm, one array a signal


def measuring(
    reach: Reach,
) -> Callable[
    [MeasuringState | None, Toolpath | None, FloatArray, Sequence[FloatArray], bool],
    tuple[MeasuringState, tuple[ContourError, ...]],
]:
    """Return the resumable stage that measures several signals against the same windows.

    Its step takes the toolpath that has come in (or None), the samples' places on it, one position array
    a signal, and whether that was all; it returns the errors of the samples whose windows are decided by
    now, in order, and the last step all that are left.
    """
    decide = windowing(reach)

    def step(
        state: MeasuringState | None,
        toolpath: Toolpath | None,
        arc_length: FloatArray,
        signals: Sequence[FloatArray],
        last: bool,
    ) -> tuple[MeasuringState, tuple[ContourError, ...]]:
        now, windows = decide(state and state.windows, toolpath, arc_length, last)
        waiting = [signal[:, :3] for signal in signals]
        if state is not None:
            waiting = [np.concatenate(pair) for pair in zip(state.waiting, waiting, strict=True)]
        decided = windows.lower.size
        errors = tuple(_NOTHING for _ in waiting)
        if decided:
            signals = [signal[:decided] for signal in waiting]
            errors = _measure(signals, windows.path, windows.lower, windows.upper)
        return MeasuringState(now, tuple(signal[decided:] for signal in waiting)), errors

    return step


_NOTHING = ContourError(
    frozen([]), frozen(np.zeros((0, 3))), frozen([]), frozen_integers(np.zeros(0, np.int64))
)
