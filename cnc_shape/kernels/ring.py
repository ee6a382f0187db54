# pyright: basic
"""A filter with few taps on a live signal, out of a ring of its last samples."""

from cnc_shape.kernels import kernel


@kernel
def push_samples(cells, newest, signal, late, weight, taps):
    """Put samples into the ring, one after the other, and replace each by the sum of its taps.

    cells (c,d) the last c samples, written in place; newest: the row of the last one; signal (n,d) samples
    that become the filter's output; late (d,k) int, less than c, and weight (d,k) of the taps of every axis,
    taps (d,) how many of the k there are. Returns the row of the last sample.
    """
    rows, axes = cells.shape
    for j in range(signal.shape[0]):
        newest += 1
        if newest == rows:
            newest = 0
        for a in range(axes):
            cells[newest, a] = signal[j, a]
            total = 0.0
            for i in range(taps[a]):
                row = newest - late[a, i]
                if row < 0:
                    row += rows
                total += weight[a, i] * cells[row, a]
            signal[j, a] = total
    return newest
