"""What a time law with jerk asks of the machine, and whether its pieces follow each other.

Along a piece the acceleration and jerk of an axis are ``q' a + q'' v^2`` and ``q' b + 3 q'' v a + q''' v^3``.
A smooth function exceeds its values at the ends of an interval of length h by at most ``h^2/8`` of its
largest second derivative. Those are

    q'' (4 v b + 3 a^2) + 6 q''' v^2 a,     10 q'' a b + q''' v (10 v b + 15 a^2)

so most pieces are known to keep their limits by a look at both ends; halving a piece brings the bound nearer.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import inlined, kernel
from cnc_shape.kernels.jerk_phases import moved

POINTS = 9  # of a piece at which the jerk by curvature is looked at
SMALLEST_SHARE = 1.0 / 64.0  # -, of a piece that is halved
UNSURE = 1e-3  # -, of the limit, between the bound of an excess and what is there for sure


@inlined
def largest_loads(c, s, v, a, b, t, acceleration, jerk, enough_a, enough_j):
    """Bounds of the ratios of acceleration and jerk to their limits along a piece.

    As near as it takes to tell them from `enough_a` and `enough_j`, and to know those that are more.
    """
    found_a = 0.0
    found_j = 0.0
    share = 1.0
    begin = 0.0
    while begin < 1.0:
        h = share * t
        e = begin * t
        s0 = s + moved(v, a, b, e)
        v0 = v + e * (a + e * b / 2.0)
        a0 = a + e * b
        s1 = s0 + moved(v0, a0, b, h)
        v1 = v0 + h * (a0 + h * b / 2.0)
        a1 = a0 + h * b
        most_a = max(abs(a0), abs(a1))
        most_v = max(v0, v1) + (abs(b) * h * h / 8.0 if b < 0.0 else 0.0)
        bend_a = 4.0 * most_v * abs(b) + 3.0 * most_a * most_a
        third_a = 6.0 * most_v * most_v * most_a
        bend_j = 10.0 * most_a * abs(b)
        third_j = most_v * (10.0 * most_v * abs(b) + 15.0 * most_a * most_a)
        square = h * h / 8.0
        sure_a = 0.0
        sure_j = 0.0
        bound_a = 0.0
        bound_j = 0.0
        for i in range(acceleration.size):
            third = 6.0 * c[3, i]
            bend0 = 2.0 * c[2, i] + third * s0
            bend1 = 2.0 * c[2, i] + third * s1
            first0 = c[1, i] + s0 * (2.0 * c[2, i] + 0.5 * third * s0)
            first1 = c[1, i] + s1 * (2.0 * c[2, i] + 0.5 * third * s1)
            load_a = max(abs(first0 * a0 + bend0 * v0 * v0), abs(first1 * a1 + bend1 * v1 * v1))
            load_j = max(
                abs(first0 * b + v0 * (3.0 * bend0 * a0 + third * v0 * v0)),
                abs(first1 * b + v1 * (3.0 * bend1 * a1 + third * v1 * v1)),
            )
            bend = max(abs(bend0), abs(bend1))
            third = abs(third)
            sure_a = max(sure_a, load_a / acceleration[i])
            sure_j = max(sure_j, load_j / jerk[i])
            bound_a = max(bound_a, (load_a + square * (bend * bend_a + third * third_a)) / acceleration[i])
            bound_j = max(bound_j, (load_j + square * (bend * bend_j + third * third_j)) / jerk[i])
        unsure = bound_a > max(enough_a, found_a) and (sure_a <= enough_a or bound_a - sure_a > UNSURE)
        if bound_j > max(enough_j, found_j) and (sure_j <= enough_j or bound_j - sure_j > UNSURE):
            unsure = True
        if unsure and share > SMALLEST_SHARE:
            share *= 0.5
            continue
        found_a = max(found_a, bound_a)
        found_j = max(found_j, bound_j)
        begin += share
        while share < 1.0 and begin % (2.0 * share) == 0.0:
            share *= 2.0
    return found_a, found_j


@inlined
def axis_motion(c, i, s, v, a, b):
    """Velocity, acceleration and jerk of the axis `i` at the place `s` in a cell."""
    third = 6.0 * c[3, i]
    bend = 2.0 * c[2, i] + third * s
    first = c[1, i] + s * (2.0 * c[2, i] + 3.0 * c[3, i] * s)
    return first * v, first * a + bend * v * v, first * b + v * (3.0 * bend * a + third * v * v)


@kernel
def piece_loads(c, alone, s, v, a, b, velocity, acceleration, jerk, feed_rate, worst):
    """Raise `worst` (4,) to a point's ratios of velocity, acceleration, jerk and feed to their limits."""
    square = 0.0
    for i in range(velocity.size):
        moving, pushed, jerked = axis_motion(c, i, s, v, a, b)
        if (i < 3) != (alone == 1):
            square += moving * moving
        worst[0] = max(worst[0], abs(moving) / velocity[i])
        worst[1] = max(worst[1], abs(pushed) / acceleration[i])
        worst[2] = max(worst[2], abs(jerked) / jerk[i])
    worst[3] = max(worst[3], np.sqrt(square) / feed_rate)


