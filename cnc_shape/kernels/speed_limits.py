"""How fast a cell of the path may be run through at all: velocity, feed, and curvature at its ends."""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel

STRAIGHT_TURN = 1e-9  # -, change of q' in a cell that is taken as straight
STRAIGHT_SHARE = 1e-7  # -, of the acceleration limit that the curvature of such a cell may use
FULL_SPEED = 0.98  # -, |q'| from which the feed itself is the limit: |q'| <= 1 up to rounding
ROUNDING = 2e-7  # -, of |q'|
STRAIGHT_ROUNDING = 1e-10  # -, the same on lines; more means a line so short that its own length counts
NEARLY = 0.98  # -, what a cell taken as straight keeps of its speed and acceleration at least
FASTEST_V2 = 1e12  # mm^2/s^2 or rad^2/s^2, where nothing else limits


@kernel
def ends(rows, h, d1, d2, e1, e2):
    """First and second derivatives by u at both ends of a cell: d1, d2 at its start, e1, e2 at its end."""
    for i in range(d1.size):
        d1[i] = rows[1, i]
        d2[i] = 2.0 * rows[2, i]
        e1[i] = rows[1, i] + h * (2.0 * rows[2, i] + 3.0 * h * rows[3, i])
        e2[i] = 2.0 * rows[2, i] + 6.0 * h * rows[3, i]


@kernel
def add_square(first, middle, last, square):
    """Add to `square` (5,) the Bernstein coefficients of the square of a quadratic with these three."""
    square[0] += first * first
    square[1] += first * middle
    square[2] += (2.0 * middle * middle + first * last) / 3.0
    square[3] += middle * last
    square[4] += last * last


@kernel
def largest_product(square, start, end):
    """Bound of `square` (5,) times the line from `start` to `end`, by its Bernstein coefficients."""
    most = 0.0
    for k in range(6):
        value = 0.0
        if k < 5:
            value += (5 - k) * start * square[k]
        if k > 0:
            value += k * end * square[k - 1]
        most = max(most, value / 5.0)
    return most


@kernel
def speed_limits(rows, length, feed_rate, alone, velocity, acceleration):
    """Squared speed limits and straight acceleration of every cell.

    An axis's velocity squared is ``q'^2 x`` with x linear: of degree 5. Limits at both ends are lowered
    together until its Bernstein coefficients, and those of the feed, are within their limits.

    Returns
    -------
    limit_v2 (k,2)
        From the axes' velocities and the feed, at both ends of the cell.
    straight (k,)
        Path acceleration on a straight cell; 0 on a curved one.
    """
    count = length.size
    d = velocity.size
    limit_v2 = np.empty((count, 2))
    straight = np.zeros(count)
    d1 = np.empty(d)
    d2 = np.empty(d)
    e1 = np.empty(d)
    e2 = np.empty(d)
    square = np.empty(5)
    path = np.empty(5)  # |q'|^2 of the axes that count for the feed
    for k in range(count):
        h = length[k]
        ends(rows[k], h, d1, d2, e1, e2)
        path[:] = 0.0
        curved = False
        start = FASTEST_V2
        end = FASTEST_V2
        for i in range(d):
            curved = curved or d2[i] != 0.0 or e2[i] != 0.0
            if (i < 3) != (alone[k] == 1):
                add_square(d1[i], d1[i] + 0.5 * h * d2[i], e1[i], path)
            if d1[i] != 0.0:
                start = min(start, (velocity[i] / d1[i]) ** 2)
            if e1[i] != 0.0:
                end = min(end, (velocity[i] / e1[i]) ** 2)
        stretch = np.sqrt(largest_product(path, 1.0, 1.0))
        feed_v2 = feed_rate[k] ** 2
        near = ROUNDING if curved else STRAIGHT_ROUNDING
        full = (FULL_SPEED if curved else 1.0 - near) < stretch <= 1.0 + near
        if full:
            start = min(start, feed_v2)
            end = min(end, feed_v2)
        else:
            if path[0] > 0.0:
                start = min(start, feed_v2 / path[0])
            if path[4] > 0.0:
                end = min(end, feed_v2 / path[4])
        if curved:
            excess = 1.0 if full else largest_product(path, start, end) / feed_v2
            for i in range(d):
                square[:] = 0.0
                add_square(d1[i], d1[i] + 0.5 * h * d2[i], e1[i], square)
                excess = max(excess, largest_product(square, start, end) / velocity[i] ** 2)
            if excess > 1.0:
                start /= excess
                end /= excess
        else:
            start = min(start, end)
            end = start
        limit_v2[k, 0] = start
        limit_v2[k, 1] = end
        is_straight = True
        rate = np.inf
        for i in range(d):
            bend = max(abs(d2[i]), abs(e2[i]))
            if bend > 0.0 and (
                bend * h > STRAIGHT_TURN or bend * max(start, end) > STRAIGHT_SHARE * acceleration[i]
            ):
                is_straight = False
            if abs(d1[i]) > 0.0:
                rate = min(rate, acceleration[i] / abs(d1[i]))
        if is_straight:
            straight[k] = rate
            limit_v2[k, 0] = min(start, end)
            limit_v2[k, 1] = limit_v2[k, 0]
    return limit_v2, straight


@kernel
def almost_straight(rows, length, limit_v2, straight, acceleration):
    """Take long, gently curved cells as straight: limits of their squared speed, and accelerations.

    A constant acceleration over all of a long cell would spread a short braking over it. Where both a rise
    and a fall have room in a cell, it may have three pieces like a straight one, if every axis keeps what the
    curvature asks for at full speed: ``|q'| a <= A - |q''| x``.
    """
    d = acceleration.size
    own_v2 = limit_v2.copy()
    own = straight.copy()
    d1 = np.empty(d)
    d2 = np.empty(d)
    e1 = np.empty(d)
    e2 = np.empty(d)
    for k in range(length.size):
        h = length[k]
        if straight[k] > 0.0 or h == 0.0:
            continue
        ends(rows[k], h, d1, d2, e1, e2)
        x = min(limit_v2[k, 0], limit_v2[k, 1])
        rate = np.inf
        without = np.inf
        for i in range(d):
            most = max(abs(d1[i]), abs(d1[i] + 0.5 * h * d2[i]), abs(e1[i]))
            if most > 0.0:
                rate = min(rate, (acceleration[i] - max(abs(d2[i]), abs(e2[i])) * x) / most)
                without = min(without, acceleration[i] / most)
        same = x >= NEARLY * max(limit_v2[k, 0], limit_v2[k, 1])
        if same and x <= rate * h and NEARLY * without <= rate < np.inf:
            own[k] = rate
            own_v2[k, 0] = x
            own_v2[k, 1] = x
    return own_v2, own
