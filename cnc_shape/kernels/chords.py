"""Runs of short edges as chords."""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel

ROTARY_MERGE_TOLERANCE = 1e-4  # rad
WINDOW = 64  # edges that one chord may replace
MANY = 8  # edges: fewer are not a pattern; a chord that replaces fewer is worth a look for noise
STRAIGHT = 1e-6  # rad, a smaller turn is none
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
    """Tell whether the turns of a run of edges cancel.

    At least every other one opposes the one before, and their sum is below a tenth of their sizes', or no
    more than one of them.
    """
    sizes = 0.0
    largest = 0.0
    turns = 0
    reversals = 0
    total = np.zeros(3)
    before = np.zeros(3)
    turn = np.zeros(3)
    turn_before = np.zeros(3)
    for k in range(first, after):
        length = 0.0
        for i in range(3):
            length += (end[k, i] - start[k, i]) ** 2
        length = max(np.sqrt(length), 1e-300)
        size = 0.0
        opposed = 0.0
        for i in range(3):
            tangent = (end[k, i] - start[k, i]) / length
            turn[i] = tangent - before[i]
            before[i] = tangent
            size += turn[i] * turn[i]
            opposed += turn[i] * turn_before[i]
        if k == first or size < STRAIGHT * STRAIGHT:
            continue
        turns += 1
        if opposed < 0.0:
            reversals += 1
        sizes += np.sqrt(size)
        largest = max(largest, np.sqrt(size))
        for i in range(3):
            total[i] += turn[i]
            turn_before[i] = turn[i]
    net = np.sqrt(total[0] ** 2 + total[1] ** 2 + total[2] ** 2)
    if reversals < max(2, turns // 2):
        return False
    return net <= max(NOISE_TURN * sizes, (1.0 + STRAIGHT) * largest)


@kernel
def merge(start, end, tolerance, merge_tolerance, noise_tolerance, feed_rate, stop, whole, final):
    """Greedy chords: for each edge that is kept, its first edge, the edge after it, and its distance.

    Edges merge only with edges of equal feed and tolerances that are `whole` moves, and never over a stop.
    The end of a run of noise may be too short to be told from a shape: the last two chords share evenly.
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
    run = 0  # the edge after those that may merge with k, as far as it matters
    while k < m:
        run = max(run, k + 1)
        if whole[k] == 1:
            while (
                run < m
                and run - k < 2 * WINDOW
                and stop[run] == 0
                and whole[run] == 1
                and feed_rate[run] == feed_rate[k]
                and tolerance[run] == tolerance[k]
                and merge_tolerance[run] == merge_tolerance[k]
                and noise_tolerance[run] == noise_tolerance[k]
            ):
                run += 1
        if run == m and not final and run - k < 2 * WINDOW and whole[k] == 1:
            break
        limit = min(run, k + WINDOW)
        count = 1
        off = 0.0
        if limit > k + 1:
            count, off = chord_reach(start, end, k, limit, merge_tolerance[k])
            if count < min(limit - k, MANY) and noise_tolerance[k] > merge_tolerance[k]:
                noise, noise_off = chord_reach(start, end, k, limit, noise_tolerance[k])
                if noise >= MANY and turns_to_and_fro(start, end, k, k + noise):
                    count = noise
                    off = noise_off
                    rest = run - k - noise
                    if 0 < rest < WINDOW:  # maybe too few to show a pattern: two chords share them
                        half = (noise + rest) // 2
                        tail, tail_off = chord_reach(start, end, k + half, run, noise_tolerance[k])
                        if half + tail == noise + rest:
                            count, off = chord_reach(start, end, k, k + half, noise_tolerance[k])
                            first[n] = k
                            after[n] = k + count
                            distance[n] = off
                            n += 1
                            k += count
                            count = tail
                            off = tail_off
        first[n] = k
        after[n] = k + count
        distance[n] = off
        n += 1
        k += count
    return first[:n], after[:n], distance[:n]
