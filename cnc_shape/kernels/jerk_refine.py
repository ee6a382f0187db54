"""A finished law brought close to the fastest one, stretch by stretch between its rests and long cruises.

The scans of `kernels/jerk_scan.py` run curves as if the path acceleration were 0 wherever a limit of speed is
met, and what the jerk of a curve takes they leave to guesses that only ever get lower. In a blend the fastest
law brakes until its middle and accelerates from there, because then ``3 q'' v a`` takes ``q''' v^3`` away:
`kernels/jerk_stretch.py` looks for it. No law gets slower.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.jerk_cells import prepared
from cnc_shape.kernels.jerk_phases import moved
from cnc_shape.kernels.jerk_pieces import copied, more_room, put_piece
from cnc_shape.kernels.jerk_stretch import refined_stretch

LONG_CRUISE = 2.0  # -, of the time in which the acceleration rises: stretches end in such a phase
MOST_PIECES = 10_000  # of a stretch
NEAR_REST = 0.25  # -, of that time: what is nearer to a rest is left as it is
STILL = 1e-6  # mm/s or rad/s: a speed that counts as rest
SHORTEST_RISE = 1e-3  # s, in which the acceleration rises: with less the jerk limit is hardly felt


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
def stretch_end(pieces, cell, straight_a, begin, size, rise):
    """Last piece of the stretch that starts in `begin`, and whether a cell of it is curved."""
    curved = False
    m = begin
    while True:
        curved = curved or straight_a[cell[m]] == 0.0
        cruise = pieces[m, 4] == 0.0 and pieces[m, 5] == 0.0 and pieces[m, 1] > LONG_CRUISE * rise
        if m + 1 == size or (m > begin and (cruise or m - begin > MOST_PIECES)):
            return m, curved
        m += 1


@kernel
def refined(
    pieces, cell, rows, length, limit_v2, straight_a, acceleration, jerk, tolerances, counts, allowed
):
    """Pieces (m,6) of a law and their cells, where it could be made faster; its ends stay what they are."""
    rise = rise_time(acceleration, jerk)
    if rise < SHORTEST_RISE or (straight_a > 0.0).all():
        return pieces, cell
    out = np.empty((2 * cell.size + 64, 6))
    out_cell = np.empty(2 * cell.size + 64, np.int64)
    filled = np.int64(0)
    begin, size = between_ends(pieces, NEAR_REST * rise)
    first = begin
    filled = copied(pieces, cell, 0, begin, 0, out, out_cell, filled)
    done = 0.0  # of the piece `begin`
    while begin < size:
        end, curved = stretch_end(pieces, cell, straight_a, begin, size, rise)
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
            new, new_cell = refined_stretch(
                pieces, cell, begin, start, end, finish, rise, rows, length, limit_v2, straight_a,
                acceleration, jerk, tolerances, counts, allowed,
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
            filled = copied(new, new_cell, 0, new_cell.size, 0, out, out_cell, filled)
            if last:
                filled = put_part(pieces, cell, end, finish, pieces[end, 1], out, out_cell, filled)
        begin = size if last else end
        done = finish
    if filled + cell.size - size > out_cell.size:
        out, out_cell = more_room(out, out_cell, cell.size - size)
    filled = copied(pieces, cell, size, cell.size, 0, out, out_cell, filled)
    return out[:filled].copy(), out_cell[:filled].copy()


@kernel
def put_part(pieces, cell, m, low, high, out, out_cell, filled):
    """Write a piece between two of its times; returns the number of pieces then."""
    if not high > low and pieces[m, 1] > 0.0:
        return filled
    v = pieces[m, 3]
    a = pieces[m, 4]
    b = pieces[m, 5]
    place = pieces[m, 2] + moved(v, a, b, low) if low > 0.0 else pieces[m, 2]
    put_piece(
        out, out_cell, filled, high - low, place, v + low * (a + low * b / 2.0), a + b * low, b, cell[m]
    )
    return filled + 1


@kernel
def close_to_fastest(
    pieces, cell, spans, rows, length, limit_v2, straight, along, acceleration, jerk, tolerances, counts,
    passed, free, share,
):  # fmt: skip
    """The pieces of a law, faster where they can be, and their cells.

    Parameters
    ----------
    spans (n,4)
        First cell and end, first piece and end of each part of the law that is to be left by itself.
    along
        Where the acceleration along the path is limited, (k,), the law stays what it is.
    counts
        Its column `jerk_stretch.REFINED`: nodes worked on so far.
    passed
        Cells of the program before the first one.
    free, share
        Nodes that a program has worked on at once, and for each of its cells passed by; less than 0: none.
    """
    if along.size > 0 or free < 0.0:
        return pieces.copy(), cell.copy()
    out = np.empty((2 * cell.size + 64, 6))
    out_cell = np.empty(2 * cell.size + 64, np.int64)
    filled = np.int64(0)
    here = 0
    for n in range(spans.shape[0] + 1):
        until = spans[n, 2] if n < spans.shape[0] else cell.size
        if filled + until - here > out_cell.size:
            out, out_cell = more_room(out, out_cell, until - here)
        filled = copied(pieces, cell, here, until, 0, out, out_cell, filled)
        if n == spans.shape[0]:
            break
        begin = spans[n, 0]
        end = spans[n, 1]
        here = spans[n, 3]
        size, _, _, _, _, straight_a, _ = prepared(
            rows, length, limit_v2, straight, along, acceleration, jerk, begin, end
        )
        allowed = free + share * (passed + end)
        law, law_cell = refined(
            pieces[until:here].copy(), cell[until:here] - begin, rows[begin:end], size, limit_v2[begin:end],
            straight_a, acceleration, jerk, tolerances, counts, allowed,
        )  # fmt: skip
        if filled + law_cell.size > out_cell.size:
            out, out_cell = more_room(out, out_cell, law_cell.size)
        filled = copied(law, law_cell, 0, law_cell.size, begin, out, out_cell, filled)
    return out[:filled].copy(), out_cell[:filled].copy()
