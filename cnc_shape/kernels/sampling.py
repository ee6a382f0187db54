"""A time law at points in time: commands of the axes, and what they ask of the machine."""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel


@kernel
def point(rows, s, v, a, position, velocity, acceleration):
    """Position, velocity and acceleration of the axes at `s` in a cell; path speed v, acceleration a."""
    for i in range(position.size):
        c0 = rows[0, i]
        c1 = rows[1, i]
        c2 = rows[2, i]
        c3 = rows[3, i]
        first = c1 + s * (2.0 * c2 + 3.0 * c3 * s)
        second = 2.0 * c2 + 6.0 * c3 * s
        position[i] = c0 + s * (c1 + s * (c2 + s * c3))
        velocity[i] = first * v
        acceleration[i] = first * a + second * v * v


@kernel
def sample_pieces(
    time,
    u,
    speed,
    path_acceleration,
    jerk,
    cell,
    rows,
    arc_length,
    stretch,
    until,
    piece,
    first,
    sample_time,
    room,
):
    """Samples number `first` and later that lie before `until` s, from `piece` on, at most `room` of them.

    The sample at the border of two pieces belongs to the later one.

    Returns
    -------
    place (n,), position, velocity, acceleration (n,d)
    piece
        Where the next call goes on; the number of pieces once all samples before `until` are made.
    """
    pieces = time.size
    d = rows.shape[2]
    place = np.empty(room)
    position = np.empty((room, d))
    velocity = np.empty((room, d))
    acceleration = np.empty((room, d))
    n = 0
    while piece < pieces:
        end = time[piece + 1] if piece + 1 < pieces else until
        k = cell[piece]
        while n < room:
            e = (first + n) * sample_time
            if e >= end:
                break
            e -= time[piece]
            s = u[piece] + e * (speed[piece] + e * (path_acceleration[piece] / 2.0 + e * jerk[piece] / 6.0))
            v = speed[piece] + e * (path_acceleration[piece] + e * jerk[piece] / 2.0)
            a = path_acceleration[piece] + e * jerk[piece]
            point(rows[k], s, v, a, position[n], velocity[n], acceleration[n])
            place[n] = arc_length[k] + stretch[k] * s
            n += 1
        if (first + n) * sample_time < end:
            break
        piece += 1
    return place[:n], position[:n], velocity[:n], acceleration[:n], piece


@kernel
def excesses(
    time,
    duration,
    u,
    speed,
    path_acceleration,
    jerk,
    cell,
    rows,
    length,
    feed_rate,
    alone,
    stop,
    limits,
    points,
):
    """Largest ratio of velocity, acceleration and feed to their limits, and largest gap between pieces.

    Evaluates `points` points of every piece. `limits` (2,d): velocity and acceleration.

    Returns
    -------
    worst (5,)
        Ratios of velocity, acceleration and feed; gaps in u, and in path speed.
    where (5,)
        Pieces.
    """
    worst = np.zeros(5)
    where = np.zeros(5, np.int64)
    d = rows.shape[2]
    q = np.empty(d)
    qv = np.empty(d)
    qa = np.empty(d)
    for m in range(time.size):
        k = cell[m]
        s = 0.0
        v = 0.0
        for n in range(points):
            e = duration[m] * n / (points - 1)
            s = u[m] + e * (speed[m] + e * (path_acceleration[m] / 2.0 + e * jerk[m] / 6.0))
            v = speed[m] + e * (path_acceleration[m] + e * jerk[m] / 2.0)
            a = path_acceleration[m] + e * jerk[m]
            point(rows[k], s, v, a, q, qv, qa)
            square = 0.0
            for i in range(d):
                if (i < 3) != (alone[k] == 1):
                    square += qv[i] ** 2
                if abs(qv[i]) > worst[0] * limits[0, i]:
                    worst[0] = abs(qv[i]) / limits[0, i]
                    where[0] = m
                if abs(qa[i]) > worst[1] * limits[1, i]:
                    worst[1] = abs(qa[i]) / limits[1, i]
                    where[1] = m
            if np.sqrt(square) > worst[2] * feed_rate[k]:
                worst[2] = np.sqrt(square) / feed_rate[k]
                where[2] = m
        if m + 1 == time.size:
            gap = abs(length[k] - s)
            jump = abs(v)
        elif cell[m + 1] == k:
            gap = abs(u[m + 1] - s)
            jump = abs(speed[m + 1] - v)
        else:
            gap = abs(length[k] - s) + abs(u[m + 1])
            if cell[m + 1] != k + 1:
                gap = np.inf
            jump = abs(speed[m + 1] - v)
            if stop[k + 1] == 1:
                jump = max(abs(v), abs(speed[m + 1]))
        if gap > worst[3]:
            worst[3] = gap
            where[3] = m
        if jump > worst[4]:
            worst[4] = jump
            where[4] = m
    return worst, where
