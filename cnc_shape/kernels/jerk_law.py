"""The time law of a path under a jerk limit: scans, rounding and certificate of every section.

The scans guess what the acceleration will be when they ask how much jerk the curvature takes, so the
finished law is looked at: where it asks for more than the limit, the cell and its neighbours may use less in
the next round. Limits only fall, so this ends; straight cells never ask for too much.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.jerk_caps import derivatives, falling_jerk, speed_caps, straight_jerk, tighten
from cnc_shape.kernels.jerk_certificate import certificate
from cnc_shape.kernels.jerk_phases import moved, time_to
from cnc_shape.kernels.jerk_rounding import SHORTEST, round_off
from cnc_shape.kernels.jerk_scan import PHASES, envelope, mirrored, scan

NEAR = 1e-10  # mm or rad, of a node: as good as there


@kernel
def timed(pieces):
    """Sum up the durations of pieces (m,6) to their times, with what rounding took away."""
    time = 0.0
    lost = 0.0
    for m in range(pieces.shape[0]):
        pieces[m, 0] = time
        step = pieces[m, 1] - lost
        following = time + step
        lost = (following - time) - step
        time = following


@kernel
def cut(law, law_cell, count, nodes, pieces, cell):
    """Cut the phases of a law at the nodes: pieces of time 0, duration, place in the cell, v, a, b.

    A phase that ends at a node but for rounding ends there. Every cell has a piece, however short it is.
    """
    m = 0
    k = 0
    last = nodes.size - 2
    for n in range(count):
        whole = law[n, 0]
        if whole < SHORTEST:
            continue
        origin = nodes[law_cell[n]]
        place = law[n, 1]
        v = law[n, 2]
        a = law[n, 3]
        b = law[n, 4]
        end = place + moved(v, a, b, whole)
        near = NEAR + 2e-16 * origin
        begin = 0.0
        while True:
            to_node = nodes[k + 1] - origin
            inside = k < last and to_node < end - near
            until = begin
            if not (k < last and to_node <= place + near):
                until = time_to(v, a, b, whole, to_node - place) if inside else whole
            if until - begin >= SHORTEST or (inside and (m == 0 or cell[m - 1] != k)):
                pieces[m, 0] = 0.0
                pieces[m, 1] = until - begin
                pieces[m, 2] = 0.0 if begin > 0.0 else max(place - (nodes[k] - origin), 0.0)
                pieces[m, 3] = max(v + begin * (a + begin * b / 2.0), 0.0)
                pieces[m, 4] = a + b * begin
                pieces[m, 5] = b
                cell[m] = k
                m += 1
            if not inside:
                break
            k += 1
            begin = until
    return m


@kernel
def section_law(
    rows, length, feed_rate, alone, limit_v2, straight, velocity, acceleration, jerk, begin, end, tolerances,
    most_rounds,
):  # fmt: skip
    """Time law of the cells `begin` to `end`, from rest to rest.

    Parameters
    ----------
    tolerances (3,)
        By which velocity and feed, acceleration and jerk may exceed their limits.
    most_rounds
        Of lowering limits where they do not.

    Returns
    -------
    pieces (m,6), cell (m,)
        0, duration, place in the cell, v, a, b; the cell counted from `begin`.
    rounds
    found
        Cells that still ask for too much.
    """
    count = end - begin
    d = acceleration.size
    size = length[begin:end]
    first = np.empty((count, 2, d))
    bend = np.empty((count, 2, d))
    third = np.empty((count, d))
    derivatives(rows[begin:end], size, first, bend, third)
    straight_a = np.empty(count)
    straight_b = np.empty(count)
    limits = limit_v2[begin:end]
    straight_jerk(limits, straight[begin:end], first, bend, third, jerk, straight_a, straight_b)
    nodes = np.zeros(count + 1)
    for k in range(count):
        nodes[k + 1] = nodes[k] + size[k]
    back_first = -first[::-1, ::-1].copy()
    back_bend = bend[::-1, ::-1].copy()
    back_third = -third[::-1].copy()
    back_size = size[::-1].copy()
    own_size = size.copy()
    back_straight_a = straight_a[::-1].copy()
    back_straight_b = straight_b[::-1].copy()
    ease = np.ones((5, count))
    top = np.empty(count)
    cap = np.empty(count + 1)
    least = np.empty(count)
    rising = np.empty((PHASES * count, 5))
    falling = np.empty((PHASES * count, 5))
    upper = np.empty((2 * PHASES * count, 5))
    rising_cell = np.empty(PHASES * count, np.int64)
    falling_cell = np.empty(PHASES * count, np.int64)
    upper_cell = np.empty(2 * PHASES * count, np.int64)
    law = np.empty((4 * PHASES * count + 4, 5))
    law_cell = np.empty(4 * PHASES * count + 4, np.int64)
    pieces = np.empty((4 * PHASES * count + 4 + count, 6))
    cell = np.empty(4 * PHASES * count + 4 + count, np.int64)
    worst = np.empty((count, 7))
    rounds = 0
    found = 1
    m = 0
    while found > 0 and rounds < most_rounds:
        rounds += 1
        speed_caps(limits, straight_a, bend, third, acceleration, jerk, ease, top, cap)
        r = scan(
            own_size, top, cap, straight_a, straight_b, first, bend, third, acceleration, jerk, ease,
            rising, rising_cell,
        )  # fmt: skip
        f = scan(
            back_size, top[::-1].copy(), cap[::-1].copy(), back_straight_a, back_straight_b, back_first,
            back_bend, back_third, acceleration, jerk, ease[:, ::-1].copy(), falling,
            falling_cell,
        )  # fmt: skip
        mirrored(falling, falling_cell, f, own_size)
        u = envelope(rising, rising_cell, r, falling, falling_cell, f, own_size, upper, upper_cell)
        falling_jerk(first, third, straight_a, straight_b, jerk, ease, upper, upper_cell, u, least)
        w = round_off(upper, upper_cell, u, nodes, least, law, law_cell)
        m = cut(law, law_cell, w, nodes, pieces, cell)
        certificate(
            pieces, cell, m, rows, begin, feed_rate, alone, velocity, acceleration, jerk,
            1.0 + tolerances[2], worst,
        )  # fmt: skip
        found = tighten(worst, straight_a, tolerances, ease)
    return pieces[:m], cell[:m], rounds, found


@kernel
def path_law(
    rows, length, stop, dwell, feed_rate, alone, limit_v2, straight, velocity, acceleration, jerk, tolerances,
    most_rounds,
):  # fmt: skip
    """Time law of a whole path, section by section.

    Returns
    -------
    pieces (m,6), cell (m,)
        0, duration, place in the cell, v, a, b.
    stuck
        A cell in a section without a law; -1 if there is none.
    """
    count = length.size
    out = np.empty((4 * count + 64, 6))
    out_cell = np.empty(4 * count + 64, np.int64)
    filled = 0
    stuck = -1
    begin = 0
    while begin < count:
        if dwell[begin] > 0.0 or length[begin] == 0.0:
            if filled == out_cell.size:
                out, out_cell = more_room(out, out_cell, 1)
            out[filled] = 0.0
            out[filled, 1] = dwell[begin]
            out_cell[filled] = begin
            filled += 1
        end = begin + 1
        if length[begin] > 0.0:
            while end < count and not stop[end] and length[end] > 0.0:
                end += 1
            pieces, cell, _, found = section_law(
                rows, length, feed_rate, alone, limit_v2, straight, velocity, acceleration, jerk, begin, end,
                tolerances, most_rounds,
            )  # fmt: skip
            if found > 0 and stuck < 0:
                stuck = begin
            if filled + cell.size > out_cell.size:
                out, out_cell = more_room(out, out_cell, cell.size)
            for n in range(cell.size):
                for column in range(6):
                    out[filled + n, column] = pieces[n, column]
                out_cell[filled + n] = begin + cell[n]
            filled += cell.size
        begin = end
    return out[:filled], out_cell[:filled], stuck


@kernel
def more_room(out, out_cell, count):
    """Return both arrays with room for twice as many pieces, and `count` at least."""
    size = out_cell.size
    more = np.empty((2 * size + count, 6))
    more_cell = np.empty(2 * size + count, np.int64)
    for n in range(size):
        for column in range(6):
            more[n, column] = out[n, column]
        more_cell[n] = out_cell[n]
    return more, more_cell
