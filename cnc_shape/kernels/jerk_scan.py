"""How fast a path can be run up along it under a jerk limit, whatever must be braked for later.

All motion is in phases of constant path jerk b: ``v(t) = v + a t + b t^2/2``. A scan starts at rest and
never brakes: the acceleration rises with the highest jerk to its limit and stays there. Where the speed
meets a limit it goes on along the limit, and where the limit falls by a step, so does the speed, and the
acceleration is 0 then. The same scan on the mirrored path, read backwards, tells from where everything that
follows can be braked for. The lower of both, the envelope, only ever has *falling* steps of acceleration;
`kernels/jerk_rounding.py` rounds them.

How far that is from optimal: not at all on straight lines; some 3 % on splines, 8 to 14 % on blends and on
the fan. In a blend the limit of speed is taken as if the acceleration were 0, and 0 is what it is made to be
where that limit is met; and the jerk left for an arc that rounds a step is the least of all cells it may
touch. `kernels/jerk_refine.py` wins most of that back.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.jerk_caps import curved_caps
from cnc_shape.kernels.jerk_phases import MOST_STEPS, last_speed, moved, put, speed_at, travel_time

CROSSED = 1e-14  # -, of a cell, to the place where two laws cross
PHASES = 4  # of a scan in one cell, at most


@kernel
def scan(
    length, top, cap, straight_a, straight_b, first, bend, third, acceleration, jerk, ease,
    phases, cell,
):  # fmt: skip
    """Run up a path from its first cap; returns how many phases were written.

    Parameters
    ----------
    length (k,)
        Of the cells, all positive.
    top (k,), cap (k+1,)
        Highest speed in the cells and at the nodes.
    straight_a, straight_b (k,)
        Highest path acceleration and jerk of straight cells; 0 for curved ones, where they depend on the
        speed.
    first, bend (k,2,d), third (k,d)
        q' and q'' at both ends of the cells, q'''.
    ease (k,5)
        Shares of the limits that may be used on curved cells (`jerk_caps.tighten`).
    phases (m,5), cell (m,)
        Output: duration, place in the cell, speed, acceleration, jerk.
    """
    m = 0
    v = cap[0]
    a = 0.0
    for k in range(length.size):
        h = length[k]
        straight = straight_a[k] > 0.0
        if straight:
            high = straight_a[k]
            steep = straight_b[k]
        else:
            high, steep = curved_caps(
                first[k], bend[k], third[k], h, v, a, cap[k + 1], acceleration, jerk, ease[k]
            )
        a = min(a, high)
        before = m
        entry_v = v
        entry_a = a
        left = h
        if v >= top[k]:
            v = top[k]
            a = 0.0
        if v < top[k] and a < high:  # rising acceleration
            to_high = (high - a) / steep
            to_top = 2.0 * (top[k] - v) / (a + np.sqrt(a * a + 2.0 * steep * (top[k] - v)))
            to_exit = travel_time(v, a, steep, left)
            t = min(to_high, to_top, to_exit)
            put(phases, cell, m, t, h - left, v, a, steep, k)
            m += 1
            if t == to_exit:
                left = 0.0
                v = v + t * (a + t * steep / 2.0)
                a += steep * t
            elif t == to_top:
                left = max(left - moved(v, a, steep, t), 0.0)
                v = top[k]
                a = 0.0
            else:
                left = max(left - moved(v, a, steep, t), 0.0)
                v = v + t * (a + t * steep / 2.0)
                a = high
        if left > 0.0 and v < top[k] and a > 0.0:  # highest acceleration
            to_top = (top[k] - v) / a
            to_exit = travel_time(v, a, 0.0, left)
            t = min(to_top, to_exit)
            put(phases, cell, m, t, h - left, v, a, 0.0, k)
            m += 1
            if t == to_exit:
                left = 0.0
                v += a * t
            else:
                left = max(left - moved(v, a, 0.0, t), 0.0)
                v = top[k]
                a = 0.0
        if left > 0.0:
            put(phases, cell, m, left / v, h - left, v, 0.0, 0.0, k)
            m += 1
            a = 0.0
        limit = cap[k + 1]
        if v > limit:
            if straight and h * steep > limit * min(high, np.sqrt(limit * steep)):  # room to be faster inside
                v = limit
                a = 0.0
            elif limit <= entry_v:
                m = before
                put(phases, cell, m, h / entry_v, 0.0, entry_v, 0.0, 0.0, k)
                m += 1
                v = limit
                a = 0.0
            else:
                m = before
                mean = (2.0 * entry_v + limit) / 3.0
                t = 2.0 * h / (mean + np.sqrt(mean * mean + 2.0 * entry_a * h / 3.0))
                b = 2.0 * (limit - entry_v - entry_a * t) / (t * t)
                a = entry_a
                if 0.0 <= b <= steep and entry_a + b * t > high:  # a part of the rise, as steep as may be
                    t, a = rise_to(entry_v, entry_a, steep, high, h, limit)
                    put(phases, cell, m, t, 0.0, entry_v, entry_a, steep, k)
                    m += 1
                    place = moved(entry_v, entry_a, steep, t)
                    v = entry_v + t * (entry_a + t * steep / 2.0)
                    put(phases, cell, m, 2.0 * (h - place) / (v + limit), place, v, a, 0.0, k)
                    m += 1
                    v = limit
                    continue
                if not 0.0 <= b <= steep:
                    b = 0.0
                    a = (limit - entry_v) * (limit + entry_v) / (2.0 * h)
                    t = 2.0 * h / (limit + entry_v)
                put(phases, cell, m, t, 0.0, entry_v, a, b, k)
                m += 1
                v = limit
                a += b * t
    return m


@kernel
def rise_to(v, a, steep, high, h, limit):
    """How long the acceleration has to rise, and to what, so that after `h` the speed is `limit`."""
    low = a
    for _ in range(MOST_STEPS):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        t = (middle - a) / steep
        risen = v + t * (a + t * steep / 2.0)
        left = h - moved(v, a, steep, t)
        if left > 0.0 and risen * risen + 2.0 * middle * left < limit * limit:
            low = middle
        else:
            high = middle
    t = (low - a) / steep
    risen = v + t * (a + t * steep / 2.0)
    return t, (limit - risen) * (limit + risen) / (2.0 * (h - moved(v, a, steep, t)))


@kernel
def mirrored(phases, cell, count, length):
    """Turn phases of the mirrored path into phases of the path itself, in place."""
    cells = length.size
    for n in range((count + 1) // 2):
        other = count - 1 - n
        for column in range(5):
            value = phases[n, column]
            phases[n, column] = phases[other, column]
            phases[other, column] = value
        swap = cell[n]
        cell[n] = cell[other]
        cell[other] = swap
    for n in range(count):
        t = phases[n, 0]
        v = phases[n, 2]
        a = phases[n, 3]
        b = phases[n, 4]
        k = cells - 1 - cell[n]
        cell[n] = k
        new = n == 0 or cell[n - 1] != k
        phases[n, 1] = 0.0 if new else length[k] - (phases[n, 1] + moved(v, a, b, t))
        phases[n, 2] = v + t * (a + t * b / 2.0)
        phases[n, 3] = -(a + b * t)


@kernel
def crossing(rising, r, r_end, falling, f, f_end, h):
    """Place in a cell of length `h` where a rising law, slower at first, meets a falling one."""
    low = 0.0
    high = h
    slower = falling[f, 2] ** 2 - rising[r, 2] ** 2
    faster = last_speed(rising, r_end - 1) ** 2 - last_speed(falling, f_end - 1) ** 2
    place = h * slower / (slower + faster)
    for _ in range(MOST_STEPS):
        if not low < place < high:
            place = 0.5 * (low + high)
            if not low < place < high:
                return low
        n, t, up = speed_at(rising, r, r_end, place)
        m, s, down = speed_at(falling, f, f_end, place)
        gap = up - down
        if gap == 0.0:
            return place
        if gap < 0.0:
            low = place
        else:
            high = place
        slope = (rising[n, 3] + t * rising[n, 4]) / up - (falling[m, 3] + s * falling[m, 4]) / down
        step = gap / slope
        if abs(step) <= CROSSED * h:
            return place
        place -= step
    return low


@kernel
def envelope(rising, rising_cell, rising_count, falling, falling_cell, falling_count, length, phases, cell):
    """The lower of two laws, the one rising and the other falling in every cell; returns its phases' number.

    So they cross once in a cell at most, from the rising to the falling one.
    """
    r = 0
    f = 0
    m = 0
    while r < rising_count:
        k = rising_cell[r]
        r_end = r
        while r_end < rising_count and rising_cell[r_end] == k:
            r_end += 1
        f_end = f
        while f_end < falling_count and falling_cell[f_end] == k:
            f_end += 1
        if last_speed(rising, r_end - 1) <= last_speed(falling, f_end - 1):
            for n in range(r, r_end):
                phases[m] = rising[n]
                cell[m] = k
                m += 1
        elif rising[r, 2] >= falling[f, 2]:
            for n in range(f, f_end):
                phases[m] = falling[n]
                cell[m] = k
                m += 1
        else:
            low = crossing(rising, r, r_end, falling, f, f_end, length[k])
            n, t, v = speed_at(rising, r, r_end, low)
            for p in range(r, n):
                phases[m] = rising[p]
                cell[m] = k
                m += 1
            if t > 0.0:
                put(phases, cell, m, t, rising[n, 1], rising[n, 2], rising[n, 3], rising[n, 4], k)
                m += 1
            n, t, _ = speed_at(falling, f, f_end, low)
            if falling[n, 0] - t > 0.0:
                put(
                    phases, cell, m, falling[n, 0] - t, low, v, falling[n, 3] + t * falling[n, 4],
                    falling[n, 4], k,
                )  # fmt: skip
                m += 1
            for p in range(n + 1, f_end):
                phases[m] = falling[p]
                cell[m] = k
                m += 1
        r = r_end
        f = f_end
    return m
