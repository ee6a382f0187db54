"""A law as a quadratic spline of x = v^2 over the place, and back as phases of constant path jerk.

The nodes lie at the borders of the cells and between, the borders of the spline's segments halfway between
the nodes: so x'', and with it the jerk, changes halfway between nodes, and a node lies in a segment.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.jerk_phases import moved
from cnc_shape.kernels.jerk_pieces import put_piece
from cnc_shape.kernels.speed_limits import ends

MOST_STEPS = 30
MOST_NODES = 64  # of a cell
LEAST_NODES = 6  # of a window


@kernel
def window_nodes(pieces, cell, begin, start, end, finish, step, at, at_cell, law):
    """Nodes of a law between two of its points: cells, places in them, and x, a, b/v there; their number.

    Parameters
    ----------
    begin, start, end, finish
        First piece and the time in it, last piece and the time in it.
    step
        Time between nodes, at most; between them the cells are cut in equal times.
    at (n,), at_cell (n,), law (n,3)
        Output. The last node belongs to the cell before it.
    """
    n = 0
    m = begin
    while m <= end:
        last = m
        whole = 0.0
        while last <= end and cell[last] == cell[m]:
            whole += (finish if last == end else pieces[last, 1]) - (start if last == begin else 0.0)
            last += 1
        parts = max(1, min(MOST_NODES, int(np.ceil(whole / step))))
        if n + parts + 1 > at.size:
            return 0
        piece = m
        gone = 0.0
        for part in range(parts):
            wanted = whole * part / parts
            while True:
                low = start if piece == begin else 0.0
                high = finish if piece == end else pieces[piece, 1]
                if wanted <= gone + (high - low) or piece == last - 1:
                    break
                gone += high - low
                piece += 1
            t = low + (wanted - gone)
            put_node(pieces, cell, piece, t, n, at, at_cell, law)
            if part == 0 and m > begin:
                at[n] = 0.0
                law[n, 2] = 0.5 * (law[n, 2] + pieces[m - 1, 5] / np.sqrt(law[n, 0]))
            n += 1
        m = last
    put_node(pieces, cell, end, finish, n, at, at_cell, law)
    return n + 1


@kernel
def put_node(pieces, cell, piece, t, n, at, at_cell, law):
    """Write a node at a point of the law."""
    v = pieces[piece, 3] + t * (pieces[piece, 4] + t * pieces[piece, 5] / 2.0)
    at[n] = pieces[piece, 2] + moved(pieces[piece, 3], pieces[piece, 4], pieces[piece, 5], t)
    at_cell[n] = cell[piece]
    law[n, 0] = v * v
    law[n, 1] = pieces[piece, 4] + t * pieces[piece, 5]
    law[n, 2] = pieces[piece, 5] / v


@kernel
def spline(at, at_cell, law, length, place, border, centre, c):
    """Places (n,) of the nodes, borders (n+1,), centres (n+2,) and coefficients (n+2,) of the spline."""
    n = at.size
    place[0] = 0.0
    for k in range(1, n):
        here = at[k] if k == n - 1 or at_cell[k] == at_cell[k - 1] else length[at_cell[k - 1]]
        place[k] = place[k - 1] + (here - at[k - 1])
    border[0] = place[0]
    border[n] = place[n - 1]
    for k in range(1, n):
        border[k] = 0.5 * (place[k - 1] + place[k])
    centre[0] = border[0]
    centre[n + 1] = border[n]
    for k in range(n):
        centre[k + 1] = 0.5 * (border[k] + border[k + 1])
        before = border[k] - place[k]
        after = border[k + 1] - place[k]
        c[k + 1] = law[k, 0] + law[k, 1] * (before + after) + law[k, 2] * before * after
    c[0] = law[0, 0]
    c[1] = law[0, 0] + 2.0 * law[0, 1] * (centre[1] - centre[0])
    c[n] = law[n - 1, 0] - 2.0 * law[n - 1, 1] * (centre[n + 1] - centre[n])
    c[n + 1] = law[n - 1, 0]


@kernel
def limit_rows(
    place, border, centre, at, at_cell, rows, straight_a, limit_v2, acceleration, jerk, value, row, cap
):
    """What the limits are in the coefficients (`jerk_interior.interior`): value, rows, cap."""
    n = place.size
    d = acceleration.size
    first = np.empty(d)
    bend = np.empty(d)
    same_first = np.empty(d)
    same_bend = np.empty(d)
    for s in range(n):
        left = 1.0 / (centre[s + 1] - centre[s])
        right = 1.0 / (centre[s + 2] - centre[s + 1])
        whole = border[s + 1] - border[s]
        off = border[s] - centre[s]
        for p in range(4):
            k = max(s - 1, 0) if p < 2 else min(s, n - 2)
            here = border[s] if p == 0 else (border[s + 1] if p == 3 else place[s])
            e = here - border[s]
            x2 = (left / whole, -(left + right) / whole, right / whole)
            x1 = (-left + x2[0] * e, left + x2[1] * e, x2[2] * e)
            x0 = (
                1.0 - left * (off + e) + x2[0] * e * e / 2.0,
                left * (off + e) + x2[1] * e * e / 2.0,
                x2[2] * e * e / 2.0,
            )
            own = at_cell[k]
            cap[s, p] = min(limit_v2[own, 0], limit_v2[own, 1])
            ends(rows[own], at[k] + (here - place[k]), same_first, same_bend, first, bend)
            steepest = 0
            sharpest = 0
            for i in range(3):
                value[s, p, i] = x0[i]
            for i in range(d):
                if abs(first[i]) * acceleration[steepest] > abs(first[steepest]) * acceleration[i]:
                    steepest = i
                if abs(first[i]) * jerk[sharpest] > abs(first[sharpest]) * jerk[i]:
                    sharpest = i
            for i in range(d):
                third = 6.0 * rows[own, 3, i]
                keep_a = (p > 0 or s == 0) and (straight_a[own] == 0.0 or i == steepest)
                keep_b = straight_a[own] == 0.0 or i == sharpest
                for n3 in range(3):
                    row[s, p, i, n3] = 0.0
                    row[s, p, d + i, n3] = 0.0
                    if keep_a:
                        row[s, p, i, n3] = (0.5 * first[i] * x1[n3] + bend[i] * x0[n3]) / acceleration[i]
                    if keep_b:
                        load = 0.5 * first[i] * x2[n3] + 1.5 * bend[i] * x1[n3] + third * x0[n3]
                        row[s, p, d + i, n3] = load / jerk[i]


@kernel
def after(v, a, b, h, guess):
    """Time, speed and acceleration after a distance `h`."""
    t = guess
    for _ in range(MOST_STEPS):
        step = (moved(v, a, b, t) - h) / (v + t * (a + t * b / 2.0))
        t -= step
        if not abs(step) > 1e-16 * t:
            break
    return t, v + t * (a + t * b / 2.0), a + b * t


@kernel
def two_phases(v0, a0, v1, a1, h1, h2, b, out):
    """Two phases over `h1` and `h2` from one speed and acceleration to another: whether they are found.

    `out` (6,): time and jerk of the first, speed, acceleration, time and jerk of the second.
    """
    b1 = b
    b2 = b
    size = miss_v = miss_a = t1 = t2 = 0.0
    for _ in range(MOST_STEPS):
        t1, v, a = after(v0, a0, b1, h1, 2.0 * h1 / (v0 + v1))
        t2, end_v, end_a = after(v, a, b2, h2, h2 / v1)
        out[0] = t1
        out[1] = b1
        out[2] = v
        out[3] = a
        out[4] = t2
        out[5] = b2
        miss_v = v1 - end_v
        miss_a = a1 - end_a
        size = abs(a0) + abs(a1) + abs(b1) * t1
        if abs(miss_v) <= 1e-14 * v1 + 1e-12 and abs(miss_a) <= 1e-12 * size:
            return t1 > 0.0 and t2 > 0.0
        t_b1 = -t1 * t1 * t1 / 6.0 / v
        v_b1 = t1 * t1 / 2.0 + a * t_b1
        a_b1 = t1 + b1 * t_b1
        t_b2 = -t2 * t2 * t2 / 6.0 / end_v
        v_b2 = t2 * t2 / 2.0 + end_a * t_b2
        a_b2 = t2 + b2 * t_b2
        shift = -(t2 * v_b1 + t2 * t2 / 2.0 * a_b1) / end_v
        end_v_b1 = v_b1 + t2 * a_b1 + end_a * shift
        end_a_b1 = a_b1 + b2 * shift
        determinant = end_v_b1 * a_b2 - v_b2 * end_a_b1
        if determinant == 0.0:
            return False
        b1 += (miss_v * a_b2 - v_b2 * miss_a) / determinant
        b2 += (end_v_b1 * miss_a - end_a_b1 * miss_v) / determinant
    return abs(miss_v) <= 1e-10 and abs(miss_a) <= 1e-8 * size and t1 > 0.0 and t2 > 0.0


@kernel
def spline_phases(c, place, border, centre, at, at_cell, pieces, cell):
    """Phases of a spline as pieces (m,6), two for every segment, cut at the nodes; 0 where there are none."""
    n = place.size
    out = np.empty(6)
    filled = 0
    for s in range(n):
        slope = (c[s + 1] - c[s]) / (centre[s + 1] - centre[s])
        end_slope = (c[s + 2] - c[s + 1]) / (centre[s + 2] - centre[s + 1])
        x = c[s] + slope * (border[s] - centre[s])
        end_x = c[s + 1] + end_slope * (border[s + 1] - centre[s + 1])
        if not (x > 0.0 and end_x > 0.0):
            return 0
        v = np.sqrt(x)
        end_v = np.sqrt(end_x)
        half = 0.5 * (border[s + 1] - border[s])
        b = 0.25 * (end_slope - slope) / (2.0 * half) * (v + end_v)
        if not two_phases(v, 0.5 * slope, end_v, 0.5 * end_slope, half, half, b, out):
            return 0
        before = max(s - 1, 0)
        own = at_cell[before]
        here = at[before] + (border[s] - place[before])
        left = place[s] - border[s] if 0 < s < n - 1 else np.inf  # to the node
        for part in range(2):
            t = out[4 * part]
            b = out[1 + 4 * part]
            v = np.sqrt(x) if part == 0 else out[2]
            a = 0.5 * slope if part == 0 else out[3]
            begin = 0.0
            if left <= half:
                if left > 0.0:
                    begin, v1, a1 = after(v, a, b, left, t * left / half)
                    put_piece(pieces, cell, filled, begin, here, v, a, b, own)
                    filled += 1
                    v = v1
                    a = a1
                own = at_cell[s]
                here = at[s]
                left = half - left
                put_piece(pieces, cell, filled, max(t - begin, 0.0), here, v, a, b, own)
                filled += 1
                here += left
                left = np.inf
            else:
                put_piece(pieces, cell, filled, t, here, v, a, b, own)
                filled += 1
                here += half
                left -= half
    return filled
