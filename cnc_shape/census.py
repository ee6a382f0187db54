"""Census of a program: what it counts, how long it is, how far it reaches; a fold over its chunks.

Sums are taken move by move in order, so that chunks of any size give the same bits.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.program import XYZ, Motion, Note, Program
from cnc_shape.toolpath import extent, rotary_travel, travel_lengths


@dataclass(frozen=True, eq=False, slots=True)
class Census:
    """What a program amounts to. Times are without acceleration."""

    axes: tuple[str, ...]
    rapids: int
    feeds: int
    arcs: int
    dwells: int
    rapid_length: float  # mm
    feed_length: float  # mm, straight feeds and arcs
    feed_time: float  # s, length / feed; rotary axes alone: angle / feed
    dwell: float  # s
    low: FloatArray  # (3,) mm, true extent of all moves; inf where there are none
    high: FloatArray  # (3,) mm; -inf where there are none
    position: FloatArray  # (d,) mm or rad, where the program ends
    notes: tuple[Note, ...]


def feed_times(program: Program, length: FloatArray) -> FloatArray:
    """Time of every straight feed and arc at its feed, (m,) s; 0 for others and for moves that go nowhere.

    length: (m,) mm, their XYZ travel.
    """
    travel = np.where(length > 0.0, length, rotary_travel(program))
    feeds = (program.motion == Motion.FEED) | (program.motion == Motion.ARC)
    return np.divide(travel, program.feed_rate, out=np.zeros_like(travel), where=feeds & (travel > 0.0))


def count(state: Census | None, program: Program) -> Census:
    """Add a chunk to the census; None starts."""
    if state is None:
        none = np.full(3, np.inf)
        state = Census(
            program.axes, 0, 0, 0, 0, 0.0, 0.0, 0.0, 0.0, frozen(none), frozen(-none), program.start, ()
        )  # fmt: skip
    kinds = program.motion
    length = travel_lengths(program)
    feeds = (kinds == Motion.FEED) | (kinds == Motion.ARC)
    moves = kinds != Motion.DWELL
    low, high = extent(program)
    if not moves.all():
        low, high = low[moves], high[moves]
    at_first = np.flatnonzero(moves)[:1]
    if state.low[0] > state.high[0] and at_first.size and kinds[at_first[0]] != Motion.RAPID:
        here = program.start[
            :3
        ]  # a path that begins with a feed begins here; a first rapid may come from anywhere
        state = replace(state, low=here, high=here)
    return replace(
        state,
        rapids=state.rapids + int(np.count_nonzero(kinds == Motion.RAPID)),
        feeds=state.feeds + int(np.count_nonzero(kinds == Motion.FEED)),
        arcs=state.arcs + int(np.count_nonzero(kinds == Motion.ARC)),
        dwells=state.dwells + int(np.count_nonzero(kinds == Motion.DWELL)),
        rapid_length=_sum(state.rapid_length, length[kinds == Motion.RAPID]),
        feed_length=_sum(state.feed_length, length[feeds]),
        feed_time=_sum(state.feed_time, feed_times(program, length)),
        dwell=_sum(state.dwell, program.dwell),
        low=frozen([low[:, k].min(initial=state.low[k]) for k in range(len(XYZ))]),
        high=frozen([high[:, k].max(initial=state.high[k]) for k in range(len(XYZ))]),
        position=program.end,
        notes=state.notes + program.notes,
    )


def _sum(before: float, terms: FloatArray) -> float:
    return float(np.cumsum(np.concatenate([[before], terms]))[-1])
