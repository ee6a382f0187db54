"""Path: the toolpath made C2 within its tolerance.

The toolpath becomes a polyline (`polyline.py`), and the polyline a sum of itself and one hat a vertex
(`kernels/hats.py`). The widths of the hats depend on their neighbours, their neighbours' neighbours and
so on, but not beyond a reach that the longest hat and the number of rounds set. So a chunk is planned
with a margin of that reach on both sides; what lies in the margin ahead waits for the next chunk.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import TypeAlias

import numpy as np

from cnc_shape.arrays import BoolArray, FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.errors import OptionError
from cnc_shape.kernels.cells import cells
from cnc_shape.kernels.hats import LONGEST_BLEND, LONGEST_BLEND_RATIO, ROUNDS, TICK, edges, turns, widths
from cnc_shape.polyline import Merging, Polyline, PolylineState, join, polyline
from cnc_shape.toolpath import Toolpath

PATIENCE = 1024  # edges that gather before a new attempt, so that short chunks do not repeat the margins


@dataclass(frozen=True, eq=False, slots=True)
class Path:
    """A chunk of the C2 path: cubic cells over the path parameter u, d axes.

    In cell k, ``q(e) = c0 + c1 e + c2 e^2 + c3 e^3`` with ``e = u - u[k]``, ``0 <= e <= length[k]``.
    u is XYZ travel in mm where XYZ moves, rad where rotary axes move alone (`stretch` is 0 there), and
    restarts at every stop. Cells follow each other; the last one of a program has length 0 and is a stop
    at the end point.
    """

    axes: tuple[str, ...]
    u: FloatArray  # (k,) path parameter at the cell's start, from the last stop
    length: FloatArray  # (k,) of the cell in u
    coefficients: FloatArray  # (k,4,d)
    feed_rate: FloatArray  # (k,) mm/s or rad/s, ceiling; inf: none but the axes
    stop: BoolArray  # (k,) the path rests at the cell's start
    dwell: FloatArray  # (k,) s, waiting at the cell's start (only where stop)
    arc_length: FloatArray  # (k,) mm, place on the toolpath that belongs to the cell's start
    stretch: FloatArray  # (k,) d(toolpath arc length)/du within the cell
    line: IntArray  # (k,)

    def __len__(self) -> int:
        return self.u.size

    def cut(self, cells: slice) -> Path:
        """Return a view of some cells."""
        columns = [getattr(self, field.name)[cells] for field in fields(self)[1:]]
        return Path(self.axes, *columns)


def join_paths(parts: Sequence[Path]) -> Path:
    """Join consecutive chunks of one path."""
    if len(parts) == 1:
        return parts[0]
    columns = [np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Path)[1:]]
    for column in columns:
        column.setflags(write=False)
    return Path(parts[0].axes, *columns)


@dataclass(frozen=True, slots=True)
class Smoothing:
    """How far the path may leave the program.

    Raises
    ------
    OptionError
        A tolerance that is not positive, or a share outside [0, 0.5].
    """

    path_tolerance: float  # mm, deviation, where the program names none
    merge_share: float = 0.1  # -, of the path tolerance, for chords over short lines
    noise_share: float = 0.5  # -, the same over lines that turn to and fro

    def __post_init__(self) -> None:
        if not self.path_tolerance > 0.0:
            raise OptionError(
                f"a path tolerance must be positive, not {self.path_tolerance} mm",
                hint="an exact path is programmed with G61",
            )
        for share in (self.merge_share, self.noise_share):
            if not 0.0 <= share <= 0.5:
                raise OptionError(f"a share of the path tolerance must be between 0 and 0.5, not {share}")


@dataclass(frozen=True, eq=False, slots=True)
class SmoothingState:
    """Between two chunks: edges that are not yet cells, with their neighbours behind."""

    polyline: PolylineState | None
    parts: tuple[Polyline, ...]  # consecutive; the first `done` edges are cells already
    done: int
    origin: int  # ticks from the last stop to the first edge
    patience: int  # edges to gather before the next attempt


SmoothingStep: TypeAlias = Callable[
    [SmoothingState | None, Toolpath, bool], tuple[SmoothingState | None, Path]
]


def smoothing(settings: Smoothing) -> SmoothingStep:
    """Return the resumable step from Toolpath to Path: ``step(state, chunk, last) -> (state, path)``.

    `state` is None at the start, and after the chunk that is `last`. The cells do not depend on how the
    toolpath was cut into chunks. What a step holds back is bounded by travel: at most a few hundred times
    the longest blend.
    """
    straighten = polyline(Merging(settings.path_tolerance, settings.merge_share, settings.noise_share))

    def step(
        state: SmoothingState | None, toolpath: Toolpath, last: bool
    ) -> tuple[SmoothingState | None, Path]:
        before = state or SmoothingState(None, (), 0, 0, PATIENCE)
        inner, chunk = straighten(before.polyline, toolpath, last)
        parts = (*before.parts, chunk) if len(chunk) else before.parts
        gathered = sum(len(part) for part in parts)
        if gathered == 0 or (not last and gathered < before.patience):
            waiting = (
                None if last else SmoothingState(inner, parts, before.done, before.origin, before.patience)
            )
            return waiting, _no_cells(toolpath.axes)
        path, rest, done, origin = _advance(toolpath.axes, join(parts), before.done, before.origin, last)
        if last:
            return None, path
        return SmoothingState(inner, (rest,), done, origin, 2 * len(rest) + PATIENCE), path

    return step


def smooth(toolpath: Toolpath, settings: Smoothing) -> Path:
    """Make a whole toolpath C2 within its tolerance.

    Lines are left by at most the path tolerance, arcs likewise; stops and ends are met exactly. A stop is
    where the program asks for one, where it turns by more than 165 degrees, where an exact path turns,
    and at both ends of a move of rotary axes alone.
    """
    _, path = smoothing(settings)(None, toolpath, True)
    return path


def _advance(
    axes: tuple[str, ...], line: Polyline, done: int, origin: int, last: bool
) -> tuple[Path, Polyline, int, int]:
    """Cells of all edges from `done` on that nothing to come can change; and the edges to keep."""
    ticks, tangent = edges(line.start, line.end, line.alone)
    u: IntArray = np.cumsum(ticks) - ticks
    turn, twist = turns(tangent, line.stop)
    width = widths(u, line.tolerance, turn, twist, line.stop)
    stops = np.flatnonzero(line.stop)
    longest = min(LONGEST_BLEND, LONGEST_BLEND_RATIO * float(line.tolerance.max()))
    reach = int((LONGEST_BLEND + (4 * ROUNDS + 8) * longest) / TICK)
    finish = len(line)
    if not last:
        settled = int((u <= u[-1] - reach).sum()) - 1
        finish = max(done, settled, int(stops[-1]) if stops.size else 0)
    places, rows = cells(line.start, u, ticks, tangent, turn, twist, width, done, finish)
    if last:  # the edge without length at the end of the program is a cell as well
        places = np.vstack([places, [[len(line) - 1, 0, 0]]])
        rows = np.concatenate([rows, np.zeros((1, *rows.shape[1:]))])
        rows[-1, 0] = line.start[-1]
    edge, offset, length = (frozen_integers(column) for column in places.T)

    anchor: IntArray = np.maximum.accumulate(np.where(line.stop == 1, u, -origin))  # where u is zero
    first: BoolArray = offset == 0
    travelled: FloatArray = np.where(line.alone == 1, 0.0, line.travel)
    stretch = travelled / (np.maximum(ticks, 1) * TICK)
    path = Path(
        axes=axes,
        u=frozen((u[edge] + offset - anchor[edge]) * TICK),
        length=frozen(length * TICK),
        coefficients=frozen(rows),
        feed_rate=frozen(line.feed_rate[edge]),
        stop=_frozen_flags(first & (line.stop[edge] == 1)),
        dwell=frozen(np.where(first, line.dwell[edge], 0.0)),
        arc_length=frozen(line.place[edge] + stretch[edge] * (offset * TICK)),
        stretch=frozen(stretch[edge]),
        line=frozen_integers(line.line[edge]),
    )
    if finish == len(line):
        return path, line, finish, 0
    passed: IntArray = stops[stops <= finish]
    keep = max(int(passed[-1]) if passed.size else 0, int((u < u[finish] - reach).sum()) - 2)
    return path, line.cut(slice(keep, None)), finish - keep, int(u[keep] - anchor[keep])


def _frozen_flags(values: BoolArray) -> BoolArray:
    values.setflags(write=False)
    return values


def _no_cells(axes: tuple[str, ...]) -> Path:
    none = frozen(np.empty(0))
    return Path(
        axes,
        none,
        none,
        frozen(np.empty((0, 4, len(axes)))),
        none,
        _frozen_flags(np.empty(0, np.bool_)),
        none,
        none,
        none,
        frozen_integers(np.empty(0, np.int64)),
    )
