"""Runs of short edges as chords."""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel

ROTARY_MERGE_TOLERANCE = 1e-4  # rad
WINDOW = 64  # edges that one chord may replace
FEW = 4  # edges: a chord that replaces fewer is worth a look for noise
MANY = 8  # edges: fewer are not a pattern
NOISE_TURN = 0.1  # -, net turn over the sum of turns, of a run that is noise


@kernel
def chord_reach(start, end, first, stop, tolerance):
    """Return how many edges from `first` on one chord may replace, and its distance from them, mm.

    Extends the chord edge by edge, at most to `stop`, while every vertex it skips is within `tolerance`,
    passed in order, and no rotary axis is off by more than its own tolerance.
    """
    d = start.shape[1]
    best = 1
    distance = 0.0
    chord = np.empty(d)
    for last in range(first + 1, stop):
        square = 0.0
        for i in range(d):
            chord[i] = end[last, i] - start[first, i]
            if i < 3:
                square += chord[i] * chord[i]
        if square <= 0.0:
            break
        worst = 0.0
        before = 0.0
        kept = True
        for k in range(first, last):
            progress = 0.0
            for i in range(3):
                progress += (end[k, i] - start[first, i]) * chord[i]
            progress /= square
            kept = before <= progress <= 1.0
            before = progress
            off = 0.0
            for i in range(d):
                miss = end[k, i] - start[first, i] - progress * chord[i]
                if i < 3:
                    off += miss * miss
                else:
                    kept = kept and abs(miss) <= ROTARY_MERGE_TOLERANCE
            worst = max(worst, off)
            if not kept or off > tolerance * tolerance:
                kept = False
                break
        if not kept:
            break
        best = last - first + 1
        distance = np.sqrt(worst)
    return best, distance


@kernel
def turns_to_and_fro(start, end, first, after):
    """Tell whether the turns of a run of edges cancel: their sum is below a tenth of their sizes'."""
    sizes = 0.0
    total = np.zeros(3)
    before = np.zeros(3)
    for k in range(first, after):
        length = 0.0
        for i in range(3):
            length += (end[k, i] - start[k, i]) ** 2
        length = max(np.sqrt(length), 1e-300)
        size = 0.0
        for i in range(3):
            tangent = (end[k, i] - start[k, i]) / length
            if k > first:
                size += (tangent - before[i]) ** 2
                total[i] += tangent - before[i]
            before[i] = tangent
        sizes += np.sqrt(size)
    net = np.sqrt(total[0] ** 2 + total[1] ** 2 + total[2] ** 2)
    return net <= NOISE_TURN * sizes


@kernel
def merge(start, end, tolerance, merge_tolerance, noise_tolerance, feed_rate, stop, whole, final):
    """Greedy chords: for each edge that is kept, its first edge, the edge after it, and its distance.

    Edges merge only with edges of equal feed and tolerances that are `whole` moves, and never over a stop.
    Without `final` the edges whose chord may yet grow are left for the next call.

    Returns
    -------
    first (n,), after (n,), distance (n,) mm
    """
    m = start.shape[0]
    first = np.empty(m, np.int64)
    after = np.empty(m, np.int64)
    distance = np.empty(m)
    n = 0
    k = 0
    while k < m:
        limit = k + 1
        if whole[k] == 1:
            while (
                limit < m
                and limit - k < WINDOW
                and stop[limit] == 0
                and whole[limit] == 1
                and feed_rate[limit] == feed_rate[k]
                and tolerance[limit] == tolerance[k]
                and merge_tolerance[limit] == merge_tolerance[k]
                and noise_tolerance[limit] == noise_tolerance[k]
            ):
                limit += 1
        if limit == m and not final and limit - k < WINDOW and whole[k] == 1:
            break
        count = 1
        off = 0.0
        if limit > k + 1:
            count, off = chord_reach(start, end, k, limit, merge_tolerance[k])
            if count < FEW and noise_tolerance[k] > merge_tolerance[k]:
                noise, noise_off = chord_reach(start, end, k, limit, noise_tolerance[k])
                if noise >= MANY and turns_to_and_fro(start, end, k, k + noise):
                    count = noise
                    off = noise_off
        first[n] = k
        after[n] = k + count
        distance[n] = off
        n += 1
        k += count
    return first[:n], after[:n], distance[:n]
