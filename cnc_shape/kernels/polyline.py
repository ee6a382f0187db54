"""Lines and arcs as straight edges: circumscribed polygons, and the merging of short edges."""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel

ARC = 2  # Motion.ARC; Motion.RAPID and Motion.FEED are lines
DWELL = 6  # Motion.DWELL
EXACT_STOP = 0  # PathMode
BLEND = 2

LARGEST_STEP = 0.35  # rad, angle of a polygon's edge seen from the arc's centre
ARC_SHARE = 1.0 / 12.0  # the polygon's unit of error as a share of the path tolerance; it uses three of them
NO_TRAVEL = 1e-9  # mm, a move with less XYZ travel that turns rotary axes is rotary-only
COS_REVERSAL = -0.9659258262890683  # cos 165 degrees
EXACT_PATH_TOLERANCE = 1e-3  # mm, transition where an exact path bends without a corner
COS_EXACT_CORNER = 0.9998476951563913  # cos 1 degree: a sharper corner of an exact path is a stop
ROTARY_MERGE_TOLERANCE = 1e-4  # rad
WINDOW = 64  # edges that one chord may replace


@kernel
def arc_radii(start, end, center, normal):
    """Radius at both ends of an arc and the rise of its end along the normal, mm."""
    rise = 0.0
    inner = 0.0
    outer = 0.0
    for i in range(3):
        rise += (end[i] - start[i]) * normal[i]
    for i in range(3):
        inner += (start[i] - center[i]) ** 2
        outer += (end[i] - center[i] - rise * normal[i]) ** 2
    return np.sqrt(inner), np.sqrt(outer), rise


@kernel
def arc_edges(radius_start, radius_end, rise, sweep, tolerance):
    """Vertices of the polygon about an arc of `sweep` rad, and its largest distance from the arc, mm.

    The polygon touches the arc in the middle of every edge; its corners lie outside by
    ``r (1/cos(phi/2) - 1)``. Where the radius or the height changes with the angle (spiral, helix), the
    straight edge also misses the curve by a third-order term in z and r, and a second-order one in r.
    """
    unit = ARC_SHARE * tolerance
    angle = abs(sweep)
    largest = max(radius_start, radius_end)
    smallest = max(min(radius_start, radius_end), 0.01 * largest)
    climb = abs(rise) / angle
    spiral = abs(radius_end - radius_start) / angle
    step = min(LARGEST_STEP, np.sqrt(24.0 * unit / largest))
    if climb + spiral > 0.0:
        step = min(step, (10.0 * unit / (climb + spiral)) ** (1.0 / 3.0))
    if spiral > 0.0:
        step = min(step, np.sqrt(unit * smallest) / spiral)
    count = max(1, int(np.ceil(angle / step)))
    step = angle / count
    distance = (
        largest * (1.0 / np.cos(0.5 * step) - 1.0)
        + 0.02 * (climb + spiral) * step**3
        + 0.5 * (spiral * step) ** 2 / smallest
    )
    return count, distance