@kernel
def certificate(
    pieces, cell, begin, end, straight_a, rows, first_cell, acceleration, jerk, tolerances, worst
):
    """Largest ratios (k,5) of what the law asks for to the limits, in the cells of pieces `begin` to `end`.

    Acceleration; jerk where the path jerk b is 0, where it is positive, where it is negative; jerk but for
    that by b. The first four are bounds, as near as it takes to tell them from what is tolerated; the last is
    looked for at some points of the pieces of cells with too much. Straight cells keep their limits, and a
    law below the envelope those of velocity and feed: they are not looked at.
    """
    m = begin
    while m < end:
        k = cell[m]
        first = m
        worst[k, :] = 0.0
        while m < end and cell[m] == k:
            m += 1
        if straight_a[k] > 0.0:
            continue
        whole = first_cell + k
        most = 0.0
        for n in range(first, m):
            b = pieces[n, 5]
            most_a, most_j = largest_loads(
                rows[whole], pieces[n, 2], pieces[n, 3], pieces[n, 4], b, pieces[n, 1], acceleration, jerk,
                1.0 + tolerances[1], 1.0 + tolerances[2],
            )  # fmt: skip
            worst[k, 0] = max(worst[k, 0], most_a)
            kind = 1 if b == 0.0 else (2 if b > 0.0 else 3)
            worst[k, kind] = max(worst[k, kind], most_j)
            most = max(most, most_j)
        if most <= 1.0 + tolerances[2]:
            continue
        for n in range(first, m):
            v = pieces[n, 3]
            a = pieces[n, 4]
            b = pieces[n, 5]
            for p in range(POINTS):
                e = pieces[n, 1] * p / (POINTS - 1)
                s = pieces[n, 2] + moved(v, a, b, e)
                for i in range(jerk.size):
                    _, _, asked = axis_motion(rows[whole], i, s, v + e * (a + e * b / 2.0), a + e * b, 0.0)
                    worst[k, 4] = max(worst[k, 4], abs(asked) / jerk[i])


@kernel
def law_excesses(
    duration,
    u,
    speed,
    path_acceleration,
    path_jerk,
    cell,
    rows,
    length,
    feed_rate,
    alone,
    stop,
    limits,
    points,
):
    """Largest ratios of velocity, acceleration, jerk and feed to their limits; largest gaps between pieces.

    Evaluates `points` points of every piece. `limits` (3,d): velocity, acceleration, jerk.

    Returns
    -------
    worst (7,)
        The four ratios; gaps of place, path speed and path acceleration.
    where (7,)
        Pieces.
    """
    worst = np.zeros(7)
    where = np.zeros(7, np.int64)
    here = np.empty(4)
    for m in range(duration.size):
        k = cell[m]
        here[:] = 0.0
        s = u[m]
        v = speed[m]
        a = path_acceleration[m]
        b = path_jerk[m]
        for n in range(points):
            e = duration[m] * n / (points - 1)
            s = u[m] + moved(speed[m], path_acceleration[m], b, e)
            v = speed[m] + e * (path_acceleration[m] + e * b / 2.0)
            a = path_acceleration[m] + e * b
            piece_loads(rows[k], alone[k], s, v, a, b, limits[0], limits[1], limits[2], feed_rate[k], here)
        for n in range(4):
            if here[n] > worst[n]:
                worst[n] = here[n]
                where[n] = m
        if m + 1 == duration.size:
            gap = abs(length[k] - s)
            jump = abs(v)
            step = abs(a)
        elif cell[m + 1] == k:
            gap = abs(u[m + 1] - s)
            jump = abs(speed[m + 1] - v)
            step = abs(path_acceleration[m + 1] - a)
        else:
            gap = abs(length[k] - s) + abs(u[m + 1])
            if cell[m + 1] != k + 1:
                gap = np.inf
            jump = abs(speed[m + 1] - v)
            step = abs(path_acceleration[m + 1] - a)
            if stop[k + 1] == 1:
                jump = max(abs(v), abs(speed[m + 1]))
                step = max(abs(a), abs(path_acceleration[m + 1]))
        for n, value in ((4, gap), (5, jump), (6, step)):
            if value > worst[n]:
                worst[n] = value
                where[n] = m
    return worst, where
