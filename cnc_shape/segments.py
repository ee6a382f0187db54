"""Segments: the toolpath's XYZ geometry laid out for nearest-point search."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.kernels.arcs import quadrature_lengths
from cnc_shape.program import Motion
from cnc_shape.toolpath import Toolpath

BOX_MARGIN = 1e-9  # mm, more than the rounding of coordinates below 1e6 mm


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
    low, high = toolpath.arc_length[:-1], toolpath.arc_length[1:]
    wanted = high > low
    if first and wanted.size:
        wanted[0] = True
    keep = np.flatnonzero(wanted)
    start, end = toolpath.start[keep, :3], toolpath.end[keep, :3]
    low, high = low[keep], high[keep]
    is_arc = (toolpath.kind[keep] == Motion.ARC) & (high > low) & (toolpath.sweep[keep] != 0.0)
    rows = keep[is_arc]
    arc = np.full(keep.size, -1)
    arc[is_arc] = np.arange(rows.size)
    arcs = _arcs(
        start[is_arc], end[is_arc], toolpath.center[rows], toolpath.normal[rows], toolpath.sweep[rows],
        high[is_arc] - low[is_arc],
    )  # fmt: skip
    boxes = np.hstack([np.minimum(start, end), np.maximum(start, end)])
    boxes[is_arc] = _arc_boxes(start[is_arc], end[is_arc], arcs)
    boxes += np.repeat([-BOX_MARGIN, BOX_MARGIN], 3)
    return Segments(
        frozen(start), frozen(end), frozen(low), frozen(high), frozen_integers(toolpath.line[keep]),
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


def _arcs(
    start: FloatArray,
    end: FloatArray,
    center: FloatArray,
    normal: FloatArray,
    sweep: FloatArray,
    length: FloatArray,
) -> FloatArray:
    """Table of arcs, (a,17), from their programmed form."""
    angle = np.abs(sweep)
    rise = ((end - start) * normal).sum(axis=1)
    arm, end_arm = start - center, end - center - rise[:, None] * normal
    radius = np.sqrt((arm * arm).sum(axis=1))
    end_radius = np.sqrt((end_arm * end_arm).sum(axis=1))
    # a spiral out of its center has no direction at its start: turn that of its end back
    back = np.cos(sweep)[:, None] * end_arm - np.sin(sweep)[:, None] * np.cross(normal, end_arm)
    outward = frozen(np.where((radius > 0.0)[:, None], arm, back))
    first = outward / np.sqrt((outward * outward).sum(axis=1))[:, None]
    second = np.cross(normal, first) * np.sign(sweep)[:, None]
    growth = (end_radius - radius) / angle
    # rounding of the end point is no spiral
    growth = np.where(np.abs(growth * angle) <= 1e-12 * radius, 0.0, growth)
    climb = np.where(np.abs(rise) <= 1e-12 * radius, 0.0, rise / angle)
    table = np.column_stack([center, first, second, normal, radius, growth, climb, angle])
    ratio = length / quadrature_lengths(radius, growth, climb, angle)
    return frozen(np.column_stack([table, ratio]))


def _arc_boxes(start: FloatArray, end: FloatArray, arcs: FloatArray) -> FloatArray:
    """Boxes around balls that hold the arcs, (a,6).

    Up to half a turn an arc or helix lies in the ball over its chord (Thales), a spiral within the change
    of its radius of it; beyond, it lies in the ball about the middle of its axis.
    """
    center, normal = arcs[:, :3], arcs[:, 9:12]
    radius, growth, climb, angle = arcs[:, 12], arcs[:, 13], arcs[:, 14], arcs[:, 15]
    change = np.abs(growth) * angle
    half_rise = 0.5 * climb * angle
    chord = np.sqrt(((end - start) ** 2).sum(axis=1))
    short = angle <= np.pi
    middle = np.where(short[:, None], 0.5 * (start + end), center + half_rise[:, None] * normal)
    ball = np.where(short, 0.5 * chord + change, np.hypot(radius + change, half_rise))
    return frozen(np.hstack([middle - ball[:, None], middle + ball[:, None]]))
