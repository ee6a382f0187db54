"""A faster law between two points of a finished law, where speed and acceleration stay what they are.

What `kernels/jerk_interior.py` finds is turned into phases, certified like the law itself, and taken only
where it keeps the limits and is faster. Where it asks for too much between its nodes, it is sought again with
less room there.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.jerk_certificate import certificate
from cnc_shape.kernels.jerk_interior import KEPT, NEARER, interior
from cnc_shape.kernels.jerk_spline import LEAST_NODES, limit_rows, spline, spline_phases, window_nodes

STEP = 0.2  # -, of the time in which the acceleration rises: longest time between nodes
LEAST_STEPS = 1.0 / 500.0  # -, of the time of a stretch
SHORTEST_CELL = 1e-7  # mm or rad, between nodes
ROOM_ACCELERATION = 1.0 - 1e-3  # -, of the limits that the law between its nodes may use
ROOM_JERK = 1.0 - 4e-3
ROOM_SPEED_V2 = 1.0 - 4e-4
ROOM_ROUNDING = 1.0 - 2.0 * KEPT
WIDE = 1.002  # -, of acceleration at the ends of a stretch, where the law is given
NEAR_ENDS = 8  # segments over which the room becomes less
MOST_TRIES = 8
LEAST_LEFT = 0.8  # -, of the room, after a try
REFINED = 5  # column of what is counted
WORTH = 1e-6  # -, of its time by which a stretch must get shorter


@kernel
def less_room(worst, peak, at_cell, tolerances, room, cap):
    """Lower the room of segments in whose cells too much was asked for; returns how many."""
    n = at_cell.size
    d = room.shape[1] // 2
    found = 0
    for s in range(n):
        fast = 0.0
        pushed = 0.0
        jerked = 0.0
        for k in range(max(s - 2, 0), min(s + 2, n - 1)):
            own = worst[at_cell[k]]
            fast = max(fast, peak[at_cell[k]])
            pushed = max(pushed, own[0])
            jerked = max(jerked, max(own[1], max(own[2], own[3])))
        if fast > 1.0 + tolerances[0]:
            for p in range(4):
                cap[s, p] *= max((1.0 - 1e-5) / (fast * fast), LEAST_LEFT)
            found += 1
        if pushed > 1.0 + tolerances[1]:
            for i in range(d):
                room[s, i] *= max((1.0 - 1e-5) / pushed, LEAST_LEFT)
            found += 1
        if jerked > 1.0 + tolerances[2]:
            for i in range(d):
                room[s, d + i] *= max(1.0 / jerked, LEAST_LEFT)
            found += 1
    return found


@kernel
def peak_speeds(pieces, cell, limit_v2, peak):
    """Ratios (k,) of the highest speeds in the cells of some pieces to what the cells allow."""
    peak[:] = 0.0
    for m in range(cell.size):
        v = pieces[m, 3]
        a = pieces[m, 4]
        b = pieces[m, 5]
        k = cell[m]
        end_a = a + b * pieces[m, 1]
        most = max(v, v + 0.5 * (a + end_a) * pieces[m, 1])
        if a > 0.0 and end_a < 0.0:
            most = v - 0.5 * a * a / b
        peak[k] = max(peak[k], most / np.sqrt(min(limit_v2[k, 0], limit_v2[k, 1])))


@kernel
def refined_stretch(
    pieces, cell, begin, start, end, finish, rise, rows, length, limit_v2, straight_a, acceleration, jerk,
    tolerances, counts, allowed,
):  # fmt: skip
    """Pieces of a faster law between two points of a law; no pieces if there is none."""
    d = acceleration.size
    none = np.empty((0, 6))
    no_cell = np.empty(0, np.int64)
    time = 0.0
    for m in range(begin, end + 1):
        time += (finish if m == end else pieces[m, 1]) - (start if m == begin else 0.0)
    if counts[REFINED] > allowed:
        return none, no_cell
    step = max(STEP * rise, LEAST_STEPS * time)
    most = int(time / step) + 2 * (end - begin) + 8
    at = np.empty(most)
    at_cell = np.empty(most, np.int64)
    law = np.empty((most, 3))
    n = window_nodes(pieces, cell, begin, start, end, finish, step, at, at_cell, law)
    if n < LEAST_NODES:
        return none, no_cell
    at = at[:n].copy()
    at_cell = at_cell[:n].copy()
    place = np.empty(n)
    border = np.empty(n + 1)
    centre = np.empty(n + 2)
    c = np.empty(n + 2)
    spline(at, at_cell, law[:n].copy(), length, place, border, centre, c)
    for k in range(1, n):
        if not place[k] - place[k - 1] > SHORTEST_CELL:
            return none, no_cell
    for k in range(n + 2):
        if not c[k] > 0.0:
            return none, no_cell
    value = np.empty((n, 4, 3))
    row = np.empty((n, 4, 2 * d, 3))
    cap = np.empty((n, 4))
    limit_rows(
        place, border, centre, at, at_cell, rows, straight_a, limit_v2, acceleration, jerk, value, row, cap
    )
    room = np.empty((n, 2 * d))
    for s in range(n):
        near = min(1.0, min(s, n - 1 - s) / NEAR_ENDS)
        wide = WIDE if near == 0.0 else 1.0
        for i in range(d):
            room[s, i] = wide * (1.0 - near * (1.0 - ROOM_ACCELERATION))
            room[s, d + i] = 1.0 - near * (1.0 - ROOM_JERK)
        for p in range(4):
            cap[s, p] *= ROOM_ROUNDING - near * (1.0 - ROOM_SPEED_V2)
    for p in range(3):
        cap[0, p] *= 2.0  # given
        cap[n - 1, p + 1] *= 2.0
    share = np.empty((n, 4))
    slack = np.empty((n, 4, 1 + 4 * d))
    price = np.empty((n, 4, 1 + 4 * d))
    more_slack = np.empty((n, 4, 1 + 4 * d))
    more_price = np.empty((n, 4, 1 + 4 * d))
    made = np.empty((3 * n, 6))
    made_cell = np.empty(3 * n, np.int64)
    worst = np.empty((straight_a.size, 5))
    peak = np.empty(straight_a.size)
    curved = np.zeros(straight_a.size)
    near = 1.0
    first = np.int64(0)
    for _ in range(MOST_TRIES):
        counts[REFINED] += n
        reached = interior(
            c, border, value, row, cap, room, near, share, slack, price, more_slack, more_price
        )
        if not reached:
            return none, no_cell
        near = NEARER
        count = spline_phases(c, place, border, centre, at, at_cell, made, made_cell)
        if count == 0:
            return none, no_cell
        new = made[:count]
        new_cell = made_cell[:count]
        shorter = 0.0
        for m in range(count):
            shorter += new[m, 1]
        if not shorter < time * (1.0 - WORTH):
            return none, no_cell
        certificate(new, new_cell, first, count, curved, rows, first, acceleration, jerk, tolerances, worst)
        peak_speeds(new, new_cell, limit_v2, peak)
        if less_room(worst, peak, at_cell, tolerances, room, cap) == 0:
            return new, new_cell
    return none, no_cell
