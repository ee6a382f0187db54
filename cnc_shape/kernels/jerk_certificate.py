"""What a time law with jerk asks of the machine, and whether its pieces follow each other."""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.jerk_scan import moved


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
def piece_loads(c, d, alone, s, v, a, b, velocity, acceleration, jerk, feed_rate, worst):
    """Raise `worst` (4,) to the ratios of velocity, acceleration, jerk and feed to their limits at a point."""
    square = 0.0
    for i in range(d):
        third = 6.0 * c[3, i]
        bend = 2.0 * c[2, i] + third * s
        first = c[1, i] + s * (2.0 * c[2, i] + 3.0 * c[3, i] * s)
        qv = first * v
        if (i < 3) != (alone == 1):
            square += qv * qv
        worst[0] = max(worst[0], abs(qv) / velocity[i])
        worst[1] = max(worst[1], abs(first * a + bend * v * v) / acceleration[i])
        worst[2] = max(worst[2], abs(first * b + v * (3.0 * bend * a + third * v * v)) / jerk[i])
    worst[3] = max(worst[3], np.sqrt(square) / feed_rate)


@kernel
def law_excesses(
    duration, u, speed, path_acceleration, path_jerk, cell, rows, length, feed_rate, alone, stop, limits, points
):
    """Largest ratios of velocity, acceleration, jerk and feed to their limits; largest gaps between pieces.

    Evaluates `points` points of every piece. `limits` (3,d): velocity, acceleration, jerk.

    Returns
    -------
    worst (7,)
        The four ratios; gaps of place, path speed and path acceleration.
    where (7,)
        Pieces.
    """
    worst = np.zeros(7)
    where = np.zeros(7, np.int64)
    here = np.empty(4)
    d = rows.shape[2]
    for m in range(duration.size):
        k = cell[m]
        here[:] = 0.0
        s = u[m]
        v = speed[m]
        a = path_acceleration[m]
        b = path_jerk[m]
        for n in range(points):
            e = duration[m] * n / (points - 1)
            s = u[m] + moved(speed[m], path_acceleration[m], b, e)
            v = speed[m] + e * (path_acceleration[m] + e * b / 2.0)
            a = path_acceleration[m] + e * b
            piece_loads(
                rows[k], d, alone[k], s, v, a, b, limits[0], limits[1], limits[2], feed_rate[k], here
            )
        for n in range(4):
            if here[n] > worst[n]:
                worst[n] = here[n]
                where[n] = m
        if m + 1 == duration.size:
            gap = abs(length[k] - s)
            jump = abs(v)
            step = abs(a)
        elif cell[m + 1] == k:
            gap = abs(u[m + 1] - s)
            jump = abs(speed[m + 1] - v)
            step = abs(path_acceleration[m + 1] - a)
        else:
            gap = abs(length[k] - s) + abs(u[m + 1])
            if cell[m + 1] != k + 1:
                gap = np.inf
            jump = abs(speed[m + 1] - v)
            step = abs(path_acceleration[m + 1] - a)
            if stop[k + 1] == 1:
                jump = max(abs(v), abs(speed[m + 1]))
                step = max(abs(a), abs(path_acceleration[m + 1]))
        for n, value in ((4, gap), (5, jump), (6, step)):
            if value > worst[n]:
                worst[n] = value
                where[n] = m
    return worst, where
