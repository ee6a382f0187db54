# pyright: basic
"""The nearest point of a path of lines and arcs, within a window of its length."""

from math import inf, sqrt

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.arcs import angle_at, length_at, nearest_on_arc, reach

GROUP = 16  # segments that share a bounding box


@kernel
def group_boxes(boxes):
    """Bounding boxes of every GROUP segments. boxes (m,6): lowest x, y, z, highest x, y, z."""
    groups = (boxes.shape[0] + GROUP - 1) // GROUP
    out = np.empty((groups, 6))
    for g in range(groups):
        for i in range(3):
            out[g, i], out[g, 3 + i] = inf, -inf
        for j in range(g * GROUP, min(boxes.shape[0], (g + 1) * GROUP)):
            for i in range(3):
                out[g, i] = min(out[g, i], boxes[j, i])
                out[g, 3 + i] = max(out[g, 3 + i], boxes[j, 3 + i])
    return out


@kernel
def box_distance_v2(boxes, j, x, y, z):
    """Squared distance of a point to box j, mm^2; 0 inside. boxes (m,6)."""
    dx = max(boxes[j, 0] - x, 0.0, x - boxes[j, 3])
    dy = max(boxes[j, 1] - y, 0.0, y - boxes[j, 4])
    dz = max(boxes[j, 2] - z, 0.0, z - boxes[j, 5])
    return dx * dx + dy * dy + dz * dz


@kernel
def nearest_on_segment(start, end, low, high, arc, arcs, j, x, y, z, lower, upper, reach_v2):
    """(d^2, place) of the nearest point of segment j that lies in the window; (inf, 0) if out of reach.

    Lines are parametrised by their length, arcs by their angle. place is mm of path.
    """
    length = high[j] - low[j]
    first = max(lower, low[j]) - low[j]
    last = min(upper, high[j]) - low[j]
    if arc[j] >= 0:
        a = arc[j]
        begin = 0.0 if first <= 0.0 else angle_at(arcs, a, first, length)
        finish = arcs[a, 15] if last >= length else angle_at(arcs, a, last, length)
        d_v2, angle = nearest_on_arc(arcs, a, x, y, z, begin, max(begin, finish), reach_v2)
        if d_v2 == inf:
            return inf, 0.0
        return d_v2, low[j] + length_at(arcs, a, angle, length)
    share = 0.0
    ux, uy, uz = end[j, 0] - start[j, 0], end[j, 1] - start[j, 1], end[j, 2] - start[j, 2]
    if length > 0.0:
        wx, wy, wz = x - start[j, 0], y - start[j, 1], z - start[j, 2]
        share = (ux * wx + uy * wy + uz * wz) / (ux * ux + uy * uy + uz * uz)
        share = min(max(share, first / length), last / length)
    dx = x - (start[j, 0] + share * ux)
    dy = y - (start[j, 1] + share * uy)
    dz = z - (start[j, 2] + share * uz)
    return dx * dx + dy * dy + dz * dz, low[j] + share * length


@kernel
def feet(points, lower, upper, start, end, low, high, arc, arcs, boxes, groups, cursor):
    """Nearest points of the path, each within its own window of it.

    The least squared distance of all segments in the window wins; among equals, the smallest place.
    Boxes and the last sample's segment (`cursor` to begin with) only spare work: what they pass over is
    farther by more than any rounding, so the result does not depend on them.

    points (n,3) mm; lower, upper (n,) mm of path; start, end (m,3), low, high (m,) mm of path,
    arc (m,) row of arcs or -1, arcs (a,17), boxes (m,6), groups (g,6).
    Returns distance (n,), place (n,) mm, segment (n,), and the cursor of the next sample.
    """
    n, m = points.shape[0], low.size
    distance, place, segment = np.empty(n), np.empty(n), np.empty(n, np.int64)
    begin = finish = cursor
    for k in range(n):
        x, y, z = points[k, 0], points[k, 1], points[k, 2]
        window_low = min(max(lower[k], low[0]), high[m - 1])
        window_high = max(min(upper[k], high[m - 1]), window_low)
        while begin > 0 and high[begin - 1] >= window_low:
            begin -= 1
        while begin < m - 1 and high[begin] < window_low:
            begin += 1
        finish = max(finish, begin)
        while finish < m - 1 and low[finish + 1] <= window_high:
            finish += 1
        while finish > begin and low[finish] > window_high:
            finish -= 1
        guess = min(max(cursor, begin), finish)
        best, best_place = nearest_on_segment(
            start, end, low, high, arc, arcs, guess, x, y, z, window_low, window_high, inf
        )
        best_segment = guess
        limit = reach(best)
        for g in range(begin // GROUP, finish // GROUP + 1):
            if box_distance_v2(groups, g, x, y, z) > limit:
                continue
            for j in range(max(begin, g * GROUP), min(finish, g * GROUP + GROUP - 1) + 1):
                if j == guess or box_distance_v2(boxes, j, x, y, z) > limit:
                    continue
                d_v2, at = nearest_on_segment(
                    start, end, low, high, arc, arcs, j, x, y, z, window_low, window_high, limit
                )
                if d_v2 < best or (
                    d_v2 == best and (at < best_place or (at == best_place and j < best_segment))
                ):
                    best, best_place, best_segment = d_v2, at, j
                    limit = reach(best)
        distance[k], place[k], segment[k] = sqrt(best), best_place, best_segment
        cursor = best_segment
    return distance, place, segment, cursor


@kernel
def points_at(place, segment, start, end, low, high, arc, arcs):
    """Points of the path at `place` (n,) mm, on `segment` (n,): (n,3) mm."""
    out = np.empty((place.size, 3))
    for k in range(place.size):
        j = segment[k]
        length = high[j] - low[j]
        along = place[k] - low[j]
        if arc[j] < 0:
            share = along / length if length > 0.0 else 0.0
            for i in range(3):
                out[k, i] = start[j, i] + share * (end[j, i] - start[j, i])
            continue
        a = arc[j]
        angle = angle_at(arcs, a, along, length)
        r = arcs[a, 12] + arcs[a, 13] * angle
        for i in range(3):
            out[k, i] = (
                arcs[a, i]
                + r * (np.cos(angle) * arcs[a, 3 + i] + np.sin(angle) * arcs[a, 6 + i])
                + arcs[a, 14] * angle * arcs[a, 9 + i]
            )
    return out
