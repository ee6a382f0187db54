# pyright: basic
"""The nearest point of a path of lines and arcs, within a window of its length."""

from math import inf, sqrt
from typing import NamedTuple

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray
from cnc_shape.kernels import kernel
from cnc_shape.kernels.arcs import TWO_PI, angle_at, length_at, nearest_on_arc, reach

FAN_BITS = 2
FAN = 1 << FAN_BITS  # boxes that one box of the next level holds


@kernel
def pack(start, end, low, high, arc):
    """What the search reads of every segment, side by side in memory, (m,11).

    start, end (m,3) mm; low, high (m,) mm of path; arc (m,) row of arcs or -1. Columns: start, end minus
    start, 1 / chord^2, arc, low, high minus low, 1 / (high minus low); 0 for the inverse of nothing.
    """
    out = np.empty((start.shape[0], 11))
    for j in range(start.shape[0]):
        chord_v2 = 0.0
        for i in range(3):
            step = end[j, i] - start[j, i]
            out[j, i], out[j, 3 + i] = start[j, i], step
            chord_v2 += step * step
        length = high[j] - low[j]
        out[j, 6] = 1.0 / chord_v2 if chord_v2 > 0.0 else 0.0
        out[j, 7], out[j, 8], out[j, 9] = arc[j], low[j], length
        out[j, 10] = 1.0 / length if length > 0.0 else 0.0
    return out


@kernel
def stack_boxes(boxes):
    """Boxes around FAN boxes each, level upon level until few are left.

    boxes (m,6): lowest x, y, z, highest x, y, z. Returns tree (b,6) and first (l+1,): box g of level n, n
    from 1, is ``tree[first[n - 1] + g]`` and holds the segments from ``g FAN^n`` to ``(g + 1) FAN^n - 1``.
    """
    levels, total, size = 0, 0, boxes.shape[0]
    while levels == 0 or size > FAN:
        size = (size + FAN - 1) // FAN
        total += size
        levels += 1
    tree = np.empty((total, 6))
    first = np.zeros(levels + 1, np.int64)
    size = boxes.shape[0]
    for level in range(levels):
        above = (size + FAN - 1) // FAN
        first[level + 1] = first[level] + above
        for g in range(above):
            for i in range(3):
                lowest, highest = inf, -inf
                for j in range(g * FAN, min((g + 1) * FAN, size)):
                    if level == 0:
                        lowest, highest = min(lowest, boxes[j, i]), max(highest, boxes[j, 3 + i])
                    else:
                        below = first[level - 1] + j
                        lowest, highest = min(lowest, tree[below, i]), max(highest, tree[below, 3 + i])
                tree[first[level] + g, i], tree[first[level] + g, 3 + i] = lowest, highest
        size = above
    return tree, first


@kernel
def box_distance_v2(boxes, j, x, y, z):
    """Squared distance of a point to box j, mm^2; 0 inside. boxes (m,6)."""
    dx = max(max(boxes[j, 0] - x, x - boxes[j, 3]), 0.0)
    dy = max(max(boxes[j, 1] - y, y - boxes[j, 4]), 0.0)
    dz = max(max(boxes[j, 2] - z, z - boxes[j, 5]), 0.0)
    return dx * dx + dy * dy + dz * dz


@kernel
def seek(places, value, guess):
    """Smallest j with places[j] >= value, or places.size; places (m,) rise. Quick if `guess` is near it."""
    size = places.size
    left, right, stride = guess, guess, 1
    while left >= 0 and places[left] >= value:
        right = left
        left = left - stride if left >= stride else -1
        stride *= 2
    stride = 1
    while right < size and not places[right] >= value:
        left = right
        right = min(right + stride, size)
        stride *= 2
    while right - left > 1:  # places[left] < value <= places[right]
        middle = (left + right) // 2
        if places[middle] >= value:
            right = middle
        else:
            left = middle
    return right


@kernel
def nearest_on_line(table, j, x, y, z, first, last):
    """(d^2, share) of the nearest point of line j, its share of the line in [first, last]. table (m,11)."""
    ux, uy, uz = table[j, 3], table[j, 4], table[j, 5]
    dx, dy, dz = x - table[j, 0], y - table[j, 1], z - table[j, 2]
    share = min(max((ux * dx + uy * dy + uz * dz) * table[j, 6], first), last)
    dx, dy, dz = dx - share * ux, dy - share * uy, dz - share * uz
    return dx * dx + dy * dy + dz * dz, share


