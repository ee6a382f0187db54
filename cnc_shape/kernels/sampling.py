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
