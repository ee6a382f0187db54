"""How much path speed, acceleration and jerk a cell allows, as far as it can be told before the law is known.

With v, a, b the speed, acceleration and jerk along the path, the rows of every axis are

    |q' v| <= V,     |q' a + q'' v^2| <= A,     |q' b + 3 q'' v a + q''' v^3| <= J

What the law asks for more than that in the end is seen by its certificate, and its cells are eased then.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.jerk_phases import last_speed
from cnc_shape.kernels.speed_limits import ends

LEAST_JERK_SHARE = 0.3  # -, of the jerk limit, left for the path jerk however much the curvature takes
STRAIGHT_JERK_SHARE = 1e-5  # -, of the jerk limit that the curvature of a straight cell may use
EASE_ACCELERATION = 0.999  # -, over the excess
EASE_JERK = 0.995
LEAST_ROOM = 0.5
LEAST_EASE = 0.02  # -, of b: with less it has no digits left, and the speed is lowered instead
MOST_BASE = 0.8
BASE_POWER = 0.25


@kernel
def derivatives(rows, length, first, bend, third):
    """Derivatives of a path: q' and q'' at both ends (k,2,d), q''' (k,d)."""
    d = rows.shape[2]
    for k in range(length.size):
        ends(rows[k], length[k], first[k, 0], bend[k, 0], first[k, 1], bend[k, 1])
        for i in range(d):
            third[k, i] = 6.0 * rows[k, 3, i]


@kernel
def straight_jerk(limit_v2, straight, first, bend, third, jerk, straight_a, straight_b):
    """Path acceleration and jerk of straight cells; both 0 for those that the jerk limit sees as curved."""
    for k in range(straight.size):
        straight_a[k] = straight[k]
        straight_b[k] = np.inf
        v = np.sqrt(limit_v2[k, 0])
        for i in range(jerk.size):
            if abs(first[k, 0, i]) > 0.0:
                straight_b[k] = min(straight_b[k], jerk[i] / abs(first[k, 0, i]))
            curved = abs(third[k, i]) * v**3
            curved += 3.0 * max(abs(bend[k, 0, i]), abs(bend[k, 1, i])) * v * straight[k]
            if curved > STRAIGHT_JERK_SHARE * jerk[i]:
                straight_a[k] = 0.0
        if straight_a[k] == 0.0:
            straight_b[k] = 0.0


@kernel
def speed_caps(limit_v2, straight_a, bend, third, acceleration, jerk, ease, begin, end, top, cap):
    """Highest speeds in the cells `begin` to `end` and at their nodes, from all that is known before."""
    count = limit_v2.shape[0]
    for k in range(begin, end):
        top[k] = ease[k, 0] * np.sqrt(min(limit_v2[k, 0], limit_v2[k, 1]))
        if straight_a[k] == 0.0:
            for i in range(jerk.size):
                if third[k, i] != 0.0:
                    top[k] = min(top[k], np.cbrt(ease[k, 2] * jerk[i] / abs(third[k, i])))
    for k in range(begin, end + 1):
        if k == 0 or k == count:
            cap[k] = 0.0
            continue
        cap[k] = min(top[k - 1], top[k])
        for side in range(2):
            c = k - 1 + side
            if straight_a[c] == 0.0:
                for i in range(jerk.size):
                    curvature = abs(bend[c, 1 - side, i])
                    if curvature != 0.0:
                        cap[k] = min(cap[k], np.sqrt(ease[c, 1] * acceleration[i] / curvature))


@kernel
def curved_caps(first, bend, third, h, v, a, next_cap, acceleration, jerk, ease):
    """Highest path acceleration and path jerk for a cell that is entered with `v` and `a`.

    `first`, `bend` (2,d): q' and q'' at both ends; `third` (d,): q'''. The rows are

        |q' a + q'' v^2| <= A,     |q' b + 3 q'' v a + q''' v^3| <= J

    at both ends, with the speed and acceleration that the cell will be left with as far as they can be told:
    the certificate of the finished law sees what was wrong.
    """
    high = np.inf
    for i in range(third.size):
        if first[0, i] != 0.0:
            sign = 1.0 if first[0, i] > 0.0 else -1.0
            high = min(high, (ease[1] * acceleration[i] - sign * bend[0, i] * v * v) / abs(first[0, i]))
        bent = 3.0 * abs(bend[0, i]) * v
        if bent > 0.0:
            high = min(high, ease[2] * jerk[i] / bent)
    high = max(high, 0.0)
    entry_high = high
    x = min(v * v + 2.0 * high * h, next_cap * next_cap)
    x = max(x, min(v, next_cap) ** 2)
    exit_v = np.sqrt(x)
    for i in range(third.size):
        if first[1, i] != 0.0:
            sign = 1.0 if first[1, i] > 0.0 else -1.0
            own = (ease[1] * acceleration[i] - sign * bend[1, i] * x) / abs(first[1, i])
            if sign * bend[1, i] > 0.0:
                reach = abs(first[1, i]) + 2.0 * h * sign * bend[1, i]
                own = max(own, (ease[1] * acceleration[i] - sign * bend[1, i] * v * v) / reach)
            high = min(high, own)
        bent = 3.0 * abs(bend[1, i]) * exit_v
        if bent > 0.0:
            high = min(high, ease[2] * jerk[i] / bent)
    if high <= 0.0:  # too fast at its exit by this very acceleration
        high = entry_high
        for i in range(third.size):
            sign = 1.0 if first[1, i] > 0.0 else -1.0
            reach = abs(first[1, i]) + 2.0 * h * sign * bend[1, i]
            if reach > 0.0:
                high = min(high, (ease[1] * acceleration[i] - sign * bend[1, i] * v * v) / reach)
        exit_v = np.sqrt(v * v + 2.0 * max(high, 0.0) * h)
    high = max(high, 0.0)
    a = min(a, high)
    steep = np.inf
    for i in range(third.size):
        if first[0, i] != 0.0:
            sign = 1.0 if first[0, i] > 0.0 else -1.0
            own = sign * (3.0 * bend[0, i] * v * a + third[i] * v**3)
            room = ease[3] * max(jerk[i] - own, LEAST_JERK_SHARE * jerk[i])
            steep = min(steep, room / abs(first[0, i]))
    left_a = high
    if v > 0.0 and steep < np.inf:
        left_a = min(high, a + steep * h / v)
    for i in range(third.size):
        if first[1, i] != 0.0:
            sign = 1.0 if first[1, i] > 0.0 else -1.0
            own = sign * (3.0 * bend[1, i] * exit_v * left_a + third[i] * exit_v**3)
            room = ease[3] * max(jerk[i] - own, LEAST_JERK_SHARE * jerk[i])
            steep = min(steep, room / abs(first[1, i]))
    return high, steep


@kernel
def falling_jerk(first, third, straight_a, straight_b, jerk, ease, phases, cell, count, least):
    """Jerk (k,) by which the path acceleration may fall in each cell, at the envelope's speed."""
    speed = np.zeros(least.size)
    for n in range(count):
        k = cell[n]
        speed[k] = max(speed[k], max(phases[n, 2], last_speed(phases, n)))
    for k in range(least.size):
        if straight_a[k] > 0.0:
            least[k] = straight_b[k]
            continue
        least[k] = np.inf
        for i in range(jerk.size):
            for end in range(2):
                q = first[k, end, i]
                if q != 0.0:
                    own = third[k, i] * speed[k] ** 3 * (1.0 if q > 0.0 else -1.0)
                    room = ease[k, 4] * max(jerk[i] + own, LEAST_JERK_SHARE * jerk[i])
                    least[k] = min(least[k], room / abs(q))


@kernel
def tighten(worst, straight_a, tolerances, ease, lower, changed, begin, end):
    """Lower what cells and their neighbours may use, where the law asked for too much; returns how many.

    Parameters
    ----------
    worst (k,5)
        Ratios of acceleration; of jerk where b is 0, rises, falls; and of jerk but for b.
    ease (k,5)
        Shares of speed, acceleration, jerk by curvature, rising and falling b that may be used. That of speed
        stays.
    lower (k,4), changed (k,)
        Ones, before and after; and marks of the cells whose shares are lower now.
    begin, end
        Cells to look at.

    Too much jerk where b is not 0 is first of all b's affair: to lower the speed costs more.
    """
    count = straight_a.size
    found = 0
    for k in range(begin, end):
        if worst[k, 0] > 1.0 + tolerances[1]:
            lower[k, 0] = EASE_ACCELERATION / worst[k, 0]
        base = worst[k, 4]
        if max(base, worst[k, 1]) > 1.0 + tolerances[2]:
            lower[k, 1] = EASE_JERK / max(base, worst[k, 1])
        for n in range(2):
            ratio = worst[k, 2 + n]
            if ratio > 1.0 + tolerances[2]:
                room = (1.0 - base) / (ratio - base) if ratio > base else 1.0
                lower[k, 2 + n] = EASE_JERK * min(1.0 / ratio, max(room, LEAST_ROOM))
                if ease[k, 3 + n] < LEAST_EASE:
                    lower[k, 2 + n] = 1.0
                    lower[k, 1] = min(lower[k, 1], EASE_JERK / ratio)
                if base > MOST_BASE:
                    lower[k, 1] = min(lower[k, 1], EASE_JERK / ratio**BASE_POWER)
        for n in range(4):
            if lower[k, n] < 1.0:
                found += 1
                break
    if found > 0:
        for k in range(max(begin - 1, 0), min(end + 1, count)):
            for n in range(4):
                least = lower[k, n]
                if straight_a[k] == 0.0:
                    least = min(least, min(lower[max(k - 1, 0), n], lower[min(k + 1, count - 1), n]))
                if least < 1.0:
                    ease[k, 1 + n] *= least
                    changed[k] = 1
        lower[begin:end] = 1.0
    return found
