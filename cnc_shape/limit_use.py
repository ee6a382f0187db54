"""Limit use: what the planned motion asks of every axis, as a share of its limits, in memory that is fixed.

The time law is evaluated as it comes, piece by piece: with the derivatives of the path, ``q'``, ``q''`` and
``q'''``, and those of the path parameter, v, a and b, an axis has ::

    velocity = q' v      acceleration = q' a + q'' v^2      jerk = q' b + 3 q'' v a + q''' v^3

A million blocks make millions of pieces. So what is kept is the largest of each quantity in buckets of time
and, beside them, in buckets of path; all buckets double their width whenever the motion outgrows them
(`kernels/limit_use.py`). The largest use of every limit stays with its source line, whatever the buckets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import BoolArray, FloatArray, IntArray, frozen
from cnc_shape.feedrate import Profile, rotary_only
from cnc_shape.kernels.limit_use import drawn_points, fold_pieces
from cnc_shape.limits import Limits
from cnc_shape.machine import Machine
from cnc_shape.motion import Block
from cnc_shape.recording.extremes import Extremes
from cnc_shape.timing import PLAIN

BUCKETS = 4096  # a power of two; at least half of them are in use
DRAWN_BUCKETS = 8192  # of the path, each of up to eight points
FIRST_WIDTH = 2.0**-20  # s or mm, of a bucket at the start


@dataclass(frozen=True, slots=True)
class Peak:
    """The largest use of one limit."""

    share: float  # -, of the limit
    line: int  # first source line that has it


@dataclass(frozen=True, slots=True)
class AxisUse:
    """The largest use of one axis's limits."""

    axis: str
    velocity: Peak
    acceleration: Peak
    jerk: Peak | None  # None: the axis has no jerk limit


@dataclass(frozen=True, eq=False, slots=True)
class Course:
    """Use of the limits in buckets of equal width, over time or along the path; nan where nothing is."""

    width: float  # s or mm
    fastest: FloatArray  # (k,) mm/s, of the tool in XYZ
    slowest: FloatArray  # (k,) mm/s
    feed_rate: FloatArray  # (k,) mm/s, highest that is programmed; inf in rapids, nan where no XYZ moves
    velocity: FloatArray  # (k,d) -, largest share of the limit
    acceleration: FloatArray  # (k,d) -
    jerk: FloatArray  # (k,d) -, 0 without a limit
    reached: FloatArray  # (k,) mm of path over time, s along the path, at the end of each bucket

    @property
    def at(self) -> FloatArray:
        """Middles of the buckets, (k,) s or mm."""
        return frozen((np.arange(self.fastest.size) + 0.5) * self.width)


@dataclass(frozen=True, eq=False, slots=True)
class LimitUse:
    """What a planned motion makes of the machine's limits and of the programmed feed."""

    axes: tuple[AxisUse, ...]  # those that move, in the order of the columns of the courses
    feed: Peak | None  # None: all is rapid
    over_time: Course
    along_path: Course
    path: FloatArray  # (p,3) mm, the planned path to draw
    speed: FloatArray  # (p-1,) mm/s, mean from point to point
    rapid: BoolArray  # (p-1,) where no feed is programmed from point to point

    @property
    def travels(self) -> bool:
        """Whether anything moves in XYZ."""
        return bool(np.ptp(self.path, axis=0).any())


