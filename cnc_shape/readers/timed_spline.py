"""The cubic spline through the rows of a time trajectory, laid out as lines."""

from __future__ import annotations

import numpy as np

from cnc_shape.arrays import frozen, frozen_integers
from cnc_shape.errors import InfeasibleError
from cnc_shape.readers.timed import RowSpline, Spans, TimedPath, TimedPoints, new_points, timed_path
from cnc_shape.readers.waypoints import polyline
from cnc_shape.toolpath import travel_lengths

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
    back = False
    if closed:
        back = new_points(knots[[-1, 0]]).size > 1
        knots = np.vstack([knots, knots[:1]]) if back else np.vstack([knots[:-1], knots[:1]])
    chord = np.sqrt((np.diff(knots, axis=0) ** 2).sum(axis=1))
    parameter = np.concatenate([[0.0], np.cumsum(chord)])
    curve = CubicSpline(parameter, knots, bc_type="periodic" if closed else "not-a-knot")
    bend = np.sqrt((curve(parameter, 2) ** 2).sum(axis=1))
    parts = np.ceil(chord * np.sqrt(np.maximum(bend[1:], bend[:-1]) / (8.0 * CHORD_ERROR)))
    if parts.sum() > MOST_LINES:
        raise InfeasibleError(
            f"the spline through the rows takes {parts.sum():.3g} lines to within "
            f"{CHORD_ERROR * 1e6:g} nm, more than the limit of {MOST_LINES}",
            hint="take --path polyline, or give rows that do not jump",
            source=points.source,
        )
    spans = points.time.size - 1 + back
    knot = np.repeat(np.arange(rows.size), np.diff(rows, append=points.time.size))  # of every row
    knot = np.append(knot, rows.size) if back else knot
    pieces = np.ones(spans, dtype=np.int64)
    moving = np.flatnonzero(np.diff(knot))
    pieces[moving] = np.maximum(parts, 1.0)
    seconds = np.diff(points.time, append=points.time[-1:] if back else points.time[:0])
    division = Spans(frozen_integers(pieces), frozen(seconds))
    span, share = division.span, division.share
    before, after = parameter[knot[:-1]][span], parameter[knot[1:]][span]
    at = np.where(share < 1.0, before + share * (after - before), after)
    node = np.concatenate([[0.0], at])
    position = np.vstack([points.position, points.position[:1]]) if back else points.position
    turn = position[:-1][span, 3:] + share[:, None] * np.diff(position[:, 3:], axis=0)[span]
    target = np.column_stack([curve(node), np.vstack([position[:1, 3:], turn])])
    line = np.append(points.line, points.line[0])[np.concatenate([[0], span + 1])]
    program = polyline(points.source, points.axes, frozen(target), frozen_integers(line))
    place = np.concatenate([[0.0], np.cumsum(travel_lengths(program))])
    along = RowSpline(frozen(parameter[knot[: points.time.size]]), curve, frozen(node), frozen(place))
    return timed_path(points, program, division, along)
