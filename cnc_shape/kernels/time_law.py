"""The fastest time law within velocity, acceleration and feed, cell by cell.

With x = v^2 and a constant path acceleration a, x grows linearly over a cell of length h: x1 = x0 + 2 a h.
An axis accelerates by ``q'(s) a + q''(s) (x0 + 2 a s)``, which is quadratic in s: it stays within +-A if its
three Bernstein coefficients do, each of which is linear in (a, x0):

    q'_0 a + q''_0 x0,     (q'_0 + 1.5 h q''_0) a + (q''_0 + q''_1)/2 x0,     (q'_1 + 2 h q''_1) a + q''_1 x0

Where the acceleration along the path is limited as well, `kernels/path_limits.py` adds five such rows.

Backwards, the largest x0 from which the next node is reached in time; forwards, the largest a.

Source: Q.-C. Pham, H. Pham, "A new approach to time-optimal path parameterization based on reachability
analysis", IEEE Trans. Robotics 34 (2018), doi:10.1109/TRO.2018.2819195.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.path_limits import ALONG_ROWS, along_bounds
from cnc_shape.kernels.speed_limits import ends

MARGIN = 1e-9  # -, by which the scan must clear the next node's speed to be called independent of it
NO_LENGTH = 1e-13  # -, of a cell: a shorter piece is rounding
STEEPEST = 1e7  # -, base of a line over the smallest one, from which the line limits x alone
SLACK = 4.0 / STEEPEST  # -, of the limit, left for the term that such a line drops
WORTH = 30.0  # -, by which a speed at the end of a cell has to gain what that at its start gives up
MOST_STEPS = 60  # of Newton, on a gap of at most 6 d pieces


@kernel
def bounds(rows, h, acceleration, along, d1, d2, e1, e2, base, slope):
    """Lines ``|a - slope x| <= base`` of a curved cell; returns the limit of x by itself.

    There are 3 d of them, and those of the acceleration along the path where there is room for them.

    Where the factor of `a` vanishes but for rounding, the line is so steep that `a` would have no digits
    left. Such a row limits x alone, with some slack for what `a` could add.
    """
    ends(rows, h, d1, d2, e1, e2)
    least = np.inf
    for i in range(d1.size):
        for r in range(3):
            if r == 0:
                p = d1[i]
                s = d2[i]
            elif r == 1:
                p = d1[i] + 1.5 * h * d2[i]
                s = 0.5 * (d2[i] + e2[i])
            else:
                p = e1[i] + 2.0 * h * e2[i]
                s = e2[i]
            base[3 * i + r] = acceleration[i] / p
            slope[3 * i + r] = s
            least = min(least, abs(base[3 * i + r]))
    own = 3 * d1.size
    if base.size > own:
        along_bounds(h, d1, d2, e1, e2, along, own, base, slope)
        for n in range(own, base.size):
            least = min(least, abs(base[n]))
    cap = np.inf
    for n in range(base.size):
        limit = acceleration[n // 3] if n < own else 1.0
        if abs(base[n]) < STEEPEST * least and abs(base[n]) < np.inf:
            slope[n] *= -base[n] / limit
            base[n] = abs(base[n])
        else:
            if slope[n] != 0.0:
                cap = min(cap, (1.0 - SLACK) * limit / abs(slope[n]))
            base[n] = np.inf
            slope[n] = 0.0
    return cap


@kernel
def window(x, base, slope):
    """Lowest and highest `a` at `x`, each with its slope by x."""
    low = -np.inf
    high = np.inf
    low_slope = 0.0
    high_slope = 0.0
    for n in range(base.size):
        center = slope[n] * x
        if center + base[n] < high:
            high = center + base[n]
            high_slope = slope[n]
        if center - base[n] > low:
            low = center - base[n]
            low_slope = slope[n]
    return low, low_slope, high, high_slope


@kernel
def largest_start(x, next_v2, h, base, slope):
    """Largest x0 <= `x` from which some `a` leads to 0 <= x1 <= `next_v2`.

    The width of the window of `a` is concave in x0 and positive at 0: Newton from above descends to its root.
    """
    for _ in range(MOST_STEPS):
        low, low_slope, high, high_slope = window(x, base, slope)
        if (next_v2 - x) / (2.0 * h) < high:
            high = (next_v2 - x) / (2.0 * h)
            high_slope = -0.5 / h
        if -x / (2.0 * h) > low:
            low = -x / (2.0 * h)
            low_slope = -0.5 / h
        if high >= low or high_slope >= low_slope:
            break
        lower = x - (high - low) / (high_slope - low_slope)
        if lower >= x:
            break
        x = max(lower, 0.0)
    return x


@kernel
def quickest_start(x, next_v2, h, base, slope):
    """The x0 <= `x` that is large, but for as much as it costs the speed at the cell's end.

    Where a row hardly knows `a`, it lets x0 be so large that no more than braking hard is left, to rest
    even: a little less, and x1 may be much larger. The speed at the start and a share of that at the end
    are concave in x0: bisection on the slope of their sum.
    """
    _, _, high, high_slope = window(x, base, slope)
    following = x + 2.0 * h * high
    if following >= next_v2 or (1.0 + 2.0 * h * high_slope) * np.sqrt(x) >= -WORTH * np.sqrt(
        max(following, 0.0)
    ):
        return x
    lower = 0.0
    for _ in range(MOST_STEPS):
        middle = 0.5 * (lower + x)
        _, _, high, high_slope = window(middle, base, slope)
        following = middle + 2.0 * h * high
        rise = (1.0 + 2.0 * h * high_slope) * np.sqrt(middle) + WORTH * np.sqrt(max(following, 0.0))
        if following >= next_v2 or rise >= 0.0:
            lower = middle
        else:
            x = middle
    return lower


@kernel
def backward(rows, length, stop, limit_v2, straight, acceleration, along, before_v2):
    """Largest squared speed at every node from which all that follows can be kept.

    Parameters
    ----------
    along
        (k,) limit of the acceleration along the path; (0,) where there is none.
    before_v2
        Limit of the cell before the first one.

    The path is taken to rest at its end: the most cautious assumption about what follows, if anything does.

    Returns
    -------
    reach_v2 (k+1,)
    free (k+1,)
        1 where the value does not depend on what follows the node.
    """
    count = length.size
    d = acceleration.size
    reach_v2 = np.zeros(count + 1)
    free = np.zeros(count + 1, np.int64)
    d1 = np.empty(d)
    d2 = np.empty(d)
    e1 = np.empty(d)
    e2 = np.empty(d)
    lines = 3 * d + (ALONG_ROWS if along.size > 0 else 0)
    base = np.empty(lines)
    slope = np.empty(lines)
    for k in range(count - 1, -1, -1):
        h = length[k]
        cap = 0.0 if stop[k] == 1 else min(limit_v2[k, 0], limit_v2[k - 1, 1] if k > 0 else before_v2)
        if stop[k] == 1 or h == 0.0:
            free[k] = 1
            continue
        next_v2 = reach_v2[k + 1]
        if straight[k] > 0.0:
            gain = 2.0 * straight[k] * h
            reach_v2[k] = min(cap, next_v2 + gain)
            if next_v2 * (1.0 - MARGIN) + gain * (1.0 - MARGIN) >= cap and k < count - 1:
                free[k] = 1
            continue
        x = min(
            cap,
            bounds(
                rows[k], h, acceleration, along[k] if along.size > 0 else np.inf, d1, d2, e1, e2, base, slope
            ),
        )
        own_next = 0.0
        if k < count - 1 and stop[k + 1] == 0:
            own_next = min(limit_v2[k, 1], limit_v2[k + 1, 0])
        largest = largest_start(x, own_next, h, base, slope)
        x = quickest_start(largest, own_next, h, base, slope)
        low, _, high, _ = window(x, base, slope)
        needed = max(low, -x / (2.0 * h)) if x == largest else min(high, (own_next - x) / (2.0 * h))
        if next_v2 * (1.0 - MARGIN) - x >= 2.0 * h * needed and k < count - 1:
            free[k] = 1
        else:
            x = quickest_start(largest_start(x, next_v2, h, base, slope), next_v2, h, base, slope)
        reach_v2[k] = x
    return reach_v2, free


@kernel
def forward(rows, length, stop, dwell, limit_v2, straight, acceleration, along, reach_v2, clock):
    """Pieces of constant acceleration through the first cells of a path, as fast as can be.

    `clock` (3,) holds the time, its rounding error, and the squared speed; it is updated in place.

    Returns
    -------
    pieces (m,5)
        Time, duration, place in the cell, velocity, acceleration.
    cell (m,)
    """
    count = length.size
    d = acceleration.size
    pieces = np.empty((4 * count + 4, 5))
    cell = np.empty(4 * count + 4, np.int64)
    d1 = np.empty(d)
    d2 = np.empty(d)
    e1 = np.empty(d)
    e2 = np.empty(d)
    lines = 3 * d + (ALONG_ROWS if along.size > 0 else 0)
    base = np.empty(lines)
    slope = np.empty(lines)
    steps = np.empty((4, 4))  # duration, place, velocity, acceleration
    m = 0
    x = clock[2]
    for k in range(count):
        h = length[k]
        used = 0
        if stop[k] == 1:
            x = 0.0
            if dwell[k] > 0.0 or h == 0.0:
                steps[0] = 0.0
                steps[0, 0] = dwell[k]
                used = 1
        if h > 0.0 and straight[k] > 0.0:
            a = straight[k]
            following = min(reach_v2[k + 1], x + 2.0 * a * h)
            top = min(max(limit_v2[k, 0], x, following), 0.5 * (x + following) + a * h)
            v0 = np.sqrt(x)
            vt = np.sqrt(top)
            v1 = np.sqrt(following)
            rise = max(0.0, (top - x) / (2.0 * a))
            fall = max(0.0, (top - following) / (2.0 * a))
            cruise = h - rise - fall
            if rise > NO_LENGTH * h:
                steps[used, 0] = (vt - v0) / a
                steps[used, 1] = 0.0
                steps[used, 2] = v0
                steps[used, 3] = a
                used += 1
            if cruise > 0.0 and vt > 0.0 and (top >= limit_v2[k, 0] or used == 0):
                steps[used, 0] = cruise / vt
                steps[used, 1] = rise
                steps[used, 2] = vt
                steps[used, 3] = 0.0
                used += 1
            if fall > NO_LENGTH * h:
                steps[used, 0] = (vt - v1) / a
                steps[used, 1] = h - fall
                steps[used, 2] = vt
                steps[used, 3] = -a
                used += 1
            x = following
        elif h > 0.0:
            bounds(
                rows[k], h, acceleration, along[k] if along.size > 0 else np.inf, d1, d2, e1, e2, base, slope
            )
            low, _, high, _ = window(x, base, slope)
            a = max(min(high, (reach_v2[k + 1] - x) / (2.0 * h)), min(low, high), -x / (2.0 * h))
            following = min(max(x + 2.0 * a * h, 0.0), reach_v2[k + 1])
            v0 = np.sqrt(x)
            steps[used, 0] = 2.0 * h / (v0 + np.sqrt(following))
            steps[used, 1] = 0.0
            steps[used, 2] = v0
            steps[used, 3] = a
            used += 1
            x = following
        for p in range(used):
            pieces[m, 0] = clock[0]
            pieces[m, 1] = steps[p, 0]
            pieces[m, 2] = steps[p, 1]
            pieces[m, 3] = steps[p, 2]
            pieces[m, 4] = steps[p, 3]
            cell[m] = k
            m += 1
            step = steps[p, 0] - clock[1]  # compensated sum: hours of motion, to the last bit
            time = clock[0] + step
            clock[1] = (time - clock[0]) - step
            clock[0] = time
    clock[2] = x
    return pieces[:m], cell[:m]
