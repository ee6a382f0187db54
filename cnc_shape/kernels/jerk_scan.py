"""How fast a path can be run up along it under a jerk limit, whatever must be braked for later.

All motion is in phases of constant path jerk b: ``v(t) = v + a t + b t^2/2``. A scan starts at rest and
never brakes: the acceleration rises with the highest jerk to its limit and stays there. Where the speed
meets a limit it goes on along the limit, and where the limit falls by a step, so does the speed, and the
acceleration is 0 then. The same scan on the mirrored path, read backwards, tells from where everything that
follows can be braked for. The lower of both, the envelope, only ever has *falling* steps of acceleration;
`kernels/jerk_rounding.py` rounds them.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel

MOST_STEPS = 60  # of a Newton iteration or a bisection
PHASES = 4  # of a scan in one cell, at most
LEAST_JERK_SHARE = 0.3  # -, of the jerk limit, left for the path jerk however much the curvature takes


@kernel
def travel_time(v, a, b, h):
    """Smallest t with ``v t + a t^2/2 + b t^3/6 = h`` where no coefficient is negative.

    Each term alone bounds t from above, and the sum is convex: Newton descends to the root.
    """
    t = np.inf
    if v > 0.0:
        t = min(t, h / v)
    if a > 0.0:
        t = min(t, np.sqrt(2.0 * h / a))
    if b > 0.0:
        t = min(t, np.cbrt(6.0 * h / b))
    for _ in range(MOST_STEPS):
        step = (t * (v + t * (a / 2.0 + t * b / 6.0)) - h) / (v + t * (a + t * b / 2.0))
        if not step > 0.0:
            break
        lower = t - step
        if lower >= t:
            break
        t = lower
    return t


@kernel
def moved(v, a, b, t):
    """Distance after `t`."""
    return t * (v + t * (a / 2.0 + t * b / 6.0))


@kernel
def time_to(v, a, b, most, h):
    """Time in [0, `most`] at which a phase that never turns back has moved by `h`."""
    low = 0.0
    high = most
    t = min(most, h / v) if v > 0.0 else 0.5 * most
    for _ in range(2 * MOST_STEPS):
        gap = moved(v, a, b, t) - h
        if gap > 0.0:
            high = t
        else:
            low = t
        speed = v + t * (a + t * b / 2.0)
        following = t - gap / speed if speed > 0.0 else 0.5 * (low + high)
        if not low <= following <= high:
            following = 0.5 * (low + high)
        if abs(following - t) <= 1e-16 * most or following == t:
            return following
        t = following
    return t


@kernel
def curved_caps(first, bend, third, h, v, a, next_cap, acceleration, jerk, ease_a, ease_j):
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
            high = min(high, (ease_a * acceleration[i] - sign * bend[0, i] * v * v) / abs(first[0, i]))
        bent = 3.0 * abs(bend[0, i]) * v
        if bent > 0.0:
            high = min(high, ease_j * jerk[i] / bent)
    high = max(high, 0.0)
    x = min(v * v + 2.0 * high * h, next_cap * next_cap)
    x = max(x, min(v, next_cap) ** 2)
    exit_v = np.sqrt(x)
    for i in range(third.size):
        if first[1, i] != 0.0:
            sign = 1.0 if first[1, i] > 0.0 else -1.0
            high = min(high, (ease_a * acceleration[i] - sign * bend[1, i] * x) / abs(first[1, i]))
        bent = 3.0 * abs(bend[1, i]) * exit_v
        if bent > 0.0:
            high = min(high, ease_j * jerk[i] / bent)
    high = max(high, 0.0)
    a = min(a, high)
    steep = np.inf
    for i in range(third.size):
        if first[0, i] != 0.0:
            sign = 1.0 if first[0, i] > 0.0 else -1.0
            own = sign * (3.0 * bend[0, i] * v * a + third[i] * v**3)
            room = max(ease_j * jerk[i] - own, LEAST_JERK_SHARE * ease_j * jerk[i])
            steep = min(steep, room / abs(first[0, i]))
    left_a = high
    if v > 0.0 and steep < np.inf:
        left_a = min(high, a + steep * h / v)
    for i in range(third.size):
        if first[1, i] != 0.0:
            sign = 1.0 if first[1, i] > 0.0 else -1.0
            own = sign * (3.0 * bend[1, i] * exit_v * left_a + third[i] * exit_v**3)
            room = max(ease_j * jerk[i] - own, LEAST_JERK_SHARE * ease_j * jerk[i])
            steep = min(steep, room / abs(first[1, i]))
    return high, steep


@kernel
def scan(
    length, top, cap, straight_a, straight_b, first, bend, third, acceleration, jerk, ease_a, ease_j,
    phases, cell,
):  # fmt: skip
    """Run up a path from rest; returns how many phases were written.

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
    ease_a, ease_j (k,)
        Shares of acceleration and jerk that may be used.
    phases (m,5), cell (m,)
        Output: duration, place in the cell, speed, acceleration, jerk.
    """
    m = 0
    v = 0.0
    a = 0.0
    for k in range(length.size):
        h = length[k]
        straight = straight_a[k] > 0.0
        if straight:
            high = ease_a[k] * straight_a[k]
            steep = ease_j[k] * straight_b[k]
        else:
            high, steep = curved_caps(
                first[k], bend[k], third[k], h, v, a, cap[k + 1], acceleration, jerk, ease_a[k], ease_j[k]
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
            phases[m, 0] = t
            phases[m, 1] = h - left
            phases[m, 2] = v
            phases[m, 3] = a
            phases[m, 4] = steep
            cell[m] = k
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
            phases[m, 0] = t
            phases[m, 1] = h - left
            phases[m, 2] = v
            phases[m, 3] = a
            phases[m, 4] = 0.0
            cell[m] = k
            m += 1
            if t == to_exit:
                left = 0.0
                v += a * t
            else:
                left = max(left - moved(v, a, 0.0, t), 0.0)
                v = top[k]
                a = 0.0
        if left > 0.0:
            phases[m, 0] = left / v
            phases[m, 1] = h - left
            phases[m, 2] = v
            phases[m, 3] = 0.0
            phases[m, 4] = 0.0
            cell[m] = k
            m += 1
            a = 0.0
        limit = cap[k + 1]
        if v > limit:
            if straight and h * steep > limit * high:  # room to be faster within the cell
                v = limit
                a = 0.0
            elif limit <= entry_v:
                m = before
                phases[m, 0] = h / entry_v
                phases[m, 1] = 0.0
                phases[m, 2] = entry_v
                phases[m, 3] = 0.0
                phases[m, 4] = 0.0
                cell[m] = k
                m += 1
                v = limit
                a = 0.0
            else:
                m = before
                mean = (2.0 * entry_v + limit) / 3.0
                t = 2.0 * h / (mean + np.sqrt(mean * mean + 2.0 * entry_a * h / 3.0))
                b = 2.0 * (limit - entry_v - entry_a * t) / (t * t)
                a = entry_a
                if not 0.0 <= b <= steep:
                    b = 0.0
                    a = (limit - entry_v) * (limit + entry_v) / (2.0 * h)
                    t = 2.0 * h / (limit + entry_v)
                phases[m, 0] = t
                phases[m, 1] = 0.0
                phases[m, 2] = entry_v
                phases[m, 3] = a
                phases[m, 4] = b
                cell[m] = k
                m += 1
                v = limit
                a += b * t
    return m


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
def speed_at(phases, low, high, place):
    """Phase among `low` to `high` in which `place` lies, the time in it, and the speed."""
    n = low
    while n + 1 < high and phases[n + 1, 1] <= place:
        n += 1
    t = time_to(phases[n, 2], phases[n, 3], phases[n, 4], phases[n, 0], place - phases[n, 1])
    return n, t, phases[n, 2] + t * (phases[n, 3] + t * phases[n, 4] / 2.0)


@kernel
def last_speed(phases, n):
    """Speed at the end of a phase."""
    t = phases[n, 0]
    return phases[n, 2] + t * (phases[n, 3] + t * phases[n, 4] / 2.0)


@kernel
def put(phases, cell, m, t, place, v, a, b, k):
    """Write a phase."""
    phases[m, 0] = t
    phases[m, 1] = place
    phases[m, 2] = v
    phases[m, 3] = a
    phases[m, 4] = b
    cell[m] = k


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
            low = 0.0
            high = length[k]
            for _ in range(MOST_STEPS):
                place = 0.5 * (low + high)
                if not low < place < high:
                    break
                _, _, up = speed_at(rising, r, r_end, place)
                _, _, down = speed_at(falling, f, f_end, place)
                if up < down:
                    low = place
                else:
                    high = place
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
