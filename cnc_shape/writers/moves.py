"""Moves with their times as CSV: one row a move of the toolpath, in the order they are made."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from cnc_shape.passing import Moves
from cnc_shape.program import Motion
from cnc_shape.writers.publish import publishing

HEADER = "line,start_s,time_s,naive_s,length_mm,feed_mm_s,kind\n"


def write_moves(path: Path | str, chunks: Iterable[Moves], *, force: bool = False) -> None:
    """Write consecutive chunks of moves as they come, whole or not at all.

    There is no feed where a move has none in mm/s: rapids, dwells, rotary axes alone.

    Raises
    ------
    OutputError
        The file cannot be written there.
    """
    with publishing(path, force=force) as file:
        file.write(HEADER.encode("ascii"))
        for moves in chunks:
            file.write(moves_text(moves).encode("ascii"))


def moves_text(moves: Moves) -> str:
    """CSV lines of a chunk of moves."""
    fed = np.isfinite(moves.feed_rate) & (moves.length > 0.0)
    feeds = [
        repr(feed) if has else "" for feed, has in zip(moves.feed_rate.tolist(), fed.tolist(), strict=True)
    ]
    kinds = [Motion(kind).name.lower() for kind in moves.kind.tolist()]
    numbers = (moves.start, moves.time, moves.naive_time, moves.length)
    columns = [
        map(str, moves.line.tolist()),
        *(map(repr, column.tolist()) for column in numbers),
        feeds,
        kinds,
    ]
    return "".join([",".join(row) + "\n" for row in zip(*columns, strict=True)])
