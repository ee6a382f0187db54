# pyright: basic
"""A toolpath's lines and arcs as the nearest-point search wants them."""

from math import cos, hypot, pi, sin, sqrt

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.arcs import quadrature

ARC = 2  # Motion.ARC
BOX_MARGIN = 1e-9  # mm, more than the rounding of coordinates below 1e6 mm
ROUNDING = 1e-12  # -, of the radius: what changes by less over the whole arc is no spiral, no helix


@kernel
def lay_arc(start, end, center, normal, sweep, r, length, arcs, j):
    """Row j of `arcs` (a,17), as arcs.py lays it out, from the programmed form in row r.

    start, end (m,>=3), center, normal (m,3) mm; sweep (m,) rad; length mm of path.
    """
    angle = abs(sweep[r])
    rise = radius = end_radius = 0.0
    for i in range(3):
        rise += (end[r, i] - start[r, i]) * normal[r, i]
    for i in range(3):
        radius += (start[r, i] - center[r, i]) ** 2
        end_radius += (end[r, i] - center[r, i] - rise * normal[r, i]) ** 2
    radius, end_radius = sqrt(radius), sqrt(end_radius)
    norm = 0.0
    for i in range(3):
        j1, j2 = (i + 1) % 3, (i + 2) % 3
        outward = start[r, i] - center[r, i]
        if radius == 0.0:
            # a spiral out of its center has no direction at its start: turn that of its end back
            arm = end[r, i] - center[r, i] - rise * normal[r, i]
            arm1 = end[r, j1] - center[r, j1] - rise * normal[r, j1]
            arm2 = end[r, j2] - center[r, j2] - rise * normal[r, j2]
            outward = cos(sweep[r]) * arm - sin(sweep[r]) * (normal[r, j1] * arm2 - normal[r, j2] * arm1)
        arcs[j, i], arcs[j, 3 + i], arcs[j, 9 + i] = center[r, i], outward, normal[r, i]
        norm += outward * outward
    norm = sqrt(norm)
    for i in range(3):
        arcs[j, 3 + i] /= norm
    turn = 1.0 if sweep[r] > 0.0 else -1.0
    for i in range(3):
        j1, j2 = (i + 1) % 3, (i + 2) % 3
        arcs[j, 6 + i] = (normal[r, j1] * arcs[j, 3 + j2] - normal[r, j2] * arcs[j, 3 + j1]) * turn
    growth = (end_radius - radius) / angle
    if abs(growth * angle) <= ROUNDING * radius:
        growth = 0.0
    climb = 0.0 if abs(rise) <= ROUNDING * radius else rise / angle
    arcs[j, 12], arcs[j, 13], arcs[j, 14], arcs[j, 15] = radius, growth, climb, angle
    arcs[j, 16] = length / quadrature(radius, growth, climb, angle)


@kernel
def arc_box(start, end, n, arcs, j, boxes):
    """Row n of `boxes` (m,6): around a ball that holds arc j from start[n] to end[n], (m,3) mm.

    Up to half a turn an arc or helix lies in the ball over its chord (Thales), a spiral within the change
    of its radius of it; beyond, it lies in the ball about the middle of its axis.
    """
    radius, climb, angle = arcs[j, 12], arcs[j, 14], arcs[j, 15]
    change = abs(arcs[j, 13]) * angle
    half_rise = 0.5 * climb * angle
    chord_v2 = 0.0
    for i in range(3):
        chord_v2 += (end[n, i] - start[n, i]) ** 2
    ball = 0.5 * sqrt(chord_v2) + change if angle <= pi else hypot(radius + change, half_rise)
    for i in range(3):
        middle = 0.5 * (start[n, i] + end[n, i]) if angle <= pi else arcs[j, i] + half_rise * arcs[j, 9 + i]
        boxes[n, i], boxes[n, 3 + i] = middle - ball, middle + ball


@kernel
def lay_out(kind, start, end, center, normal, sweep, arc_length, line, first):
    """Consecutive segments: the rows of a toolpath with XYZ travel, and its first row if `first`.

    kind, line (m,); start, end (m,>=3), center, normal (m,3) mm; sweep (m,) rad; arc_length (m+1,) mm.

    Returns
    -------
    start, end (s,3), low, high (s,)
        mm; the last two are places on the toolpath.
    line, arc (s,)
        Source line; row of `arcs`, or -1 for a line.
    arcs (a,17)
        As arcs.py lays them out.
    boxes (s,6)
        Lowest and highest x, y, z of a box that holds the segment, mm.
    """
    segments = turning = 0
    for r in range(kind.size):
        if arc_length[r + 1] > arc_length[r] or (first and r == 0):
            segments += 1
            if kind[r] == ARC and arc_length[r + 1] > arc_length[r] and sweep[r] != 0.0:
                turning += 1
    o_start, o_end = np.empty((segments, 3)), np.empty((segments, 3))
    o_low, o_high = np.empty(segments), np.empty(segments)
    o_line, o_arc = np.empty(segments, np.int64), np.empty(segments, np.int64)
    arcs, boxes = np.empty((turning, 17)), np.empty((segments, 6))
    n = a = 0
    for r in range(kind.size):
        travels = arc_length[r + 1] > arc_length[r]
        if not travels and not (first and r == 0):
            continue
        for i in range(3):
            o_start[n, i], o_end[n, i] = start[r, i], end[r, i]
            boxes[n, i], boxes[n, 3 + i] = min(start[r, i], end[r, i]), max(start[r, i], end[r, i])
        o_low[n], o_high[n], o_line[n], o_arc[n] = arc_length[r], arc_length[r + 1], line[r], -1
        if kind[r] == ARC and travels and sweep[r] != 0.0:
            lay_arc(start, end, center, normal, sweep, r, arc_length[r + 1] - arc_length[r], arcs, a)
            arc_box(o_start, o_end, n, arcs, a, boxes)
            o_arc[n] = a
            a += 1
        for i in range(3):
            boxes[n, i] -= BOX_MARGIN
            boxes[n, 3 + i] += BOX_MARGIN
        n += 1
    return o_start, o_end, o_low, o_high, o_line, o_arc, arcs, boxes
