"""What a time law with jerk asks of the machine, and whether its pieces follow each other.

Along a piece the jerk of an axis, ``q' b + 3 q'' v a + q''' v^3``, is a polynomial of degree 6 in time: where
none of its Bernstein coefficients exceeds the limit, it does not; halving the piece brings them nearer.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.jerk_phases import moved

POINTS = 9  # of a piece at which velocity, acceleration and feed are looked at in planning
SMALLEST_SHARE = 1.0 / 64.0  # -, of a piece that is halved


@kernel
def in_bernstein(powers, out):
    """Bernstein coefficients (n+1,) of a polynomial of degree n on [0, 1], from its powers (n+1,)."""
    degree = out.size - 1
    for i in range(degree + 1):
        value = 0.0
        share = 1.0  # binomial(i, k) over binomial(degree, k)
        for k in range(i + 1):
            value += share * powers[k]
            if k < degree:
                share *= (i - k) / (degree - k)
        out[i] = value


@kernel
def jerk_parts(s, v, a, b, t, powers, parts):
    """Bernstein coefficients (5,7) of s, s^2, v a, s v a and v^3 along a piece; `powers` (5,7) is scratch."""
    s1 = v * t
    s2 = a * t * t / 2.0
    s3 = b * t * t * t / 6.0
    v1 = a * t
    v2 = b * t * t / 2.0
    a1 = b * t
    powers[:] = 0.0
    place = (s, s1, s2, s3)
    speed = (v, v1, v2)
    for i in range(4):
        powers[0, i] = place[i]
        for j in range(4):
            powers[1, i + j] += place[i] * place[j]
    for i in range(3):
        powers[2, i] += speed[i] * a
        powers[2, i + 1] += speed[i] * a1
        for j in range(3):
            for k in range(3):
                powers[4, i + j + k] += speed[i] * speed[j] * speed[k]
    for i in range(4):
        for j in range(4):
            powers[3, i + j] += place[i] * powers[2, j]
    for n in range(5):
        in_bernstein(powers[n], parts[n])


@kernel
def jerk_bound(c, s, v, a, b, t, jerk, enough, powers, parts, waiting):
    """Bound of the ratio of jerk to its limit along a piece, as near as it takes to tell it from `enough`.

    `waiting` (n,2) is scratch: parts of the piece that are still to be looked at.
    """
    found = 0.0
    waiting[0, 0] = 0.0
    waiting[0, 1] = 1.0
    count = 1
    while count > 0:
        count -= 1
        begin = waiting[count, 0]
        share = waiting[count, 1]
        e = begin * t
        here_v = v + e * (a + e * b / 2.0)
        here_a = a + e * b
        jerk_parts(s + moved(v, a, b, e), here_v, here_a, b, share * t, powers, parts)
        bound = 0.0
        sure = 0.0
        for i in range(jerk.size):
            for n in range(7):
                first = c[1, i] + 2.0 * c[2, i] * parts[0, n] + 3.0 * c[3, i] * parts[1, n]
                bent = 6.0 * c[2, i] * parts[2, n] + 18.0 * c[3, i] * parts[3, n]
                load = abs(first * b + bent + 6.0 * c[3, i] * parts[4, n]) / jerk[i]
                bound = max(bound, load)
                if n == 0 or n == 6:
                    sure = max(sure, load)
        if bound > enough and sure <= enough and share > SMALLEST_SHARE:
            for half in range(2):
                waiting[count, 0] = begin + half * 0.5 * share
                waiting[count, 1] = 0.5 * share
                count += 1
        else:
            found = max(found, bound)
    return found


@kernel
def acceleration_bound(c, s, v, a, b, t, acceleration, enough, powers, parts, waiting):
    """The same for ``q' a + q'' v^2``, of degree 7; `powers` and `parts` (5,8) are scratch."""
    found = 0.0
    waiting[0, 0] = 0.0
    waiting[0, 1] = 1.0
    count = 1
    while count > 0:
        count -= 1
        begin = waiting[count, 0]
        share = waiting[count, 1]
        e = begin * t
        h = share * t
        here_v = v + e * (a + e * b / 2.0)
        here_a = a + e * b
        place = (s + moved(v, a, b, e), here_v * h, here_a * h * h / 2.0, b * h * h * h / 6.0)
        speed = (here_v, here_a * h, b * h * h / 2.0)
        powers[:] = 0.0
        powers[0, 0] = here_a
        powers[0, 1] = b * h
        for n in range(3):
            for k in range(3):
                powers[3, n + k] += speed[n] * speed[k]
        for n in range(4):
            for k in range(2):
                powers[1, n + k] += place[n] * powers[0, k]
            for k in range(5):
                powers[4, n + k] += place[n] * powers[3, k]
        for n in range(4):
            for k in range(5):
                powers[2, n + k] += place[n] * powers[1, k]
        for n in range(5):
            in_bernstein(powers[n], parts[n])
        bound = 0.0
        sure = 0.0
        for i in range(acceleration.size):
            for n in range(8):
                load = c[1, i] * parts[0, n] + 2.0 * c[2, i] * (parts[1, n] + parts[3, n])
                load += 3.0 * c[3, i] * (parts[2, n] + 2.0 * parts[4, n])
                load = abs(load) / acceleration[i]
                bound = max(bound, load)
                if n == 0 or n == 7:
                    sure = max(sure, load)
        if bound > enough and sure <= enough and share > SMALLEST_SHARE:
            for half in range(2):
                waiting[count, 0] = begin + half * 0.5 * share
                waiting[count, 1] = 0.5 * share
                count += 1
        else:
            found = max(found, bound)
    return found


