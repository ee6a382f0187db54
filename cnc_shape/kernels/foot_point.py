# pyright: basic
"""The nearest point of a path of lines and arcs, within a window of its length."""

from math import inf, sqrt

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.arcs import TWO_PI, angle_at, beyond, length_at, nearest_on_arc, reach

FAN_BITS = 2
FAN = 1 << FAN_BITS  # boxes that one box of the next level holds
FEW = 8  # segments that are looked at one by one
LONG_RUN = 16  # lines that a run must have to be worth its projection
STEEPEST_V2 = 0.25  # -, square of the least cosine between a line of a run and its direction
RUN_ROUNDING = 4e-9  # mm, more than the rounding of projections of coordinates below 1e6 mm


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
def runs(table):
    """Stretches of lines that all go forward along one direction, so that they can be sought in order.

    table (m,11) from `pack`. Returns run (m,), the run of each segment; bounds (r,2), its first and last
    segment; direction (r,3), unit, or 0 where there is none: arcs, and lines that turn back too soon; and
    ahead (m,) mm, the start of each segment along the direction of its run, which rises within the run.
    """
    m = table.shape[0]
    run, ahead = np.empty(m, np.int64), np.zeros(m)
    bounds, direction = np.empty((m, 2), np.int64), np.zeros((m, 3))
    n = begin = 0
    while begin < m:
        ux, uy, uz, scale = table[begin, 3], table[begin, 4], table[begin, 5], sqrt(table[begin, 6])
        ux, uy, uz = ux * scale, uy * scale, uz * scale
        end = begin
        while end < m and table[end, 7] < 0.0:
            forward = ux * table[end, 3] + uy * table[end, 4] + uz * table[end, 5]
            if not (forward > 0.0 and forward * forward * table[end, 6] > STEEPEST_V2):
                break
            end += 1
        if end - begin >= LONG_RUN:
            bounds[n, 0] = begin
            direction[n, 0], direction[n, 1], direction[n, 2] = ux, uy, uz
            farthest = -inf
            for j in range(begin, end):
                farthest = max(farthest, ux * table[j, 0] + uy * table[j, 1] + uz * table[j, 2])
                ahead[j] = farthest
        else:
            end = max(end, begin + 1)
            if n > 0 and direction[n - 1, 0] == direction[n - 1, 1] == direction[n - 1, 2] == 0.0:
                n -= 1  # one more of a stretch without direction
            else:
                bounds[n, 0] = begin
        bounds[n, 1] = end - 1
        run[begin:end] = n
        n += 1
        begin = end
    return run, bounds[:n], direction[:n], ahead


@kernel
def seek(places, value, guess, first, last):
    """Smallest j in [first, last) with places[j] >= value, or last; they rise. Quick with a near guess."""
    left, right, stride = guess, guess, 1
    while left >= first and places[left] >= value:
        right = left
        left = left - stride if left >= first + stride else first - 1
        stride *= 2
    stride = 1
    while right < last and not places[right] >= value:
        left = right
        right = min(right + stride, last)
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


@kernel
def feet(
    points, lower, upper, table, low, high, arcs, boxes, tree, first, run, bounds, direction, ahead
):  # fmt: skip
    """Nearest points of the path, each within its own window of it.

    The least squared distance of all segments in the window wins; among equals, the smallest place.
    A first guess is the distance to a place ahead of the foot before by as much as that one moved. With it,
    nearly all is out of reach: of the run of lines where the guess is, what lies farther ahead or behind
    along the run's direction; of the rest of the window, each box that is farther away. Both only spare
    work: what is passed over is farther by more than any rounding, so the result does not depend on them.

    points (n,3) mm; lower, upper (n,) mm of path; table (m,11) from `pack`; low, high (m,) mm of path;
    arcs (a,17); boxes (m,6); tree (b,6), first (l+1,) from `stack_boxes`; run (m,), bounds (r,2), direction
    (r,3), ahead (m,) from `runs`.
    Returns distance (n,), place (n,), segment (n,).
    """
    n, m, levels = points.shape[0], low.size, first.size - 1
    distance, place, segment = np.empty(n), np.empty(n), np.empty(n, np.int64)
    begin = finish = foot = advance = 0
    for k in range(n):
        x, y, z = points[k, 0], points[k, 1], points[k, 2]
        window_low = min(max(lower[k], low[0]), high[m - 1])
        window_high = max(min(upper[k], high[m - 1]), window_low)
        begin = min(seek(high, window_low, begin, 0, m), m - 1)  # the first that ends in the window or after
        finish = seek(low, window_high, finish, 0, m)  # the last that starts in the window or before
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
        within = beyond(bound)
        limit = within * within
        left, right, run_left, run_right = begin, finish, begin, finish
        r = run[guess]
        if finish - begin >= FEW and not direction[r, 0] == direction[r, 1] == direction[r, 2] == 0.0:
            run_left, run_right = max(bounds[r, 0], begin), min(bounds[r, 1], finish)
            along = direction[r, 0] * x + direction[r, 1] * y + direction[r, 2] * z
            reached = within + RUN_ROUNDING
            left = max(seek(ahead, along - reached, guess, run_left, run_right + 1) - 1, run_left)
            right = max(seek(ahead, along + reached, left, run_left, run_right + 1) - 1, left)
        for part in range(3):  # near in the run, before it, after it
            j, until = left, right
            if part == 1:
                j, until = begin, run_left - 1
            elif part == 2:
                j, until = run_right + 1, finish
            top = 0
            if until - j >= FEW:
                top = 1  # boxes larger than half the stretch tell nothing
                while top < levels and (2 << (FAN_BITS * (top + 1))) <= until - j:
                    top += 1
            level = top
            while j <= until:
                if level > 0:
                    block = j >> (FAN_BITS * level)
                    if box_distance_v2(tree, first[level - 1] + block, x, y, z) <= limit:
                        level -= 1
                        continue
                    j = (block + 1) << (FAN_BITS * level)
                else:
                    stop = until + 1 if top == 0 else min((j | (FAN - 1)) + 1, until + 1)
                    while j < stop:
                        if j == tried:
                            j += 1
                            continue
                        at = inf
                        if table[j, 7] < 0.0 and begin < j < finish:
                            d_v2, share = nearest_on_line(table, j, x, y, z, 0.0, 1.0)
                            if d_v2 <= best:
                                at = table[j, 8] + share * table[j, 9]
                        elif box_distance_v2(boxes, j, x, y, z) <= limit:
                            d_v2, at = nearest_on_segment(
                                table, arcs, j, x, y, z, window_low, window_high, limit
                            )
                        else:
                            d_v2 = inf
                        if d_v2 < best or (
                            d_v2 == best and (at < best_place or (at == best_place and j < foot))
                        ):
                            best, best_place, foot = d_v2, at, j
                            if best < bound:
                                bound, limit = best, reach(best)
                        j += 1
                    level = min(1, top)
                while level < top and j & ((1 << (FAN_BITS * (level + 1))) - 1) == 0:
                    level += 1  # the largest box that begins here
        distance[k], segment[k] = sqrt(best), foot
        place[k] = min(max(best_place, window_low), window_high)
        advance = foot - before
    return distance, place, segment


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
