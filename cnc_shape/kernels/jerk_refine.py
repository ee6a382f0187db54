"""A finished law brought close to the fastest one, window by window.

The scans of `kernels/jerk_scan.py` run curves as if the path acceleration were 0 wherever a limit of speed is
met, and what the jerk of a curve takes they leave to guesses that only ever get lower. In a blend the fastest
law brakes until its middle and accelerates from there, because then ``3 q'' v a`` takes ``q''' v^3`` away; it
is found by `kernels/jerk_interior.py`, between two points of the law where speed and acceleration stay what
they are. What comes out is certified like the law itself, and taken only where it keeps the limits and is
faster: no law gets slower.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.jerk_caps import derivatives, straight_jerk
from cnc_shape.kernels.jerk_certificate import certificate
from cnc_shape.kernels.jerk_interior import KEPT, NEARER, interior
from cnc_shape.kernels.jerk_phases import moved
from cnc_shape.kernels.jerk_pieces import more_room
from cnc_shape.kernels.jerk_spline import LEAST_NODES, limit_rows, spline, spline_phases, window_nodes

STEP = 0.2  # -, of the time in which the acceleration rises: longest time between nodes
LEAST_STEPS = 1.0 / 500.0  # -, of the time of a window
LONG_CRUISE = 2.0  # -, of the time in which the acceleration rises: windows end in such a phase
MOST_PIECES = 10_000  # of a window
NEAR_REST = 0.25  # -, of that time: what is nearer to a rest is left as it is
STILL = 1e-6  # mm/s or rad/s
SHORTEST_CELL = 1e-7  # mm or rad, between nodes
ROOM_ACCELERATION = 1.0 - 1e-3  # -, of the limits that the law between its nodes may use
ROOM_JERK = 1.0 - 4e-3
ROOM_SPEED_V2 = 1.0 - 4e-4
ROOM_ROUNDING = 1.0 - 2.0 * KEPT
WIDE = 1.002  # -, of acceleration at the ends of a window, where the law is given
NEAR_ENDS = 8  # segments over which the room becomes less
MOST_TRIES = 8
LEAST_LEFT = 0.8  # -, of the room, after a try
REFINED = 5  # column of what is counted
SHORTEST_RISE = 1e-3  # s, in which the acceleration rises: with less the jerk limit is hardly felt
WORTH = 1e-6  # -, of its time by which a window must get shorter


@kernel
def rise_time(acceleration, jerk):
    """Longest time in which an axis reaches its acceleration."""
    longest = 0.0
    for i in range(jerk.size):
        longest = max(longest, acceleration[i] / jerk[i])
    return longest


@kernel
def between_ends(pieces, near):
    """First piece and the end of those that are at least the time `near` from a rest at either end."""
    begin = 0
    size = pieces.shape[0]
    gone = 0.0
    if pieces[0, 3] == 0.0:
        while begin < size - 1 and gone + pieces[begin, 1] <= near:
            gone += pieces[begin, 1]
            begin += 1
    t = pieces[size - 1, 1]
    if abs(pieces[size - 1, 3] + t * (pieces[size - 1, 4] + t * pieces[size - 1, 5] / 2.0)) < STILL:
        gone = 0.0
        while size > begin + 1 and gone + pieces[size - 1, 1] <= near:
            gone += pieces[size - 1, 1]
            size -= 1
    return begin, size


@kernel
def window_end(pieces, cell, straight_a, begin, size, rise):
    """Last piece of the window that starts in `begin`, and whether a cell of it is curved."""
    curved = False
    m = begin
    while True:
        curved = curved or straight_a[cell[m]] == 0.0
        cruise = pieces[m, 4] == 0.0 and pieces[m, 5] == 0.0 and pieces[m, 1] > LONG_CRUISE * rise
        if m + 1 == size or (m > begin and (cruise or m - begin > MOST_PIECES)):
            return m, curved
        m += 1


@kernel
def less_room(worst, at_cell, tolerances, room, cap):
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
            fast = max(fast, max(own[0], own[2]))
            pushed = max(pushed, own[1])
            jerked = max(jerked, max(own[3], max(own[4], own[5])))
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
def peaks(pieces, cell, limit_v2, worst):
    """Raise the ratios of velocity to those of the highest speeds of the pieces to what their cells allow."""
    for m in range(cell.size):
        v = pieces[m, 3]
        a = pieces[m, 4]
        b = pieces[m, 5]
        k = cell[m]
        end_a = a + b * pieces[m, 1]
        most = max(v, v + 0.5 * (a + end_a) * pieces[m, 1])
        if a > 0.0 and end_a < 0.0:
            most = v - 0.5 * a * a / b
        worst[k, 0] = max(worst[k, 0], most / np.sqrt(min(limit_v2[k, 0], limit_v2[k, 1])))


@kernel
def refined_window(
    pieces, cell, begin, start, end, finish, rise, rows, length, feed_rate, alone, limit_v2, straight_a,
    velocity, acceleration, jerk, tolerances, counts, allowed,
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
    worst = np.empty((straight_a.size, 7))
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
        certificate(
            new, new_cell, first, count, curved, rows, first, feed_rate, alone, velocity, acceleration, jerk,
            tolerances, worst,
        )  # fmt: skip
        peaks(new, new_cell, limit_v2, worst)
        if less_room(worst, at_cell, tolerances, room, cap) == 0:
            return new, new_cell
    return none, no_cell


@kernel
def refined(
    pieces, cell, rows, length, feed_rate, alone, limit_v2, straight_a, velocity, acceleration, jerk,
    tolerances, counts, allowed,
):  # fmt: skip
    """Pieces (m,6) of a law and their cells, where it could be made faster; its ends stay what they are."""
    rise = rise_time(acceleration, jerk)
    if rise < SHORTEST_RISE or (straight_a > 0.0).all():
        return pieces, cell
    out = np.empty((2 * cell.size + 64, 6))
    out_cell = np.empty(2 * cell.size + 64, np.int64)
    filled = np.int64(0)
    begin, size = between_ends(pieces, NEAR_REST * rise)
    first = begin
    for m in range(begin):
        filled = put_part(pieces, cell, m, 0.0, pieces[m, 1], out, out_cell, filled)
    done = 0.0  # of the piece `begin`
    while begin < size:
        end, curved = window_end(pieces, cell, straight_a, begin, size, rise)
        last = end + 1 == size
        start = 0.5 * pieces[begin, 1] if begin == first else max(done, pieces[begin, 1] - rise)
        if begin > first and start >= pieces[begin, 1]:
            start = done
        finish = 0.5 * pieces[end, 1]
        if not last:
            finish = min(finish, rise)
        new = np.empty((0, 6))
        new_cell = np.empty(0, np.int64)
        if curved and end > begin:
            new, new_cell = refined_window(
                pieces, cell, begin, start, end, finish, rise, rows, length, feed_rate, alone, limit_v2,
                straight_a, velocity, acceleration, jerk, tolerances, counts, allowed,
            )  # fmt: skip
        needed = filled + new_cell.size + (end - begin) + 4
        if needed > out_cell.size:
            out, out_cell = more_room(out, out_cell, needed)
        if new_cell.size == 0:
            for m in range(begin, end + 1):
                low = done if m == begin else 0.0
                high = pieces[m, 1] if m < end or last else finish
                filled = put_part(pieces, cell, m, low, high, out, out_cell, filled)
        else:
            filled = put_part(pieces, cell, begin, done, start, out, out_cell, filled)
            for m in range(new_cell.size):
                out[filled] = new[m]
                out_cell[filled] = new_cell[m]
                filled += 1
            if last:
                filled = put_part(pieces, cell, end, finish, pieces[end, 1], out, out_cell, filled)
        begin = size if last else end
        done = finish
    if filled + cell.size - size > out_cell.size:
        out, out_cell = more_room(out, out_cell, cell.size - size)
    for m in range(size, cell.size):
        filled = put_part(pieces, cell, m, 0.0, pieces[m, 1], out, out_cell, filled)
    return out[:filled].copy(), out_cell[:filled].copy()


@kernel
def put_part(pieces, cell, m, low, high, out, out_cell, filled):
    """Write a piece between two of its times; returns the number of pieces then."""
    if not high > low and pieces[m, 1] > 0.0:
        return filled
    v = pieces[m, 3]
    a = pieces[m, 4]
    b = pieces[m, 5]
    out[filled, 0] = 0.0
    out[filled, 1] = high - low
    out[filled, 2] = pieces[m, 2] + moved(v, a, b, low) if low > 0.0 else pieces[m, 2]
    out[filled, 3] = v + low * (a + low * b / 2.0)
    out[filled, 4] = a + b * low
    out[filled, 5] = b
    out_cell[filled] = cell[m]
    return filled + 1


@kernel
def close_to_fastest(
    pieces, cell, spans, rows, length, feed_rate, alone, limit_v2, straight, along, velocity, acceleration,
    jerk, tolerances, counts, passed, free, share,
):  # fmt: skip
    """The pieces of a law, faster where they can be, and their cells.

    Parameters
    ----------
    spans (n,4)
        First cell and end, first piece and end of each part of the law that is to be left by itself.
    along
        Where the acceleration along the path is limited, (k,), the law stays what it is.
    counts
        `counts[REFINED]`: nodes worked on so far.
    passed
        Cells of the program before the first one.
    free, share
        Nodes that a program has worked on at once, and for each of its cells passed by; less than 0: none.
    """
    if along.size > 0 or free < 0.0:
        return pieces.copy(), cell.copy()
    d = acceleration.size
    out = np.empty((2 * cell.size + 64, 6))
    out_cell = np.empty(2 * cell.size + 64, np.int64)
    filled = np.int64(0)
    here = 0
    for n in range(spans.shape[0] + 1):
        until = spans[n, 2] if n < spans.shape[0] else cell.size
        if filled + until - here > out_cell.size:
            out, out_cell = more_room(out, out_cell, until - here)
        for m in range(here, until):
            filled = put_part(pieces, cell, m, 0.0, pieces[m, 1], out, out_cell, filled)
        if n == spans.shape[0]:
            break
        begin = spans[n, 0]
        end = spans[n, 1]
        here = spans[n, 3]
        size = length[begin:end].copy()
        first = np.empty((end - begin, 2, d))
        bend = np.empty((end - begin, 2, d))
        third = np.empty((end - begin, d))
        derivatives(rows[begin:end], size, first, bend, third)
        straight_a = np.empty(end - begin)
        straight_b = np.empty(end - begin)
        limits = limit_v2[begin:end]
        straight_jerk(limits, straight[begin:end], first, bend, third, jerk, straight_a, straight_b)
        allowed = free + share * (passed + end)
        law, law_cell = refined(
            pieces[until:here].copy(), cell[until:here] - begin, rows[begin:end], size, feed_rate[begin:end],
            alone[begin:end], limits, straight_a, velocity, acceleration, jerk, tolerances, counts, allowed,
        )  # fmt: skip
        if filled + law_cell.size > out_cell.size:
            out, out_cell = more_room(out, out_cell, law_cell.size)
        for m in range(law_cell.size):
            for column in range(6):
                out[filled + m, column] = law[m, column]
            out_cell[filled + m] = begin + law_cell[m]
        filled += law_cell.size
    return out[:filled].copy(), out_cell[:filled].copy()
