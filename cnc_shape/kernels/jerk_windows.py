"""The time law of a path that comes in pieces: windows that reach a few stopping distances ahead.

A window is planned as if the path rested at its end, the most cautious of all futures. Where the law passes
a node without acceleration, as fast as that node may be passed at all, no other future could make it
faster: up to the last such node, the joint, the law is final, and the next window starts there. Where there
is none, because the law is always on its way up or down, the law is kept at one speed around a node where
it is nearly so.

A window is held back until the next one has a law from the joint on. If that has none, both are planned as
one; if this has none either, the path rests where the window held back ends: a law up to there is known.
Windows depend on the path alone, never on how much of it has come in.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.jerk_law import NO_ACCELERATION, section_law
from cnc_shape.kernels.jerk_pieces import copied, index_pieces, more_room, put_piece
from cnc_shape.kernels.jerk_rescue import slow_law

SAME_CAP = 1e-9  # -, of a speed that is the node's own cap
CALM_AHEAD = 1.5  # stopping distances between a node where the law is kept at one speed and the window's end
CALM_SHARE = 0.999  # -, of the lowest speed about such a node
CALM_TRIES = 3
FEW = 16  # cells that are not divided any further where they have no law
PLANNED, CALMED, MERGED, RESTS, SLOWED = 0, 1, 2, 3, 4  # columns of what is counted


@kernel
def stopping_distance(row, h, v, acceleration, jerk):
    """Distance from the speed v to rest on a cell as if it were straight; and its path jerk."""
    a = np.inf
    b = np.inf
    for i in range(acceleration.size):
        end = abs(row[1, i] + h * (2.0 * row[2, i] + 3.0 * h * row[3, i]))
        rate = max(abs(row[1, i]), end)
        if rate > 0.0:
            a = min(a, acceleration[i] / rate)
            b = min(b, jerk[i] / rate)
    if v * b < a * a:
        return v * np.sqrt(v / b), b
    return 0.5 * v * (v / a + a / b), b


@kernel
def window_end(rows, length, stop, limit_v2, acceleration, jerk, at, last, window, ahead):
    """End of the window that starts with the cell `at`; whether it has come in, whether the path rests there.

    Parameters
    ----------
    window, ahead
        Cells and stopping distances that it spans at least.
    """
    count = length.size
    covered = 0.0
    end = at
    while True:
        v = np.sqrt(max(limit_v2[end, 0], limit_v2[end, 1]))
        distance, _ = stopping_distance(rows[end], length[end], v, acceleration, jerk)
        covered += length[end] / distance
        end += 1
        if end == count:
            return end, last, True
        if stop[end] or length[end] == 0.0:
            return end, True, True
        if end - at >= window and covered >= ahead:
            return end, True, False


@kernel
def last_joint(pieces, cell, cap):
    """The last node that the law passes without acceleration at its cap, and the speed; 0 without one."""
    for m in range(cell.size - 1, 0, -1):
        node = cell[m]
        if cell[m - 1] == node:
            continue
        v = pieces[m, 3]
        if v < cap[node] * (1.0 - SAME_CAP) or v == 0.0:
            continue
        small = NO_ACCELERATION * max(abs(pieces[m, 5]), abs(pieces[m - 1, 5]))
        ended = pieces[m - 1, 4] + pieces[m - 1, 5] * pieces[m - 1, 1]
        if abs(ended) <= small and abs(pieces[m, 4]) <= small:
            return node, v
    return 0, 0.0


@kernel
def calm_cells(rows, length, limit_v2, acceleration, jerk, pieces, cell, begin, end, wide):
    """Cells about the node of the least acceleration, counted from `begin`, and the speed to keep there.

    In a window of less than a few stopping distances it is the node of the highest speed.
    """
    count = end - begin
    first_piece = np.zeros(count + 1, np.int64)
    index_pieces(cell, cell.size, first_piece, count)
    covered = 0.0
    node = 0
    least = np.inf
    fastest = 0.0
    for k in range(count - 1, count // 4, -1):
        v = np.sqrt(max(limit_v2[begin + k, 0], limit_v2[begin + k, 1]))
        distance, _ = stopping_distance(rows[begin + k], length[begin + k], v, acceleration, jerk)
        covered += length[begin + k] / distance
        a = abs(pieces[first_piece[k], 4])
        if covered >= CALM_AHEAD and a < least and pieces[first_piece[k], 3] > 0.0:
            least = a
            node = k
        if least == np.inf and pieces[first_piece[k], 3] > fastest:
            fastest = pieces[first_piece[k], 3]
            node = k
    if node == 0:
        return 0, 0, 0.0
    v = pieces[first_piece[node], 3]
    _, b = stopping_distance(rows[begin + node], length[begin + node], v, acceleration, jerk)
    reach = wide * v * abs(pieces[first_piece[node], 4]) / b
    low = node - 1
    high = node + 1
    far = length[begin + low]
    while low > 1 and far < reach:
        low -= 1
        far += length[begin + low]
    far = length[begin + node]
    while high < count - 1 and far < reach:
        far += length[begin + high]
        high += 1
    speed = v
    for m in range(first_piece[low], first_piece[high]):
        speed = min(speed, pieces[m, 3])
    return low, high, CALM_SHARE * speed


@kernel
def released(pieces, cell, until, at, out, out_cell, filled, spans, count):
    """Append the pieces of the cells before `until` as one span; returns the arrays and their numbers."""
    size = 0
    while size < cell.size and cell[size] < until:
        size += 1
    if filled + size > out_cell.size:
        out, out_cell = more_room(out, out_cell, size)
    copied(pieces, cell, 0, size, at, out, out_cell, filled)
    spans[count, 0] = at
    spans[count, 1] = at + until
    spans[count, 2] = filled
    spans[count, 3] = filled + size
    return out, out_cell, filled + size, count + 1


@kernel
def waited(duration, at, out, out_cell, filled):
    """Append a rest at the start of the cell `at`; returns the arrays and how many pieces they hold."""
    if filled == out_cell.size:
        out, out_cell = more_room(out, out_cell, 1)
    put_piece(out, out_cell, filled, duration, 0.0, 0.0, 0.0, 0.0, at)
    return out, out_cell, filled + 1


@kernel
def windows_law(
    rows, length, stop, dwell, limit_v2, straight, along, acceleration, jerk, tolerances, most_rounds, last,
    window, ahead, held, held_cell, marks, speeds, counts,
):  # fmt: skip
    """Time law of as much of a path as is final.

    Parameters
    ----------
    along (k,)
        Limit of the acceleration along each cell; (0,): none.
    last
        Whether nothing follows.
    held (m,6), held_cell (m,)
        Law of the window that was held back; its cells are the first of the path.
    marks (2,), speeds (2,)
        Its joint and its end; speeds at its start and at the joint. Changed. A joint of 0: nothing is held.
    counts (6,)
        What has been done so far: cells planned, tries to keep one speed, windows planned as one, rests and
        halvings, cells slowed; and one for `jerk_stretch`.

    Returns
    -------
    pieces (m,6), cell (m,)
        0, duration, place in the cell, v, a, b: what is final.
    spans (n,4)
        Cells and pieces, first and end, of its parts between two joints.
    held, held_cell
        What is held back now.
    done
        The first cell that is not final.
    """
    count = length.size
    out = np.empty((4 * count + 64, 6))
    out_cell = np.empty(4 * count + 64, np.int64)
    nothing = np.int64(0)  # a bare 0 has a type of its own, and kernels called with it a second version
    spans = np.empty((count + 1, 4), np.int64)  # cells and pieces, first and end, between two joints
    made = nothing
    filled = nothing
    at = nothing
    most = count
    while at < count:
        begin = at + marks[0]
        if marks[0] == 0 and length[at] == 0.0:
            out, out_cell, filled = waited(dwell[at], at, out, out_cell, filled)
            at += 1
            continue
        end, complete, rests = window_end(
            rows, length, stop, limit_v2, acceleration, jerk, begin, last, window, ahead
        )
        if not complete:
            break
        if end - begin > most:
            end = begin + most
            rests = True
        entry = speeds[1] if marks[0] > 0 else 0.0
        known = 0  # joint from which the law has been sought in vain
        pieces, cell, cap, work, found = section_law(
            rows, length, limit_v2, straight, along, acceleration, jerk, begin, end,
            entry, nothing, nothing, 0.0, tolerances, most_rounds,
        )  # fmt: skip
        counts[PLANNED] += work
        if found == 0 and marks[0] > 0:
            out, out_cell, filled, made = released(
                held, held_cell, marks[0], at, out, out_cell, filled, spans, made
            )
            at = begin
        elif found > 0 and marks[0] > 0:
            counts[MERGED] += 1
            entry = speeds[0]
            known = marks[0]
            pieces, cell, cap, work, found = section_law(
                rows, length, limit_v2, straight, along, acceleration, jerk, at, end,
                entry, nothing, nothing, 0.0, tolerances, most_rounds,
            )  # fmt: skip
            counts[PLANNED] += work
            if found > 0:
                counts[RESTS] += 1
                out, out_cell, filled, made = released(
                    held, held_cell, marks[1], at, out, out_cell, filled, spans, made
                )
                at += marks[1]
                marks[0] = 0
                continue
        elif found > 0 and end - at > FEW:
            most = (end - at) // 2
            counts[RESTS] += 1
            continue
        elif found > 0:
            pieces, cell = slow_law(
                rows, length, limit_v2, straight, along, acceleration, jerk, at, end, tolerances
            )
            counts[SLOWED] += end - at
            rests = True
        if marks[0] == 0 and dwell[at] > 0.0:
            out, out_cell, filled = waited(dwell[at], at, out, out_cell, filled)
        most = count
        marks[0] = 0
        if rests:
            out, out_cell, filled, made = released(
                pieces, cell, end - at, at, out, out_cell, filled, spans, made
            )
            at = end
            continue
        joint, speed = last_joint(pieces, cell, cap)
        wide = 1.0
        for _ in range(CALM_TRIES):
            if joint > known:
                break
            low, high, calm = calm_cells(
                rows, length, limit_v2, acceleration, jerk, pieces, cell, at, end, wide
            )
            wide *= 4.0
            if high == 0:
                break
            counts[CALMED] += 1
            calmed, calmed_cell, calmed_cap, work, found = section_law(
                rows, length, limit_v2, straight, along, acceleration, jerk, at, end,
                entry, low, high, calm, tolerances, most_rounds,
            )  # fmt: skip
            counts[PLANNED] += work
            if found == 0:
                joint, speed = last_joint(calmed, calmed_cell, calmed_cap)
                if joint > known:
                    pieces = calmed
                    cell = calmed_cell
        if joint <= known:
            counts[RESTS] += 1
            out, out_cell, filled, made = released(
                pieces, cell, end - at, at, out, out_cell, filled, spans, made
            )
            at = end
            continue
        held = pieces
        held_cell = cell
        marks[0] = joint
        marks[1] = end - at
        speeds[0] = entry
        speeds[1] = speed
    return out[:filled], out_cell[:filled], spans[:made], held, held_cell, at
