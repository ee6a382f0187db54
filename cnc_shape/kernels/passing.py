"""When a time law passes the ends of the moves that it runs along, and how long it is at their feed.

Travel in XYZ ends at a place on the toolpath. Waits and moves of rotary axes alone have no length there: many
of them may stand at one place, and all that tells them apart is the order in which the law rests and moves.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.jerk_phases import moved, time_to

TRAVEL = 0  # what a row of the toolpath is
WAIT = 1
ALONE = 2  # rotary axes alone
NEAR = 1e-9  # mm, of a place: as good as there
PARTS = 4  # of a piece in a curved cell, between which its speed is taken as linear


@kernel
def passing_times(
    what,
    border,
    dwell,
    time,
    duration,
    u,
    speed,
    acceleration,
    jerk,
    cell,
    stop,
    place,
    stretch,
    memory,
):
    """Times at which the ends of the first rows are passed, (n,) s, in their order.

    what (r,) TRAVEL, WAIT or ALONE; border (r,) mm, the end's place on the toolpath; dwell (r,) s; then the
    pieces of a profile and the cells it runs through. `memory` (1,): the last cell was one of rotary axes
    alone; it is updated in place.

    A stop ends what came before it: travel up to its place, or the turn of a rotary axis. Rest belongs to the
    waits that follow. Motion beyond a place passes whatever is still due there.
    """
    rows = what.size
    ends = np.empty(rows)
    r = 0
    before = -1
    for m in range(time.size):
        k = cell[m]
        if k != before and stop[k]:
            while r < rows and what[r] == TRAVEL and border[r] <= place[k] + NEAR:
                ends[r] = time[m]
                r += 1
            if memory[0] == 1 and r < rows and what[r] == ALONE:
                ends[r] = time[m]
                r += 1
            memory[0] = 0
        before = k
        v = speed[m]
        a = acceleration[m]
        b = jerk[m]
        t = duration[m]
        if v == 0.0 and a == 0.0 and b == 0.0:
            end = time[m]
            first = r
            while t > 0.0 and r < rows and what[r] == WAIT:
                end += dwell[r]
                ends[r] = end
                r += 1
            if r > first:
                ends[r - 1] = time[m] + t
            continue
        if stretch[k] == 0.0:
            while r < rows and what[r] == WAIT:
                ends[r] = time[m]
                r += 1
            memory[0] = 1
            continue
        until = place[k] + stretch[k] * (u[m] + moved(v, a, b, t))
        while r < rows:
            far = border[r] - until
            if (far > 0.0 and what[r] == TRAVEL) or (far >= -NEAR and what[r] != TRAVEL):
                break
            ends[r] = time[m] + t
            if far < -NEAR:
                way = (border[r] - place[k]) / stretch[k] - u[m]
                ends[r] = time[m] + (time_to(v, a, b, t, way) if way > 0.0 else 0.0)
            r += 1
    return ends[:r]


@kernel
def add_time_at_feed(duration, u, speed, acceleration, jerk, cell, rows, feed_rate, alone, share, total):
    """Add to `total` (1,) s, in place, the time in which the speed is at least `share` of the feed rate."""
    for m in range(duration.size):
        k = cell[m]
        least = share * feed_rate[k]
        if not np.isfinite(least):
            continue
        gap = 0.0
        for n in range(PARTS + 1):
            e = duration[m] * n / PARTS
            s = u[m] + moved(speed[m], acceleration[m], jerk[m], e)
            square = 0.0
            for i in range(3 * alone[k], rows.shape[2] if alone[k] == 1 else 3):
                rate = rows[k, 1, i] + s * (2.0 * rows[k, 2, i] + 3.0 * rows[k, 3, i] * s)
                square += rate * rate
            v = speed[m] + e * (acceleration[m] + e * jerk[m] / 2.0)
            last = gap
            gap = np.sqrt(square) * v - least
            if n == 0:
                continue
            step = duration[m] / PARTS
            if last >= 0.0 and gap >= 0.0:
                total[0] += step
            elif last >= 0.0 or gap >= 0.0:
                total[0] += step * max(last, gap) / abs(last - gap)