@kernel
def piece_loads(c, alone, s, v, a, b, velocity, acceleration, jerk, feed_rate, worst):
    """Raise `worst` (4,) to a point's ratios of velocity, acceleration, jerk and feed to their limits."""
    square = 0.0
    for i in range(velocity.size):
        third = 6.0 * c[3, i]
        bend = 2.0 * c[2, i] + third * s
        first = c[1, i] + s * (2.0 * c[2, i] + 3.0 * c[3, i] * s)
        qv = first * v
        if (i < 3) != (alone == 1):
            square += qv * qv
        worst[0] = max(worst[0], abs(qv) / velocity[i])
        worst[1] = max(worst[1], abs(first * a + bend * v * v) / acceleration[i])
        worst[2] = max(worst[2], abs(first * b + v * (3.0 * bend * a + third * v * v)) / jerk[i])
    worst[3] = max(worst[3], np.sqrt(square) / feed_rate)


@kernel
def certificate(
    pieces,
    cell,
    begin,
    end,
    straight_a,
    rows,
    first_cell,
    feed_rate,
    alone,
    velocity,
    acceleration,
    jerk,
    tolerances,
    worst,
):
    """Largest ratios (k,7) of what the law asks for to the limits, in the cells of pieces `begin` to `end`.

    Velocity, acceleration, feed; jerk where the path jerk b is 0, where it is positive, where it is
    negative; jerk but for that by b. Acceleration and jerks are bounds, as near as it takes to tell them
    from what is tolerated; the others are looked for at some points of every piece. Straight cells keep
    their limits by construction.
    """
    for m in range(begin, end):
        worst[cell[m], :] = 0.0
    powers = np.empty((5, 7))
    parts = np.empty((5, 7))
    more_powers = np.empty((5, 8))
    more_parts = np.empty((5, 8))
    waiting = np.empty((64, 2))
    loads = np.empty(4)
    for m in range(begin, end):
        k = cell[m]
        if straight_a[k] > 0.0:
            continue
        whole = first_cell + k
        s = pieces[m, 2]
        v = pieces[m, 3]
        a = pieces[m, 4]
        b = pieces[m, 5]
        t = pieces[m, 1]
        loads[:] = 0.0
        for n in range(POINTS):
            e = t * n / (POINTS - 1)
            piece_loads(
                rows[whole], alone[whole], s + moved(v, a, b, e), v + e * (a + e * b / 2.0), a + e * b, 0.0,
                velocity, acceleration, jerk, feed_rate[whole], loads,
            )  # fmt: skip
        worst[k, 0] = max(worst[k, 0], loads[0])
        if loads[1] <= 1.0 + tolerances[1]:
            loads[1] = acceleration_bound(
                rows[whole], s, v, a, b, t, acceleration, 1.0 + tolerances[1], more_powers, more_parts,
                waiting,
            )  # fmt: skip
        worst[k, 1] = max(worst[k, 1], loads[1])
        worst[k, 2] = max(worst[k, 2], loads[3])
        worst[k, 6] = max(worst[k, 6], loads[2])
        bound = jerk_bound(rows[whole], s, v, a, b, t, jerk, 1.0 + tolerances[2], powers, parts, waiting)
        n = 3 if b == 0.0 else (4 if b > 0.0 else 5)
        worst[k, n] = max(worst[k, n], bound)


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
