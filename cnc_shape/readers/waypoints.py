"""Way-points of a path as CSV: ``x_mm,y_mm,…[,feed_mm_min]``, joined by straight feeds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.errors import ProgramError
from cnc_shape.program import XYZ, Motion, Note, PathMode, Program, vertical_normals
from cnc_shape.readers.source import Source
from cnc_shape.readers.table import FEED, Header, Rows, join_rows, read_rows
from cnc_shape.toolpath import rotary_travel, travel_lengths
from cnc_shape.units import DEGREE

SLOWEST = 1e-8  # mm/s, of a way-point's feed


def positions(header: Header, table: FloatArray) -> FloatArray:
    """Columns of the axes in order, (n,d) mm or rad; an axis the table lacks stays at 0."""
    columns = [
        table[:, header.names.index(axis)] if axis in header.names else np.zeros(len(table))
        for axis in header.axes
    ]
    return np.column_stack(columns)


def polyline(source: str, axes: tuple[str, ...], points: FloatArray, line: IntArray) -> Program:
    """Straight feeds from the first of `points` (n,d) through the others, as fast as the axes can."""
    count = len(points) - 1
    nan = frozen(np.full(count, np.nan))
    return Program(
        source=source,
        axes=axes,
        start=frozen(points[0]),
        motion=frozen_integers(np.full(count, int(Motion.FEED))),
        target=frozen(points[1:]),
        center=frozen(np.zeros((count, 3))),
        normal=frozen(vertical_normals(count)),
        sweep=frozen(np.zeros(count)),
        feed_rate=frozen(np.full(count, np.inf)),
        dwell=frozen(np.zeros(count)),
        path_mode=frozen_integers(np.full(count, int(PathMode.BLEND))),
        path_tolerance=nan,
        merge_tolerance=nan,
        line=frozen_integers(line[1:]),
    )


def read_waypoints(
    source: Source, header: Header, *, closed: bool, rows: int, compiled_from: int
) -> Iterator[Program]:
    """Yield the polyline through the way-points in chunks of `rows` moves.

    The path starts at the first way-point; a row's feed belongs to the move that ends there. A move of rotary
    axes alone takes it in degrees, as in G-code.

    Parameters
    ----------
    source, header
        The text, and its first line.
    closed
        Whether a last move returns to the first way-point.
    rows
        Of a chunk, at least 1.
    compiled_from
        bytes, as in `read_rows`.

    Raises
    ------
    ProgramError
        As `read_rows`; a feed that is not positive or next to nothing; fewer than two way-points.
    """
    feed = header.names.index(FEED) if FEED in header.names else None
    notes = () if feed is not None else (Note(1, "no column feed_mm_min: the axes go as fast as they can"),)
    first: Rows | None = None  # the row where the path begins
    kept: Rows | None = None  # the row where the next chunk begins
    found = 0
    for part in read_rows(source, header, rows=rows, compiled_from=compiled_from):
        if feed is not None:
            slow = np.flatnonzero(part.values[:, feed] < SLOWEST)
            if slow.size:
                reason = f"the feed is below the limit of {SLOWEST:g} mm/s"
                line = int(part.line[slow[0]])
                raise ProgramError(source.name, line, 1, reason, hint="give the feed of the move")
        found += part.line.size
        here = part if kept is None else join_rows([kept, part])
        first, kept = first or part.cut(slice(0, 1)), here.cut(slice(-1, None))
        if here.line.size > 1:
            yield _chunk(source.name, header, here, notes)
            notes = ()
    if first is None or kept is None or found < 2:
        raise ProgramError(
            source.name, None, None, "fewer than two way-points", hint="a path has two points at least"
        )
    if closed:
        yield _chunk(source.name, header, join_rows([kept, first]), notes)


def _chunk(source: str, header: Header, rows: Rows, notes: tuple[Note, ...]) -> Program:
    table = rows.values
    program = polyline(source, header.axes, positions(header, table), rows.line)
    if FEED not in header.names:
        return replace(program, notes=notes)
    feed = table[1:, header.names.index(FEED)]
    if len(header.axes) > len(XYZ):
        alone = (travel_lengths(program) == 0.0) & (rotary_travel(program) > 0.0)
        feed = np.where(alone, feed * DEGREE, feed)
    return replace(program, feed_rate=frozen(feed), notes=notes)
