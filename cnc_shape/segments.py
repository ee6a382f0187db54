"""Segments: the toolpath's XYZ geometry laid out for nearest-point search."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.kernels.foot_point import PathTable, pack, stack_boxes
from cnc_shape.kernels.layout import lay_out
from cnc_shape.toolpath import Toolpath


@dataclass(frozen=True, eq=False, slots=True)
class Segments:
    """Consecutive lines and arcs with XYZ travel; the path's first row stands even without."""

    start: FloatArray  # (m,3) mm
    end: FloatArray  # (m,3) mm
    low: FloatArray  # (m,) mm, place of the start on the toolpath
    high: FloatArray  # (m,) mm, place of the end
    line: IntArray  # (m,)
    arc: IntArray  # (m,) row of `arcs`; -1: a line
    arcs: FloatArray  # (a,17) as kernels/arcs.py lays it out
    boxes: FloatArray  # (m,6) mm, lowest and highest x, y, z


NO_SEGMENTS = Segments(
    frozen(np.zeros((0, 3))), frozen(np.zeros((0, 3))), frozen([]), frozen([]),
    frozen_integers(np.zeros(0, np.int64)), frozen_integers(np.zeros(0, np.int64)),
    frozen(np.zeros((0, 17))), frozen(np.zeros((0, 6))),
)  # fmt: skip


def segments(toolpath: Toolpath, *, first: bool) -> Segments:
    """Lay out a chunk of a toolpath; `first`: it begins the path, so its first row is kept in any case."""
    start, end, low, high, line, arc, arcs, boxes = lay_out(
        toolpath.kind, toolpath.start, toolpath.end, toolpath.center, toolpath.normal, toolpath.sweep,
        toolpath.arc_length, toolpath.line, first,
    )  # fmt: skip
    return Segments(
        frozen(start), frozen(end), frozen(low), frozen(high), frozen_integers(line),
        frozen_integers(arc), frozen(arcs), frozen(boxes),
    )  # fmt: skip


def join(first: Segments, second: Segments) -> Segments:
    """Consecutive segments as one value."""
    if first.low.size == 0:
        return second
    arc = np.where(second.arc >= 0, second.arc + first.arcs.shape[0], -1)
    return Segments(
        frozen(np.concatenate([first.start, second.start])),
        frozen(np.concatenate([first.end, second.end])),
        frozen(np.concatenate([first.low, second.low])),
        frozen(np.concatenate([first.high, second.high])),
        frozen_integers(np.concatenate([first.line, second.line])),
        frozen_integers(np.concatenate([first.arc, arc])),
        frozen(np.concatenate([first.arcs, second.arcs])),
        frozen(np.concatenate([first.boxes, second.boxes])),
    )


def since(path: Segments, place: float) -> Segments:
    """Leave out what ends before `place` (mm of path); at least one segment stays."""
    drop = min(int(np.searchsorted(path.high, place, side="left")), path.low.size - 1)
    if drop <= path.low.size // 2:  # copying little for little gain costs more than keeping it
        return path
    kept = path.arc[drop:]
    arcs = kept[kept >= 0]
    gone = int(arcs[0]) if arcs.size else path.arcs.shape[0]
    return Segments(
        frozen(path.start[drop:]), frozen(path.end[drop:]), frozen(path.low[drop:]), frozen(path.high[drop:]),
        frozen_integers(path.line[drop:]), frozen_integers(np.where(kept >= 0, kept - gone, -1)),
        frozen(path.arcs[gone:]), frozen(path.boxes[drop:]),
    )  # fmt: skip


def path_table(path: Segments) -> PathTable:
    """Lay segments, at least one, out for the search of nearest points."""
    tree, first = stack_boxes(path.boxes)
    return PathTable(
        frozen(pack(path.start, path.end, path.low, path.high, path.arc)), path.low, path.high, path.arcs,
        path.boxes, frozen(tree), frozen_integers(first),
    )  # fmt: skip