@kernel
def nearest_on_segment(table, arcs, j, x, y, z, lower, upper, reach_v2):
    """(d^2, place) of the nearest point of segment j that lies in the window; (inf, 0) if out of reach.

    Lines are parametrised by their length, arcs by their angle. place is mm of path. table (m,11) from
    `pack`; arcs (a,17).
    """
    start, length = table[j, 8], table[j, 9]
    first = max(lower - start, 0.0)
    last = max(min(upper - start, length), 0.0)
    a = int(table[j, 7])
    if a < 0:
        scale = table[j, 10]
        d_v2, share = nearest_on_line(
            table, j, x, y, z, first * scale, 1.0 if last >= length else last * scale
        )
        return d_v2, start + share * length
    cut = first > 0.0 or last < length
    if cut and arcs[a, 13] != 0.0 and arcs[a, 15] <= TWO_PI:
        # a spiral's angles at the window's ends are costly; mostly its nearest point lies within anyway
        d_v2, angle = nearest_on_arc(arcs, a, x, y, z, 0.0, arcs[a, 15], reach_v2)
        if d_v2 == inf:
            return inf, 0.0
        place = start + length_at(arcs, a, angle, length)
        if lower <= place <= upper:
            return d_v2, place
    begin = 0.0 if first <= 0.0 else angle_at(arcs, a, first, length)
    finish = arcs[a, 15] if last >= length else angle_at(arcs, a, last, length)
    d_v2, angle = nearest_on_arc(arcs, a, x, y, z, begin, max(begin, finish), reach_v2)
    if d_v2 == inf:
        return inf, 0.0
    return d_v2, start + length_at(arcs, a, angle, length)


@kernel
def descend(table, guess, begin, finish, x, y, z):
    """d^2 of the nearest of the lines around `guess`, from one to the next as long as it comes nearer.

    Only lines between begin and finish, which lie in the window as a whole. table (m,11) from `pack`.
    """
    best, _ = nearest_on_line(table, guess, x, y, z, 0.0, 1.0)
    for step in (1, -1):
        j = guess + step
        while begin < j < finish and table[j, 7] < 0.0:
            d_v2, _ = nearest_on_line(table, j, x, y, z, 0.0, 1.0)
            if d_v2 >= best:
                break
            best = d_v2
            j += step
    return best


class PathTable(NamedTuple):
    """A path laid out for the search."""

    table: FloatArray  # (m,11) from `pack`
    low: FloatArray  # (m,) mm of path, where the segments start
    high: FloatArray  # (m,) mm of path, where they end
    arcs: FloatArray  # (a,17) as kernels/arcs.py lays it out
    boxes: FloatArray  # (m,6) mm, lowest and highest x, y, z
    tree: FloatArray  # (b,6) from `stack_boxes`
    first: IntArray  # (l+1,) from `stack_boxes`


