"""The cubic spline through the rows of a time trajectory, laid out as lines."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.errors import InfeasibleError
from cnc_shape.readers.timed import (
    SAME_POINT,
    RowSpline,
    Spans,
    TimedPath,
    TimedPoints,
    new_points,
    timed_path,
)
from cnc_shape.readers.waypoints import polyline
from cnc_shape.toolpath import travel_lengths
from cnc_shape.units import MICROMETRE

CHORD_ERROR = 1e-6  # mm, of the lines
MOST_LINES = 2_000_000


def spline_through(points: TimedPoints, *, closed: bool) -> TimedPath:
    """Twice continuously differentiable cubic spline through the rows, over the length of their chords.

    Its ends are not-a-knot; a closed one is periodic, and leads back to the first row if the last is
    elsewhere. A chord over h of the parameter leaves the curve by less than ``h^2 max|C''| / 8``, and C'' is
    linear between rows: so every span is cut into as many equal parts as it needs for `CHORD_ERROR`. Rows
    that repeat a point are no knots of the spline, but dwells on it. Rotary axes go straight from row to row.

    Raises
    ------
    InfeasibleError
        Rows of one point alone; more than `MOST_LINES` lines.
    """
    from scipy.interpolate import CubicSpline  # pyright: ignore[reportUnknownVariableType]  # ships no types

    rows = new_points(points.position[:, :3])
    if rows.size < 2:
        raise InfeasibleError(
            "all rows are the same point: there is no spline through it",
            hint="give a trajectory that moves",
            source=points.source,
        )
    knots = points.position[rows, :3]
    back = closed and new_points(knots[[-1, 0]]).size > 1
    if closed:
        knots = np.vstack([knots if back else knots[:-1], knots[:1]])
    chord = np.maximum(np.sqrt((np.diff(knots, axis=0) ** 2).sum(axis=1)), SAME_POINT)
    parameter = np.concatenate([[0.0], np.cumsum(chord)])
    curve = CubicSpline(parameter, knots, bc_type="periodic" if closed else "not-a-knot")
    bend = np.sqrt((curve(parameter, 2) ** 2).sum(axis=1))
    parts = chord * np.sqrt(np.maximum(bend[1:], bend[:-1]) / (8.0 * CHORD_ERROR))
    parts = np.maximum(np.ceil(parts), 1.0)
    if not parts.sum() <= MOST_LINES:
        raise InfeasibleError(
            f"the spline through the rows takes {parts.sum():.3g} lines to within "
            f"{CHORD_ERROR / MICROMETRE:g} µm, more than the limit of {MOST_LINES}",
            hint="take --path polyline, or give rows that do not jump",
            source=points.source,
        )
    return _laid_out(points, rows, parameter, curve, frozen_integers(parts), back=back)


def _laid_out(
    points: TimedPoints,
    rows: IntArray,
    parameter: FloatArray,
    curve: Callable[[FloatArray], FloatArray],
    parts: IntArray,
    *,
    back: bool,
) -> TimedPath:
    """Lines along a curve through `rows`, `parts` from each to the next; back: the last ones to the first.

    parameter: of the curve at every one of `rows`, and at the end of the way back.
    """
    count = points.time.size
    position, line, seconds = points.position, points.line, np.diff(points.time)
    knot = np.repeat(np.arange(rows.size), np.diff(rows, append=count))  # that every row is at
    if back:
        position, line = np.vstack([position, position[:1]]), np.append(line, line[0])
        seconds, knot = np.append(seconds, 0.0), np.append(knot, rows.size)
    pieces = np.ones(seconds.size, dtype=np.int64)
    pieces[np.diff(knot) > 0] = parts
    spans = Spans(frozen_integers(pieces), frozen(seconds))
    span, share = spans.span, spans.share
    before, after = parameter[knot[:-1]][span], parameter[knot[1:]][span]
    node = np.concatenate([[0.0], np.where(share < 1.0, before + share * (after - before), after)])
    rotary = position[:-1, 3:][span] + share[:, None] * np.diff(position[:, 3:], axis=0)[span]
    vertex = np.column_stack([curve(node), np.vstack([position[:1, 3:], rotary])])
    of_row = frozen_integers(line[np.concatenate([[0], span + 1])])
    program = polyline(points.source, points.axes, frozen(vertex), of_row)
    place = np.concatenate([[0.0], np.cumsum(travel_lengths(program))])
    along = RowSpline(frozen(parameter[knot[:count]]), curve, frozen(node), frozen(place))
    return timed_path(points, program, spans, along)
