# pyright: basic
"""Thinning a long signal to its extremes.

Samples lie in buckets of equal width. Of every bucket those rows are kept where one of several measures is
largest. The best of two neighbouring buckets is the best of their bests, so a bucket can be widened without
the rows that it has dropped.
"""

import numpy as np

from cnc_shape.kernels import kernel


@kernel
def keep_largest(measures, rows, first, width, best, index, kept):
    """Fold rows into their buckets; of equal rows the earliest stays.

    measures (k,n); rows (n,c); first: index of row 0, so that row i lies in bucket ``(first + i) // width``.
    In place: best (b,k), -inf where a bucket is empty; index (b,k) of the rows kept; kept (b,k,c), the rows.
    """
    count = rows.shape[0]
    low = 0
    while low < count:
        bucket = (first + low) // width
        high = min((bucket + 1) * width - first, count)
        for j in range(measures.shape[0]):
            top, row = best[bucket, j], -1
            for i in range(low, high):
                if measures[j, i] > top:
                    top, row = measures[j, i], i
            if row >= 0:
                best[bucket, j] = top
                index[bucket, j] = first + row
                kept[bucket, j] = rows[row]
        low = high


@kernel
def join_buckets(best, index, kept):
    """Make one bucket of every two and empty the second half, in place.

    best (b,k), index (b,k) and kept (b,k,c) as `keep_largest` fills them.
    """
    half = best.shape[0] // 2
    for b in range(half):
        for j in range(best.shape[1]):
            take = 2 * b + 1 if best[2 * b + 1, j] > best[2 * b, j] else 2 * b
            best[b, j] = best[take, j]
            index[b, j] = index[take, j]
            kept[b, j] = kept[take, j]
    best[half:] = -np.inf


@kernel
def sample_measures(rows, axes):
    """What makes a sample worth keeping, (8,n); the linear axes are the first three.

    Contour error of the tool, of the drives and of the command; the tool's with its sign turned; squares of
    following error, of deflection and of speed; largest acceleration of an axis.

    rows (n,c): command, drives and tool in mm, velocity in mm/s and acceleration in mm/s^2, `axes` columns
    each, then the contour errors of command, drives and tool in mm.
    """
    count = rows.shape[0]
    measures = np.empty((8, count))
    for i in range(count):
        row = rows[i]
        following = deflection = speed = acceleration = 0.0
        for a in range(3):
            command, drive, tool = row[a], row[axes + a], row[2 * axes + a]
            following += (command - drive) * (command - drive)
            deflection += (tool - drive) * (tool - drive)
            speed += row[3 * axes + a] * row[3 * axes + a]
            acceleration = max(acceleration, abs(row[4 * axes + a]))
        measures[0, i] = row[5 * axes + 2]
        measures[1, i] = row[5 * axes + 1]
        measures[2, i] = row[5 * axes]
        measures[3, i] = -row[5 * axes + 2]
        measures[4, i] = following
        measures[5, i] = deflection
        measures[6, i] = speed
        measures[7, i] = acceleration
    return measures