@kernel
def seek_feet(points, lower, upper, start, stop, path, cursor, distance, place, segment):
    """Nearest points of the path for the rows from `start` to before `stop`, each within its own window.

    The least squared distance of all segments in the window wins; among equals, the smallest place.
    The search goes through the segments that touch the window, in order, and leaves out each box that is
    farther away than the best so far, or than a first guess: the distance to a place ahead of the foot
    before by as much as that one moved. With it, nearly all boxes are out of reach. Both only spare work:
    what is passed over is farther by more than any rounding, so the result does not depend on them.

    points (n,3) mm; lower, upper (n,) mm of path; path: a `PathTable`; cursor (4,): first and last segment
    of the window before, its foot's segment, and how far that moved. Changed in place: cursor, and the rows
    of distance (n,), place (n,), segment (n,).
    """
    table, low, high, arcs, boxes, tree, first = path
    m, levels = low.size, first.size - 1
    begin, finish = min(cursor[0], m - 1), min(cursor[1], m - 1)
    foot, advance = min(cursor[2], m - 1), cursor[3]
    for k in range(start, stop):
        x, y, z = points[k, 0], points[k, 1], points[k, 2]
        window_low = min(max(lower[k], low[0]), high[m - 1])
        window_high = max(min(upper[k], high[m - 1]), window_low)
        begin = min(seek(high, window_low, begin), m - 1)  # the first that ends in the window or after
        finish = seek(low, window_high, finish)  # the last that starts in the window or before
        if finish == m or low[finish] > window_high:
            finish -= 1
        finish = max(finish, begin)
        guess = min(max(foot + advance, begin), finish)
        before, foot, tried = foot, guess, -1
        best, best_place = inf, window_low
        if begin < guess < finish and table[guess, 7] < 0.0:
            bound = descend(table, guess, begin, finish, x, y, z)
        else:
            tried = guess
            best, best_place = nearest_on_segment(table, arcs, guess, x, y, z, window_low, window_high, inf)
            bound = best
        limit = reach(bound)
        top = 1  # boxes larger than half the window tell nothing
        while top < levels and (2 << (FAN_BITS * (top + 1))) <= finish - begin:
            top += 1
        j, level = begin, top
        while j <= finish:
            if level > 0:
                block = j >> (FAN_BITS * level)
                if box_distance_v2(tree, first[level - 1] + block, x, y, z) <= limit:
                    level -= 1
                    continue
                j = (block + 1) << (FAN_BITS * level)
            else:
                last = min((j | (FAN - 1)) + 1, finish + 1)
                while j < last:
                    if j == tried:
                        j += 1
                        continue
                    at = inf
                    if table[j, 7] < 0.0 and begin < j < finish:
                        d_v2, share = nearest_on_line(table, j, x, y, z, 0.0, 1.0)
                        if d_v2 <= best:
                            at = table[j, 8] + share * table[j, 9]
                    elif box_distance_v2(boxes, j, x, y, z) <= limit:
                        d_v2, at = nearest_on_segment(table, arcs, j, x, y, z, window_low, window_high, limit)
                    else:
                        d_v2 = inf
                    if d_v2 < best or (d_v2 == best and (at < best_place or (at == best_place and j < foot))):
                        best, best_place, foot = d_v2, at, j
                        if best < bound:
                            bound, limit = best, reach(best)
                    j += 1
                level = 1
            while level < top and j & ((1 << (FAN_BITS * (level + 1))) - 1) == 0:
                level += 1  # the largest box that begins here
        distance[k], segment[k] = sqrt(best), foot
        place[k] = min(max(best_place, window_low), window_high)
        advance = foot - before
    cursor[0], cursor[1], cursor[2], cursor[3] = begin, finish, foot, advance


@kernel
def feet(points, lower, upper, path):
    """Nearest points of the path, each within its own window of it.

    points (n,3) mm; lower, upper (n,) mm of path; path: a `PathTable`.
    Returns distance (n,), place (n,), segment (n,).
    """
    n = points.shape[0]
    distance, place, segment = np.empty(n), np.empty(n), np.empty(n, np.int64)
    seek_feet(points, lower, upper, 0, n, path, np.zeros(4, np.int64), distance, place, segment)
    return distance, place, segment


@kernel
def point_at(table, arcs, place, j, out, k):
    """Point of the path at `place` mm, on segment j, into row k of `out` (n,3) mm."""
    along = place - table[j, 8]
    if table[j, 7] < 0.0:
        share = along * table[j, 10]
        for i in range(3):
            out[k, i] = table[j, i] + share * table[j, 3 + i]
        return
    a = int(table[j, 7])
    angle = angle_at(arcs, a, along, table[j, 9])
    r = arcs[a, 12] + arcs[a, 13] * angle
    for i in range(3):
        out[k, i] = (
            arcs[a, i]
            + r * (np.cos(angle) * arcs[a, 3 + i] + np.sin(angle) * arcs[a, 6 + i])
            + arcs[a, 14] * angle * arcs[a, 9 + i]
        )


@kernel
def points_at(place, segment, path):
    """Points of the path at `place` (n,) mm, on `segment` (n,): (n,3) mm. path: a `PathTable`."""
    table, arcs = path.table, path.arcs
    out = np.empty((place.size, 3))
    for k in range(place.size):
        point_at(table, arcs, place[k], segment[k], out, k)
    return out