@kernel
def polygonize(
    kind,
    start,
    end,
    center,
    normal,
    sweep,
    feed_rate,
    dwell,
    mode,
    tolerance,
    arc_length,
    line,
    memory,
    flags,
):
    """Turn the rows of a toolpath into straight edges, and mark where the path rests.

    `memory` (1+d,): dwell to come, direction in which the last row ended; `flags` (5,): a row came
    before, it ends in an exact stop, it is exact, it is rotary-only, a stop is to come. Both are updated
    in place. `tolerance` (m,) mm has no nan.

    Returns
    -------
    start, end (n,d)
    values (6,n)
        Place and travel on the toolpath, tolerance, what of it the polygon uses, mm; feed rate; dwell.
    marks (4,n)
        Line, stop, rotary-only, and the toolpath's row (``-1 - row`` for edges of an arc).
    """
    rows, d = start.shape
    total = 0
    counts = np.zeros(rows, np.int64)
    budgets = np.empty(rows)
    spents = np.zeros(rows)
    for r in range(rows):
        budgets[r] = tolerance[r]
        if mode[r] != BLEND or tolerance[r] <= 0.0:
            budgets[r] = EXACT_PATH_TOLERANCE
        if kind[r] == DWELL:
            continue
        counts[r] = 1
        if kind[r] == ARC:
            inner, outer, rise = arc_radii(start[r], end[r], center[r], normal[r])
            count, spents[r] = arc_edges(inner, outer, rise, sweep[r], budgets[r])
            counts[r] = count + 1
        total += counts[r]

    o_start = np.empty((total, d))
    o_end = np.empty((total, d))
    o_values = np.empty((6, total))  # place, travel, tolerance, spent, feed_rate, dwell
    o_marks = np.zeros((4, total), np.int64)  # line, stop, alone, row
    n = 0
    direction = np.empty(d)
    point = np.empty(d)
    for r in range(rows):
        if kind[r] == DWELL:
            flags[4] = 1
            memory[0] += dwell[r]
            continue
        first = n
        travel = arc_length[r + 1] - arc_length[r]
        alone = False
        if kind[r] == ARC:
            count = counts[r] - 1
            inner, outer, rise = arc_radii(start[r], end[r], center[r], normal[r])
            lift = 1.0 / np.cos(0.5 * sweep[r] / count)
            o_start[n] = start[r]
            o_values[0, n] = arc_length[r]
            for k in range(count):
                share = (k + 0.5) / count
                angle = sweep[r] * share
                scale = (inner + (outer - inner) * share) / inner * lift
                c = scale * np.cos(angle)
                s = scale * np.sin(angle)
                for i in range(3):
                    j = (i + 1) % 3
                    m = (i + 2) % 3
                    arm = start[r, i] - center[r, i]
                    side = normal[r, j] * (start[r, m] - center[r, m]) - normal[r, m] * (
                        start[r, j] - center[r, j]
                    )
                    point[i] = center[r, i] + c * arm + s * side + rise * share * normal[r, i]
                for i in range(3, d):
                    point[i] = start[r, i] + (end[r, i] - start[r, i]) * share
                o_end[n] = point
                o_values[1, n] = travel * (0.5 if k == 0 else 1.0) / count
                n += 1
                o_start[n] = point
                o_values[0, n] = arc_length[r] + travel * share
            o_end[n] = end[r]
            o_values[1, n] = travel * 0.5 / count
            n += 1
        else:
            o_start[n] = start[r]
            o_end[n] = end[r]
            o_values[0, n] = arc_length[r]
            o_values[1, n] = travel
            square = 0.0
            turn = 0.0
            for i in range(d):
                if i < 3:
                    square += (end[r, i] - start[r, i]) ** 2
                else:
                    turn += (end[r, i] - start[r, i]) ** 2
            alone = np.sqrt(square) < NO_TRAVEL and turn > 0.0
            n += 1
        for k in range(first, n):
            o_values[2, k] = budgets[r]
            o_values[3, k] = spents[r]
            o_values[4, k] = feed_rate[r]
            o_values[5, k] = 0.0
            o_marks[0, k] = line[r]
            o_marks[2, k] = 1 if alone else 0
            o_marks[3, k] = r if kind[r] != ARC else -1 - r

        exact = mode[r] != BLEND or tolerance[r] <= 0.0
        cosine = 0.0
        norm = 0.0
        for i in range(3):
            direction[i] = o_end[first, i] - o_start[first, i]
            norm += direction[i] ** 2
            cosine += direction[i] * memory[1 + i]
        cosine /= max(np.sqrt(norm), 1e-300)
        stop = (
            flags[0] == 0 or flags[1] == 1 or flags[4] == 1 or flags[3] == 1 or alone or cosine < COS_REVERSAL
        )
        if (exact or flags[2] == 1) and cosine < COS_EXACT_CORNER:
            stop = True
        if stop:
            o_marks[1, first] = 1
            o_values[5, first] = memory[0]
            memory[0] = 0.0
        norm = 0.0
        for i in range(3):
            direction[i] = o_end[n - 1, i] - o_start[n - 1, i]
            norm += direction[i] ** 2
        for i in range(3):
            memory[1 + i] = direction[i] / max(np.sqrt(norm), 1e-300)
        flags[0] = 1
        flags[1] = 1 if mode[r] == EXACT_STOP else 0
        flags[2] = 1 if exact else 0
        flags[3] = 1 if alone else 0
        flags[4] = 0
    return o_start, o_end, o_values, o_marks


