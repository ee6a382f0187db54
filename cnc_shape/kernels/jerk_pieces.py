"""Laws as pieces, cut at the borders of the cells, and put together."""
# pyright: basic

import numpy as np

from cnc_shape.kernels import inlined, kernel
from cnc_shape.kernels.jerk_phases import moved, time_to
from cnc_shape.kernels.jerk_rounding import SHORTEST

NEAR = 1e-10  # mm or rad, of a node: as good as there


@inlined
def put_piece(pieces, cell, m, t, place, v, a, b, k):
    """Write a piece, whose time comes later (`timed`)."""
    pieces[m, 0] = 0.0
    pieces[m, 1] = t
    pieces[m, 2] = place
    pieces[m, 3] = v
    pieces[m, 4] = a
    pieces[m, 5] = b
    cell[m] = k


@inlined
def copied(pieces, cell, low, high, shift, out, out_cell, filled):
    """Append the pieces `low` to `high`, `shift` added to their cells; returns how many there are then."""
    for m in range(low, high):
        for column in range(6):
            out[filled, column] = pieces[m, column]
        out_cell[filled] = shift + cell[m]
        filled += 1
    return filled


@kernel
def timed(pieces, clock):
    """Sum up the durations of pieces (m,6) to their times, from `clock` (2,) on, and move that forward.

    `clock` holds the time and its rounding error.
    """
    time = clock[0]
    lost = clock[1]
    for m in range(pieces.shape[0]):
        pieces[m, 0] = time
        step = pieces[m, 1] - lost
        following = time + step
        lost = (following - time) - step
        time = following
    clock[0] = time
    clock[1] = lost


@kernel
def cut(law, law_cell, count, nodes, first, pieces, cell):
    """Cut the phases of a law at the nodes: pieces of time 0, duration, place in the cell, v, a, b.

    A phase that ends at a node but for rounding ends there. Every cell has a piece, however short it is.
    The cells are counted from `first` on.
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
            inside = k < last and (to_node < end - near or to_node <= place + near)
            until = begin
            if not (k < last and to_node <= place + near):
                until = time_to(v, a, b, whole, to_node - place) if inside else whole
            if until - begin >= SHORTEST or (inside and (m == 0 or cell[m - 1] != first + k)):
                here = 0.0 if begin > 0.0 else max(place - (nodes[k] - origin), 0.0)
                speed = max(v + begin * (a + begin * b / 2.0), 0.0)
                put_piece(pieces, cell, m, until - begin, here, speed, a + b * begin, b, first + k)
                m += 1
            if not inside:
                break
            k += 1
            begin = until
    while m > 0 and cell[m - 1] < first + last:  # cells at the end that are shorter than rounding
        t = pieces[m - 1, 1]
        speed = max(pieces[m - 1, 3] + t * (pieces[m - 1, 4] + t * pieces[m - 1, 5] / 2.0), 0.0)
        put_piece(
            pieces, cell, m, 0.0, 0.0, speed, pieces[m - 1, 4] + t * pieces[m - 1, 5], 0.0, cell[m - 1] + 1
        )
        m += 1
    return m


@kernel
def more_room(out, out_cell, count):
    """Return both arrays with room for twice as many pieces, and `count` at least."""
    size = out_cell.size
    more = np.empty((2 * size + count, 6))
    more_cell = np.empty(2 * size + count, np.int64)
    copied(out, out_cell, 0, size, 0, more, more_cell, 0)
    return more, more_cell


@kernel
def index_pieces(cell, count, first_piece, cells):
    """First piece (k+1,) of every cell."""
    k = 0
    for m in range(count):
        while k <= cell[m]:
            first_piece[k] = m
            k += 1
    while k <= cells:
        first_piece[k] = count
        k += 1


@kernel
def spliced(pieces, cell, first_piece, windows, count, new, new_cell):
    """Pieces in which those of some windows are replaced by new ones.

    `windows` (n,4): first cell, end; first of the new pieces, end.
    """
    size = cell.size
    for n in range(count):
        size += windows[n, 3] - windows[n, 2]
        size -= first_piece[windows[n, 1]] - first_piece[windows[n, 0]]
    out = np.empty((size, 6))
    out_cell = np.empty(size, np.int64)
    filled = 0
    here = 0
    for n in range(count + 1):
        until = first_piece[windows[n, 0]] if n < count else cell.size
        filled = copied(pieces, cell, here, until, 0, out, out_cell, filled)
        if n < count:
            filled = copied(new, new_cell, windows[n, 2], windows[n, 3], 0, out, out_cell, filled)
            here = first_piece[windows[n, 1]]
    return out, out_cell
