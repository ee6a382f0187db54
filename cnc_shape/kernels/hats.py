"""The C2 path of hats over a polyline.

The second derivative of a polyline in its own length is an impulse at every vertex: the step D of the
tangent. Replacing each impulse by a triangle ("hat") of unit area and half-width l gives a path

    q(u) = P(u) + sum_i D_i l_i (1 - |x|)^3 / 6,      x = (u - u_i) / l_i,  |x| < 1

whose second derivative is continuous. Hats may overlap. Its distance from P is at most the sum S of the
terms' sizes, which is convex between vertices: S at the vertices bounds it everywhere.

Lengths along the path are integers, in ticks: sums are exact, so nothing depends on where a chunk starts.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel

TICK = 2.0**-38  # mm or rad, 3.6e-12
COLLINEAR = 1e-12  # -, a smaller step of the tangent is rounding
LONGEST_BLEND = 20.0  # mm, half-width of the widest hat
LONGEST_BLEND_RATIO = 300.0  # -, the same over the tolerance
ROTARY_BLEND_TOLERANCE = 9e-4  # rad, deviation of a rotary axis by rounding
ROUNDS = 9  # of fitting the widths; the last is a guarantee
SHRINK = 0.999
LARGEST_TURN = 0.15  # rad of turn in a cell
MOST_CELLS = 8  # in a span between two knots


@kernel
def edges(start, end, alone):
    """Ticks (n,) of the edges and their derivative by path parameter (n,d)."""
    n, d = start.shape
    ticks = np.zeros(n, np.int64)
    tangent = np.zeros((n, d))
    for k in range(n):
        square = 0.0
        low = 3 if alone[k] == 1 else 0
        high = d if alone[k] == 1 else 3
        for i in range(low, high):
            square += (end[k, i] - start[k, i]) ** 2
        rest = True
        for i in range(d):
            rest = rest and end[k, i] == start[k, i]
        if not rest:
            ticks[k] = max(1, int(np.rint(np.sqrt(square) / TICK)))
            for i in range(d):
                tangent[k, i] = (end[k, i] - start[k, i]) / (ticks[k] * TICK)
    return ticks, tangent


@kernel
def turns(tangent, stop):
    """Step of the tangent at the start of each edge: in XYZ (n,), and the largest of a rotary axis (n,)."""
    n, d = tangent.shape
    turn = np.zeros(n)
    twist = np.zeros(n)
    for k in range(1, n):
        if stop[k] == 1:
            continue
        square = 0.0
        for i in range(3):
            square += (tangent[k, i] - tangent[k - 1, i]) ** 2
        turn[k] = np.sqrt(square)
        for i in range(3, d):
            twist[k] = max(twist[k], abs(tangent[k, i] - tangent[k - 1, i]))
        if turn[k] < COLLINEAR:
            turn[k] = 0.0
        if twist[k] < COLLINEAR:
            twist[k] = 0.0
    return turn, twist


@kernel
def lipschitz(u, width):
    """Let neighbouring widths, in ticks, differ by half their distance at most.

    So the supports begin and end in the order of their vertices.
    """
    n = width.size
    for k in range(1, n):
        width[k] = min(width[k], width[k - 1] + ((u[k] - u[k - 1]) >> 1))
    for k in range(n - 2, -1, -1):
        width[k] = min(width[k], width[k + 1] + ((u[k + 1] - u[k]) >> 1))


@kernel
def first_widths(u, tolerance, turn, twist, stop):
    """Half-widths (n,) in ticks to start from: the widest of a corner by itself."""
    n = u.size
    width = np.zeros(n, np.int64)
    to_stop = np.int64(1) << 61
    for k in range(n):
        if stop[k] == 1:
            to_stop = 0
        elif k > 0:
            to_stop += u[k] - u[k - 1]
        width[k] = min(to_stop, np.int64(LONGEST_BLEND / TICK))
        if k == 0 or stop[k] == 1:
            continue
        budget = min(tolerance[k - 1], tolerance[k])
        length = min(LONGEST_BLEND, LONGEST_BLEND_RATIO * budget)
        if turn[k] > 0.0:
            half = min(1.0, 0.5 * turn[k])  # sin(theta/2)
            sine = 2.0 * half * np.sqrt(1.0 - half * half)
            alone = 6.0 * budget / sine if turn[k] <= 1.4142135623730951 and sine > 0.0 else 6.0 * budget
            shorter = u[k] - u[k - 1]
            if k + 1 < n:
                shorter = min(shorter, u[k + 1] - u[k])
            fits = 2.0 * alone <= shorter * TICK
            length = min(length, alone if fits else 3.0 * budget / half)
        if twist[k] > 0.0:
            length = min(length, 6.0 * ROTARY_BLEND_TOLERANCE / twist[k])
        width[k] = min(width[k], np.int64(length / TICK))
    to_stop = np.int64(1) << 61
    for k in range(n - 1, -1, -1):
        width[k] = min(width[k], to_stop)
        if stop[k] == 1:
            to_stop = 0
        if k > 0:
            to_stop += u[k] - u[k - 1]
    return width


@kernel
def widths(u, tolerance, turn, twist, stop):
    """Half-widths (n,) of the hats in ticks, such that the path stays within the edges' tolerances.

    Where the sizes of the hats that reach a vertex sum up to more than its tolerance, all of them shrink.
    A corner that no other hat reaches is measured across its edges and keeps its width. All rounds but the
    last shrink by half the excess in logarithms, because the other vertices shrink as well; the last one
    shrinks by all of it, which is enough by itself.
    """
    n = u.size
    width = first_widths(u, tolerance, turn, twist, stop)
    size = np.empty(n)
    swing = np.empty(n)
    others = np.empty(n, np.int64)
    factor = np.empty(n)
    for round_ in range(ROUNDS):
        segment = 0
        for k in range(1, n + 1):  # a stop neither takes nor gives a width
            if k == n or stop[k] == 1:
                lipschitz(u[segment + 1 : k], width[segment + 1 : k])
                segment = k
        size[:] = 0.0
        swing[:] = 0.0
        others[:] = 0
        for i in range(n):
            if width[i] == 0 or turn[i] + twist[i] == 0.0:
                continue
            length = width[i] * TICK
            size[i] += length * turn[i] / 6.0
            swing[i] += length * twist[i] / 6.0
            for side in (-1, 1):
                k = i + side
                while 0 <= k < n and abs(u[k] - u[i]) < width[i]:
                    y = 1.0 - abs(u[k] - u[i]) / width[i]
                    size[k] += length * turn[i] * y**3 / 6.0
                    swing[k] += length * twist[i] * y**3 / 6.0
                    others[k] += 1
                    k += side
        worst = 1.0
        for k in range(n):
            factor[k] = 1.0
            if k == 0 or stop[k] == 1:
                continue
            excess = swing[k] / ROTARY_BLEND_TOLERANCE
            if others[k] > 0:
                excess = max(excess, size[k] / min(tolerance[k - 1], tolerance[k]))
            if excess > 1.0 + 1e-9:
                factor[k] = SHRINK / (excess if round_ == ROUNDS - 1 else np.sqrt(excess))
                worst = max(worst, excess)
        if worst == 1.0:
            break
        for i in range(n):
            if width[i] == 0 or turn[i] + twist[i] == 0.0:
                continue
            least = factor[i]
            for side in (-1, 1):
                k = i + side
                while 0 <= k < n and abs(u[k] - u[i]) < width[i]:
                    least = min(least, factor[k])
                    k += side
            size[i] = least
        for i in range(n):
            if width[i] > 0 and turn[i] + twist[i] > 0.0 and size[i] < 1.0:
                width[i] = np.int64(width[i] * size[i])
    segment = 0
    for k in range(1, n + 1):
        if k == n or stop[k] == 1:
            lipschitz(u[segment + 1 : k], width[segment + 1 : k])
            segment = k
    return width


@kernel
def sum_hats(at, center, half, step, low, high, sums):
    """Add to the powers `sums` (4,d) at `at` the hats `low` to `high`, which all reach beyond it."""
    for j in range(low, high):
        wide = half[j] * TICK
        side = -1.0 if center[j] <= at else 1.0
        y = 1.0 - abs(at - center[j]) / half[j]
        zeroth = wide * y * y * y / 6.0
        first = side * y * y * 0.5
        second = y * 0.5 / wide
        third = side / (6.0 * wide * wide)
        for i in range(sums.shape[1]):
            sums[0, i] += step[j, i] * zeroth
            sums[1, i] += step[j, i] * first
            sums[2, i] += step[j, i] * second
            sums[3, i] += step[j, i] * third


@kernel
def parts_of(sums, h):
    """Return into how many cells a span of length `h` is cut, by the angle it turns through.

    A rotary axis counts by the relative change of its rate.
    """
    first = 0.0
    second = 0.0
    bend = 0.0
    for i in range(sums.shape[1]):
        begin = 2.0 * sums[2, i]
        finish = begin + 6.0 * sums[3, i] * h
        if i < 3:
            first += begin * begin
            second += finish * finish
        else:
            rise = max(abs(begin), abs(finish)) * h
            if rise > 1e-9:
                bend = max(bend, rise / (abs(sums[1, i]) + rise))
    bend = max(bend, np.sqrt(max(first, second)) * h)
    return min(MOST_CELLS, max(1, int(np.ceil(bend / LARGEST_TURN))))


@kernel
def grown(places, rows):
    """Return both arrays with room for twice as many cells."""
    count = places.shape[0]
    more_places = np.empty((2 * count, 3), np.int64)
    more_rows = np.empty((2 * count, rows.shape[1], rows.shape[2]))
    for k in range(count):
        for i in range(3):
            more_places[k, i] = places[k, i]
        for p in range(rows.shape[1]):
            for i in range(rows.shape[2]):
                more_rows[k, p, i] = rows[k, p, i]
    return more_places, more_rows


@kernel
def cells(start, u, ticks, tangent, turn, twist, width, begin, finish):
    """Cubic cells from vertex `begin` to vertex `finish`, every one summed afresh from the hats over it.

    Returns
    -------
    places (c,3)
        Edge the cell lies on, start of the cell after the edge's start and its length in ticks.
    rows (c,4,d)
        Coefficients of the powers 0 to 3.
    """
    n, d = start.shape
    hats = 0
    center = np.empty(n, np.int64)
    half = np.empty(n, np.int64)
    step = np.empty((n, d))
    for k in range(1, n):
        if width[k] > 0 and turn[k] + twist[k] > 0.0:
            center[hats] = u[k]
            half[hats] = width[k]
            for i in range(d):
                step[hats, i] = tangent[k, i] - tangent[k - 1, i]
            hats += 1
    capacity = 4 * (finish - begin) + 1024
    places = np.empty((capacity, 3), np.int64)
    rows = np.empty((capacity, 4, d))
    sums = np.empty((4, d))
    count = 0
    low = 0  # first hat that ends after `here`
    high = 0  # first hat that starts after `here`
    for k in range(begin, finish):
        here = u[k]
        until_edge = u[k] + ticks[k]
        while here < until_edge:
            while low < hats and center[low] + half[low] <= here:
                low += 1
            high = max(high, low)
            while high < hats and center[high] - half[high] <= here:
                high += 1
            until = until_edge
            if high < hats:
                until = min(until, center[high] - half[high])
            if low < high:
                until = min(until, center[low] + half[low])
            span = until - here
            parts = np.int64(0)
            part = np.int64(0)
            at = here
            while at < until:
                e = (at - u[k]) * TICK
                for i in range(d):
                    sums[0, i] = start[k, i] + tangent[k, i] * e
                    sums[1, i] = tangent[k, i]
                    sums[2, i] = 0.0
                    sums[3, i] = 0.0
                sum_hats(at, center, half, step, low, high, sums)
                if parts == 0:
                    parts = min(span, parts_of(sums, span * TICK))
                part += 1
                to = here + (span * part) // parts
                if count == capacity:
                    places, rows = grown(places, rows)
                    capacity *= 2
                places[count, 0] = k
                places[count, 1] = at - u[k]
                places[count, 2] = to - at
                for p in range(4):
                    for i in range(d):
                        rows[count, p, i] = sums[p, i]
                count += 1
                at = to
            here = until
    return places[:count], rows[:count]
