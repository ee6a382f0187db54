# pyright: basic
"""What limits the motion along a path as a whole: chords between interpolation points, and acceleration.

Curvature. With ``q'`` quadratic in s, ``q' x q''`` is quadratic as well, so

    K^2 = |q' x q''|^2 / |q'|^6

is the quotient of N, of degree 4, and the cube of D, of degree 4. It is nowhere above K^2 on a stretch of the
cell if no Bernstein coefficient of ``N - K^2 D^3`` is positive; halving the stretches finds the maximum
between the ends, too.

Acceleration. The speed along the path changes by ``q' . (q' a + q'' x) / |q'|``. That is within +-A where

    |q' . (q' a + q'' (x0 + 2 a s))|  <=  A t . q'      for a unit vector t, because t . q' <= |q'|

Both sides are polynomials of degree 4, so five inequalities linear in (a, x0) suffice. t is the direction
half-way between the ends of the cell: what a cell that turns by w loses is 1 - cos(w/2) at most.
"""

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.speed_limits import add_square

ALONG_ROWS = 5  # Bernstein coefficients of the acceleration along the path, of degree 4
CURVATURE_SHARE = 1e-6  # -, of the squared curvature, by which a bound may exceed what was found
MOST_HALVINGS = 40
FOUR = (1.0, 4.0, 6.0, 4.0, 1.0)  # binomials
EIGHT = (1.0, 8.0, 28.0, 56.0, 70.0, 56.0, 28.0, 8.0, 1.0)
MOST_STRETCHES = 1000  # looked at in one cell, from which their bounds are taken as they are
LEAST_SHARE = 0.1  # -, of the largest |q'|: where t . q' is less, the cell turns too far for one direction


@kernel
def chord_speed(curvature, period, error):
    """Highest speed at which a chord of one period is off an arc of this curvature by at most `error`.

    ``v <= (2/T) sqrt(rho^2 - (rho - h)^2)``; where rho <= h, a chord of 2 h: no point of the path between its
    ends is farther than h from both of them along the path.
    """
    if curvature * error >= 1.0:
        return 2.0 * error / period
    if curvature == 0.0:
        return np.inf
    return 2.0 / period * np.sqrt(2.0 * error / curvature - error * error)


@kernel
def chord_curvature(speed, period, error):
    """Largest curvature at which `speed` is allowed; the inverse of `chord_speed`."""
    half = 0.5 * speed * period
    if half <= error:
        return np.inf
    return 2.0 * error / (half * half + error * error)


@kernel
def bernstein(powers, start, width, out):
    """Bernstein coefficients of a polynomial of degree 4 on [start, start + width], into `out` (5,)."""
    p0, p1, p2, p3, p4 = powers[0], powers[1], powers[2], powers[3], powers[4]
    a0 = p0 + start * (p1 + start * (p2 + start * (p3 + start * p4)))
    a1 = (p1 + start * (2.0 * p2 + start * (3.0 * p3 + start * 4.0 * p4))) * width
    a2 = (p2 + start * (3.0 * p3 + start * 6.0 * p4)) * width**2
    a3 = (p3 + start * 4.0 * p4) * width**3
    a4 = p4 * width**4
    out[0] = a0
    out[1] = a0 + a1 / 4.0
    out[2] = a0 + a1 / 2.0 + a2 / 6.0
    out[3] = a0 + 3.0 * a1 / 4.0 + a2 / 2.0 + a3 / 4.0
    out[4] = a0 + a1 + a2 + a3 + a4


@kernel
def square_of_quadratic(c0, c1, c2, powers):
    """Add the powers of ``(c0 + c1 s + c2 s^2)^2`` to `powers` (5,)."""
    powers[0] += c0 * c0
    powers[1] += 2.0 * c0 * c1
    powers[2] += c1 * c1 + 2.0 * c0 * c2
    powers[3] += 2.0 * c1 * c2
    powers[4] += c2 * c2


