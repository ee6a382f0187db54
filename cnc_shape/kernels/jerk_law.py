"""The time law of a path under a jerk limit: scans, rounding and certificate of every section.

The scans guess what the acceleration will be when they ask how much jerk the curvature takes, so the
finished law is looked at: where it asks for more than the limit, the cell and its neighbours may use less.
Limits only fall, so this ends; straight cells never ask for too much.

What changes in a cell reaches as far as the next nodes on both sides that the law passes without
acceleration, at a speed which is still allowed: there the law may be joined again. So only such windows
are planned anew, and where a window has no law between the speeds at its ends, it grows to the next ones.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import inlined, kernel
from cnc_shape.kernels.jerk_caps import falling_jerk, speed_caps, tighten
from cnc_shape.kernels.jerk_cells import looked_at, prepared
from cnc_shape.kernels.jerk_phases import moved
from cnc_shape.kernels.jerk_pieces import NEAR, copied, cut, index_pieces, more_room, spliced
from cnc_shape.kernels.jerk_rounding import round_off
from cnc_shape.kernels.jerk_scan import PHASES, envelope, mirrored, scan

NO_ACCELERATION = 1e-9  # s, times the jerk: as good as none
SAME_SPEED = 1e-10  # -


@kernel
def window_law(
    size, top, cap, straight_a, straight_b, first, bend, third, acceleration, jerk, ease, begin,
    start, finish,
):  # fmt: skip
    """Pieces of the law of some cells, without acceleration at both ends; no pieces if there is none.

    Parameters
    ----------
    begin
        Number of the first of the cells, from which they are counted in the output.
    start, finish
        Speeds at both ends.
    """
    count = size.size
    own_cap = cap.copy()
    own_cap[0] = start
    own_cap[count] = finish
    rising = np.empty((PHASES * count, 5))
    falling = np.empty((PHASES * count, 5))
    rising_cell = np.empty(PHASES * count, np.int64)
    falling_cell = np.empty(PHASES * count, np.int64)
    nodes = np.zeros(count + 1)
    for k in range(count):
        nodes[k + 1] = nodes[k] + size[k]
    r = scan(
        size, top, own_cap, straight_a, straight_b, first, bend, third, acceleration, jerk, ease, rising,
        rising_cell,
    )  # fmt: skip
    f = scan(
        size[::-1].copy(), top[::-1].copy(), own_cap[::-1].copy(), straight_a[::-1].copy(),
        straight_b[::-1].copy(), -first[::-1, ::-1].copy(), bend[::-1, ::-1].copy(), -third[::-1].copy(),
        acceleration, jerk, ease[::-1].copy(), falling, falling_cell,
    )  # fmt: skip
    mirrored(falling, falling_cell, f, size)
    upper = np.empty((r + f + count, 5))
    upper_cell = np.empty(r + f + count, np.int64)
    u = envelope(rising, rising_cell, r, falling, falling_cell, f, size, upper, upper_cell)
    least = np.empty(count)
    falling_jerk(first, third, straight_a, straight_b, jerk, ease, upper, upper_cell, u, least)
    law = np.empty((2 * u + 4, 5))
    law_cell = np.empty(2 * u + 4, np.int64)
    w = round_off(upper, upper_cell, u, nodes, least, law, law_cell)
    pieces = np.empty((w + count + 1, 6))
    cell = np.empty(w + count + 1, np.int64)
    if w == 0:
        return pieces[:0], cell[:0]
    last = law[w - 1]
    t = last[0]
    off = (nodes[law_cell[w - 1]] + last[1] + moved(last[2], last[3], last[4], t)) - nodes[count]
    slow = max(abs(law[0, 2] - start), abs(last[2] + t * (last[3] + t * last[4] / 2.0) - finish))
    turned = max(abs(law[0, 3]), abs(last[3] + last[4] * t))
    steepest = max(abs(law[0, 4]), max(abs(last[4]), least[count - 1]))
    if abs(off) > NEAR or slow > SAME_SPEED * (1.0 + finish) or turned > NO_ACCELERATION * steepest:
        return pieces[:0], cell[:0]
    m = cut(law, law_cell, w, nodes, begin, pieces, cell)
    return pieces[:m], cell[:m]


@inlined
def joint_speed(pieces, first_piece, cap, node, cells, start):
    """Speed at a node where the law may be joined; -1 where it may not."""
    if node == 0:
        return start
    if node == cells:
        return 0.0
    m = first_piece[node] - 1
    v = pieces[m + 1, 3]
    if pieces[m + 1, 4] != 0.0 or v > cap[node]:
        return -1.0
    t = pieces[m, 1]
    steepest = max(abs(pieces[m, 5]), abs(pieces[m + 1, 5]))
    if abs(pieces[m, 4] + t * pieces[m, 5]) > NO_ACCELERATION * steepest:
        return -1.0
    if abs(pieces[m, 3] + t * (pieces[m, 4] + t * pieces[m, 5] / 2.0) - v) > SAME_SPEED * v:
        return -1.0
    return v


@inlined
def nearest_joint(pieces, first_piece, cap, node, step, cells, start):
    """The first node from `node` on, in steps of 1 or -1, where the law may be joined; its speed there."""
    while True:
        speed = joint_speed(pieces, first_piece, cap, node, cells, start)
        if speed >= 0.0:
            return node, speed
        node += step


@kernel
def section_law(
    rows, length, limit_v2, straight, along, acceleration, jerk, begin, end, entry, calm_begin, calm_end,
    calm_speed, tolerances, most_rounds,
):  # fmt: skip
    """Time law of the cells `begin` to `end`, from the speed `entry` to rest.

    Parameters
    ----------
    entry
        Speed at the first node, which is passed without acceleration.
    calm_begin, calm_end, calm_speed
        Cells, counted from `begin`, in which the law is at most as fast as that.
    tolerances (3,)
        By which velocity and feed, acceleration and jerk may exceed their limits.
    most_rounds
        Of lowering limits where they do not.

    Returns
    -------
    pieces (m,6), cell (m,)
        0, duration, place in the cell, v, a, b; the cell counted from `begin`.
    cap (k+1,)
        Highest speeds at the nodes.
    work
        Cells planned, over all rounds.
    found
        Cells that still ask for too much.
    """
    count = end - begin
    size, first, bend, third, most, straight_a, straight_b = prepared(
        rows, length, limit_v2, straight, along, acceleration, jerk, begin, end
    )
    limits = limit_v2[begin:end]
    ease = np.ones((count, 5))
    lower = np.ones((count, 4))
    changed = np.ones(count, np.int64)
    worst = np.empty((count, 5))
    top = np.empty(count)
    cap = np.empty(count + 1)
    for k in range(calm_begin, calm_end):
        ease[k, 0] = min(1.0, calm_speed / np.sqrt(min(limits[k, 0], limits[k, 1])))
    pieces = np.empty((0, 6))
    cell = np.empty(0, np.int64)
    first_piece = np.zeros(count + 1, np.int64)
    new = np.empty((2 * count + 64, 6))
    new_cell = np.empty(2 * count + 64, np.int64)
    windows = np.empty((count + 1, 4), np.int64)  # first cell, end, first new piece, end
    starts = np.empty(count + 1)
    work = 0
    found = count
    rounds = 0
    while found > 0 and rounds < most_rounds:
        rounds += 1
        index_pieces(cell, cell.size, first_piece, count)
        k = 0
        while k < count:
            until = k
            while until < count and changed[until] == 1:
                until += 1
            if until > k:
                speed_caps(limits, straight_a, bend, third, most[0], most[1], ease, k, until, top, cap)
            k = until + 1
        made = 0
        filled = 0
        k = 0
        while k < count:
            if changed[k] == 0:
                k += 1
                continue
            high = k
            while high < count and changed[high] == 1:
                high += 1
            low, start = nearest_joint(pieces, first_piece, cap, k, -1, count, entry)
            high, finish = nearest_joint(pieces, first_piece, cap, high, 1, count, entry)
            while True:
                while made > 0 and low < windows[made - 1, 1]:
                    made -= 1
                    filled = windows[made, 2]
                    low = min(low, windows[made, 0])
                    start = starts[made] if low == windows[made, 0] else start
                work += high - low
                part, part_cell = window_law(
                    size[low:high], top[low:high], cap[low : high + 1], straight_a[low:high],
                    straight_b[low:high], first[low:high], bend[low:high], third[low:high], most[0],
                    most[1], ease[low:high], low, start, finish,
                )  # fmt: skip
                if part_cell.size > 0:
                    break
                if low == 0 and high == count:
                    return pieces[:0], cell[:0], cap, work, count
                grown = high - low
                low, start = nearest_joint(pieces, first_piece, cap, max(low - grown, 0), -1, count, entry)
                high = min(high + grown, count)
                high, finish = nearest_joint(pieces, first_piece, cap, high, 1, count, entry)
            if filled + part_cell.size > new_cell.size:
                new, new_cell = more_room(new, new_cell, part_cell.size)
            copied(part, part_cell, 0, part_cell.size, 0, new, new_cell, filled)
            starts[made] = start
            windows[made, 0] = low
            windows[made, 1] = high
            windows[made, 2] = filled
            filled += part_cell.size
            windows[made, 3] = filled
            made += 1
            k = high
        pieces, cell = spliced(pieces, cell, first_piece, windows, made, new, new_cell)
        index_pieces(cell, cell.size, first_piece, count)
        changed[:] = 0
        found = 0
        for n in range(made):
            low = windows[n, 0]
            high = windows[n, 1]
            looked_at(
                pieces, cell, first_piece[low], first_piece[high], straight_a, rows, begin, along,
                acceleration, jerk, tolerances, worst,
            )  # fmt: skip
            found += tighten(worst, straight_a, tolerances, ease, lower, changed, low, high)
    return pieces, cell, cap, work, found