@kernel
def chord_reach(start, end, first, stop, tolerance, noise_only):
    """Return how many edges from `first` on one chord may replace, and its distance from them, mm.

    Extends the chord edge by edge, at most to `stop`, while every vertex it skips is within `tolerance`,
    passed in order, and no rotary axis is off by more than its own tolerance. With `noise_only` the
    vertices must also turn to and fro: their turns add up to less than a tenth of their sizes.
    """
    d = start.shape[1]
    best = 1
    distance = 0.0
    chord = np.empty(d)
    for last in range(first + 1, stop):
        square = 0.0
        for i in range(d):
            chord[i] = end[last, i] - start[first, i]
            if i < 3:
                square += chord[i] * chord[i]
        if square <= 0.0:
            break
        worst = 0.0
        before = 0.0
        kept = True
        for k in range(first, last):
            progress = 0.0
            for i in range(3):
                progress += (end[k, i] - start[first, i]) * chord[i]
            progress /= square
            if progress < before or progress > 1.0:
                kept = False
                break
            before = progress
            off = 0.0
            for i in range(d):
                miss = end[k, i] - start[first, i] - progress * chord[i]
                if i < 3:
                    off += miss * miss
                elif abs(miss) > ROTARY_MERGE_TOLERANCE:
                    kept = False
            worst = max(worst, off)
            if off > tolerance * tolerance:
                kept = False
            if not kept:
                break
        if not kept:
            break
        best = last - first + 1
        distance = np.sqrt(worst)
    if noise_only and best > 1:
        sizes = 0.0
        total = np.zeros(3)
        before_v = np.zeros(3)
        for k in range(first, first + best):
            length = 0.0
            for i in range(3):
                length += (end[k, i] - start[k, i]) ** 2
            length = max(np.sqrt(length), 1e-300)
            size = 0.0
            for i in range(3):
                tangent = (end[k, i] - start[k, i]) / length
                if k > first:
                    turn = tangent - before_v[i]
                    size += turn * turn
                    total[i] += turn
                before_v[i] = tangent
            sizes += np.sqrt(size)
        net = np.sqrt(total[0] ** 2 + total[1] ** 2 + total[2] ** 2)
        if best < 8 or net > 0.1 * sizes:
            return 1, 0.0
    return best, distance


@kernel
def merge(start, end, tolerance, merge_tolerance, noise_tolerance, feed_rate, stop, whole, final):
    """Greedy chords: for each edge that is kept, its first edge, the edge after it, and its distance.

    Edges merge only with edges of equal feed and tolerances that are `whole` moves, and never over a stop.
    Without `final` the edges whose chord may yet grow are left for the next call.

    Returns
    -------
    first (n,), after (n,), distance (n,) mm
    """
    m = start.shape[0]
    first = np.empty(m, np.int64)
    after = np.empty(m, np.int64)
    distance = np.empty(m)
    n = 0
    k = 0
    while k < m:
        limit = k + 1
        if whole[k] == 1:
            while (
                limit < m
                and limit - k < WINDOW
                and stop[limit] == 0
                and whole[limit] == 1
                and feed_rate[limit] == feed_rate[k]
                and tolerance[limit] == tolerance[k]
                and merge_tolerance[limit] == merge_tolerance[k]
                and noise_tolerance[limit] == noise_tolerance[k]
            ):
                limit += 1
        if limit == m and not final and limit - k < WINDOW and whole[k] == 1:
            break
        count = 1
        off = 0.0
        if limit > k + 1:
            count, off = chord_reach(start, end, k, limit, merge_tolerance[k], False)
            if count <= 3 and noise_tolerance[k] > merge_tolerance[k]:
                noise, noise_off = chord_reach(start, end, k, limit, noise_tolerance[k], True)
                if noise > count:
                    count = noise
                    off = noise_off
        first[n] = k
        after[n] = k + count
        distance[n] = off
        n += 1
        k += count
    return first[:n], after[:n], distance[:n]