@kernel
def nowhere_above(top, bottom, level):
    """Whether ``N <= level D^3`` by the Bernstein coefficients (5,) of N and D.

    With their binomials multiplied in, coefficients of products are sums over pairs.
    """
    plain = np.zeros(13)
    cube = np.zeros(13)
    for i in range(5):
        for j in range(9):
            plain[i + j] += FOUR[i] * top[i] * EIGHT[j]
        for j in range(5):
            pair = FOUR[i] * bottom[i] * FOUR[j] * bottom[j]
            for n in range(5):
                cube[i + j + n] += pair * FOUR[n] * bottom[n]
    highest = -np.inf
    for r in range(13):
        highest = max(highest, plain[r] - level * cube[r])
    return highest <= 0.0


@kernel
def largest_curvature(rows, h, enough):
    """Largest squared curvature of XYZ in a cell; if that is no more than `enough`, any value up to it."""
    d = min(rows.shape[1], 3)
    above = np.zeros(5)
    below = np.zeros(5)
    for i in range(d):
        square_of_quadratic(rows[1, i], 2.0 * rows[2, i], 3.0 * rows[3, i], below)
        for j in range(i):
            square_of_quadratic(
                2.0 * (rows[1, i] * rows[2, j] - rows[1, j] * rows[2, i]),
                6.0 * (rows[1, i] * rows[3, j] - rows[1, j] * rows[3, i]),
                6.0 * (rows[2, i] * rows[3, j] - rows[2, j] * rows[3, i]),
                above,
            )
    start = np.zeros(MOST_HALVINGS + 2)
    depth = np.zeros(MOST_HALVINGS + 2, np.int64)
    top = np.empty(5)
    bottom = np.empty(5)
    waiting = 1
    looked = 0
    found = 0.0
    bound = 0.0
    while waiting > 0:
        waiting -= 1
        looked += 1
        at = start[waiting]
        level = depth[waiting]
        width = h * 0.5**level
        bernstein(above, at, width, top)
        bernstein(below, at, width, bottom)
        for end in (0, 4):
            if bottom[end] > 0.0:
                found = max(found, top[end] / bottom[end] ** 3)
        if nowhere_above(top, bottom, max(found * (1.0 + CURVATURE_SHARE), enough)):
            continue
        if level == MOST_HALVINGS or looked > MOST_STRETCHES:
            least = bottom.min()
            bound = max(bound, top.max() / least**3 if least > 0.0 else np.inf)
            continue
        for half in range(2):
            start[waiting] = at + half * 0.5 * width
            depth[waiting] = level + 1
            waiting += 1
    return max(found * (1.0 + CURVATURE_SHARE), bound)


@kernel
def chord_speeds(rows, length, feed_rate, alone, period, error):
    """Feed rates (k,) at which no cell's tightest curve makes a chord err by more than `error`."""
    lowered = feed_rate.copy()
    for k in range(length.size):
        if alone[k] == 1 or length[k] == 0.0:
            continue
        enough = chord_curvature(feed_rate[k], period, error)
        if enough == np.inf:
            continue
        square = largest_curvature(rows[k], length[k], enough * enough)
        lowered[k] = min(feed_rate[k], chord_speed(np.sqrt(square), period, error))
    return lowered


@kernel
def straight_along(rows, straight, along):
    """Path acceleration (k,) on straight cells that keeps `along` as well; 0 on curved ones, as before."""
    slower = straight.copy()
    for k in range(straight.size):
        square = 0.0
        for i in range(min(rows.shape[2], 3)):
            square += rows[k, 1, i] ** 2
        if straight[k] > 0.0 and square > 0.0:
            slower[k] = min(straight[k], along[k] / np.sqrt(square))
    return slower


