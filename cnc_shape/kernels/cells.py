"""The path of hats (`hats.py`) as cubic cells."""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.hats import TICK

LARGEST_TURN = 0.1  # rad of turn in a cell
MOST_CELLS = 8  # in a span between two knots


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
                near = k if at - u[k] <= until_edge - at else k + 1  # the nearer vertex rounds less
                e = (at - u[near]) * TICK
                for i in range(d):
                    sums[0, i] = start[near, i] + tangent[k, i] * e
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