class LimitWatch:
    """An observer of blocks that keeps what the plain motion asks of the limits of `machine`."""

    def __init__(self, machine: Machine, buckets: int = BUCKETS, drawn: int = DRAWN_BUCKETS) -> None:
        self._machine = machine
        self._buckets = buckets
        self._widths = np.full(2, FIRST_WIDTH)
        self._points = Extremes(_outstanding, 8, 7, drawn)
        self._axes: tuple[str, ...] = ()
        self._moved: tuple[str, ...] = ()

    def advance(self, block: Block) -> None:
        """Take the next block; only what was planned without a thought for shaping counts."""
        if block.profile is None or block.timing != PLAIN:
            return
        self._moved = block.moved
        self.add(block.profile)

    def add(self, profile: Profile) -> None:
        """Take the next stretch of the time law."""
        path = profile.path
        if not self._axes:
            self._begin(path.axes)
        law = (
            profile.time, profile.duration, profile.u, profile.velocity, profile.acceleration, profile.jerk,
            profile.cell, path.coefficients, path.feed_rate,
        )  # fmt: skip
        fold_pieces(
            *law, rotary_only(path), path.arc_length, path.stretch, path.line, self._widths, self._over_time,
            self._along_path, self._peaks, self._lines,
        )  # fmt: skip
        self._points.add(drawn_points(*law, path.arc_length, path.stretch))

    def found(self) -> LimitUse | None:
        """What was asked of the limits; None where nothing was planned. Call it after the last block."""
        if not self._axes:
            return None
        limits = [axis.limits for axis in self._machine.with_axes(self._axes).axes]
        columns = [k for k, axis in enumerate(self._axes) if axis in self._moved]
        rows = self._points.rows()[1]
        return LimitUse(
            axes=tuple(self._axis_use(k, limits[k]) for k in columns),
            feed=Peak(float(self._peaks[0]), int(self._lines[0])) if self._peaks[0] > 0.0 else None,
            over_time=_course(self._over_time, float(self._widths[0]), limits, columns),
            along_path=_course(self._along_path, float(self._widths[1]), limits, columns),
            path=frozen(rows[:, :3]),
            speed=frozen(np.diff(rows[:, 4]) / np.maximum(np.diff(rows[:, 5]), 1e-12)),
            rapid=(rows[:-1, 6] > 0.0) & (rows[1:, 6] > 0.0),
        )

    def _begin(self, axes: tuple[str, ...]) -> None:
        self._axes = axes
        columns = 4 + 3 * len(axes)
        self._over_time = np.full((self._buckets, columns), -np.inf)
        self._along_path = np.full((self._buckets, columns), -np.inf)
        self._peaks = np.zeros(columns - 3)
        self._lines: IntArray = np.zeros(columns - 3, np.int64)

    def _axis_use(self, column: int, limits: Limits) -> AxisUse:
        peaks, lines = self._peaks[1:].reshape(3, -1), self._lines[1:].reshape(3, -1)
        velocity, acceleration, jerk = (
            Peak(float(peaks[n, column] / limit), int(lines[n, column]))
            for n, limit in enumerate((limits.velocity, limits.acceleration, limits.jerk))
        )
        bounded = np.isfinite(limits.jerk)
        return AxisUse(self._axes[column], velocity, acceleration, jerk if bounded else None)


def _course(buckets: FloatArray, width: float, limits: Sequence[Limits], columns: Sequence[int]) -> Course:
    """Buckets as shares of the limits, as far as the motion goes."""
    seen = np.flatnonzero(buckets[:, 0] > -np.inf)
    rows = buckets[: seen[-1] + 1 if seen.size else 0].copy()
    feed_rate = np.where(rows[:, 2] > -np.inf, rows[:, 2], np.nan)
    rows[rows[:, 0] == -np.inf] = np.nan
    uses = rows[:, 4:].reshape(rows.shape[0], 3, -1)
    velocity, acceleration, jerk = (
        frozen((uses[:, n] / np.array([getattr(limit, name) for limit in limits]))[:, columns])
        for n, name in enumerate(("velocity", "acceleration", "jerk"))
    )
    return Course(
        width,
        frozen(rows[:, 0]),
        frozen(-rows[:, 1]),
        frozen(feed_rate),
        velocity,
        acceleration,
        jerk,
        frozen(rows[:, 3]),
    )


def _outstanding(points: FloatArray) -> FloatArray:
    """What makes a drawn point worth keeping: it lies outermost, or is fastest or slowest."""
    return np.vstack([points[:, :4].T, -points[:, :4].T])