@kernel
def along_bounds(h, d1, d2, e1, e2, limit, first, base, slope):
    """Rows ``|p a + s x| <= 1`` of the acceleration along a curved cell: 1/p and s from place `first` on.

    A cell that turns too far for one direction keeps half of `limit` each for ``|q'| |a|`` and ``|q''| x``.
    """
    d = min(d1.size, 3)
    square = np.zeros(5)  # q' . q'
    product = np.zeros(4)  # q' . q''
    share = np.zeros(3)  # t . q'
    norm = 0.0
    for i in range(d):
        norm += (d1[i] + e1[i]) ** 2
    norm = np.sqrt(norm)
    start = 0.0
    end = 0.0
    for i in range(d):
        middle = d1[i] + 0.5 * h * d2[i]
        add_square(d1[i], middle, e1[i], square)
        product[0] += d1[i] * d2[i]
        product[1] += (2.0 * middle * d2[i] + d1[i] * e2[i]) / 3.0
        product[2] += (e1[i] * d2[i] + 2.0 * middle * e2[i]) / 3.0
        product[3] += e1[i] * e2[i]
        if norm > 0.0:
            t = (d1[i] + e1[i]) / norm
            share[0] += t * d1[i]
            share[1] += t * middle
            share[2] += t * e1[i]
        start += d2[i] ** 2
        end += e2[i] ** 2
    bend = np.sqrt(max(start, end))
    stretch = np.sqrt(square.max())
    if share.min() < LEAST_SHARE * stretch:
        base[first] = 0.5 * limit / stretch
        slope[first] = 0.0
        base[first + 1] = np.inf
        slope[first + 1] = 2.0 * bend / limit
        base[first + 2] = 0.5 * limit / (2.0 * h * bend)
        slope[first + 2] = 2.0 * bend / limit
        for r in range(3, ALONG_ROWS):
            base[first + r] = np.inf
            slope[first + r] = 0.0
        return
    for r in range(ALONG_ROWS):
        before = r / 4.0 * product[r - 1] if r > 0 else 0.0
        after = (1.0 - r / 4.0) * product[r] if r < 4 else 0.0
        if r == 2:
            room = (share[0] + 4.0 * share[1] + share[2]) / 6.0
        elif r % 2 == 1:
            room = 0.5 * (share[r // 2] + share[r // 2 + 1])
        else:
            room = share[r // 2]
        base[first + r] = limit * room / (square[r] + 2.0 * h * before)
        slope[first + r] = (before + after) / (limit * room)


@kernel
def path_excesses(
    duration, u, speed, path_acceleration, jerk, cell, rows, alone, along, period, error, points
):
    """Largest ratios of the acceleration along the path, and of its speed, to `along` and to the chord speed.

    Evaluates `points` points of every piece. A `period` of 0: chords are not limited.

    Returns
    -------
    worst (2,)
    where (2,)
        Pieces.
    """
    worst = np.zeros(2)
    where = np.zeros(2, np.int64)
    d = min(rows.shape[2], 3)
    first = np.zeros(3)
    second = np.zeros(3)
    for m in range(duration.size):
        k = cell[m]
        if alone[k] == 1:
            continue
        for n in range(points):
            e = duration[m] * n / (points - 1)
            s = u[m] + e * (speed[m] + e * (path_acceleration[m] / 2.0 + e * jerk[m] / 6.0))
            v = speed[m] + e * (path_acceleration[m] + e * jerk[m] / 2.0)
            a = path_acceleration[m] + e * jerk[m]
            square = 0.0
            inner = 0.0
            for i in range(d):
                first[i] = rows[k, 1, i] + s * (2.0 * rows[k, 2, i] + 3.0 * rows[k, 3, i] * s)
                second[i] = 2.0 * rows[k, 2, i] + 6.0 * rows[k, 3, i] * s
                square += first[i] ** 2
                inner += first[i] * second[i]
            if square == 0.0:
                continue
            norm = np.sqrt(square)
            ratio = abs(norm * a + inner / norm * v * v) / along
            if ratio > worst[0]:
                worst[0] = ratio
                where[0] = m
            if period == 0.0:
                continue
            cross = (first[1] * second[2] - first[2] * second[1]) ** 2
            cross += (first[2] * second[0] - first[0] * second[2]) ** 2
            cross += (first[0] * second[1] - first[1] * second[0]) ** 2
            ratio = norm * abs(v) / chord_speed(np.sqrt(cross) / norm**3, period, error)
            if ratio > worst[1]:
                worst[1] = ratio
                where[1] = m
    return worst, where
