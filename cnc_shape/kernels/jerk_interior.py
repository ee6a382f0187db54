"""The fastest law through the cells of a window, by a primal-dual interior-point method.

In x = v^2 over the place u on the path, acceleration along the path is x'/2 and jerk v x''/2. With x a
quadratic spline in u, the rows of an axis at a place are linear in three neighbouring coefficients c but for
the bound J/v:

    |q' x'/2 + q'' x| <= A,     |q' x''/2 + 3/2 q'' x' + q''' x| <= J / sqrt(x),     x <= X

Each becomes an equation with a slack s > 0 and a multiplier z > 0. A Newton step on the equations of the
optimum with s z = (some share of its mean) takes one factorisation of a matrix of five diagonals, because no
row reaches further than three coefficients: all is linear in the number of nodes. The law it starts from
need not keep the limits.

References
----------
.. [1] S. J. Wright, Primal-Dual Interior-Point Methods, SIAM, 1997.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel

POINTS = 4  # of a segment: its ends, and its node seen from both cells
LEAST_SLACK = 0.2  # -, of a limit, to start with
FIRST_GAP = 0.1  # -, of the time that the multipliers stand for at first
NEARER = 0.3  # -, of both, from coefficients that are good but for some rows
TO_BORDER = 0.99  # -, of the way to the nearest slack or multiplier of 0
SMALL_GAP = 2e-3  # -, of the time: as good as the fastest
KEPT = 2e-5  # -, by which limits may be exceeded then
MOST_ITERATIONS = 40


@kernel
def solved(diagonal, first, second, right):
    """Solve a symmetric system of five diagonals into `right`, all in place: whether it is definite."""
    n = diagonal.size
    for k in range(n):
        pivot = diagonal[k]
        if not pivot > 0.0:
            return False
        if k + 1 < n:
            near = first[k] / pivot
            far = second[k] / pivot if k + 2 < n else 0.0
            diagonal[k + 1] -= near * first[k]
            right[k + 1] -= near * right[k]
            if k + 2 < n:
                first[k + 1] -= near * second[k]
                diagonal[k + 2] -= far * second[k]
                right[k + 2] -= far * right[k]
            first[k] = near
            second[k] = far
        right[k] /= pivot
    for k in range(n - 2, -1, -1):
        right[k] -= first[k] * right[k + 1]
        if k + 2 < n:
            right[k] -= second[k] * right[k + 2]
    return True


@kernel
def begun(c, border, value, rows, cap, room, near, share, slack, price):
    """First slacks, multipliers and shares of the bounds J/v; returns their mean product, number, the time.

    Rows of zeros and those of a place that a neighbour has as well keep a slack of 0: they are no rows.
    """
    least = near * LEAST_SLACK
    time = 0.0
    count = 0
    for s in range(cap.shape[0]):
        for p in range(POINTS):
            x = value[s, p, 0] * c[s] + value[s, p, 1] * c[s + 1] + value[s, p, 2] * c[s + 2]
            share[s, p] = np.sqrt(x)
            if p == 0 or p == POINTS - 1:
                time += 0.5 * (border[s + 1] - border[s]) / share[s, p]
            for j in range(slack.shape[2]):
                slack[s, p, j] = 0.0
            if p > 0 or s == 0:
                slack[s, p, 0] = max(1.0 - x / cap[s, p], least)
                count += 1
            for j in range(rows.shape[2]):
                r = rows[s, p, j]
                if r[0] == 0.0 and r[1] == 0.0 and r[2] == 0.0:
                    continue
                load = r[0] * c[s] + r[1] * c[s + 1] + r[2] * c[s + 2]
                if 2 * j >= rows.shape[2]:
                    load *= share[s, p]
                slack[s, p, 1 + 2 * j] = max(room[s, j] - load, least)
                slack[s, p, 2 + 2 * j] = max(room[s, j] + load, least)
                count += 2
    mean = near * FIRST_GAP * time / count
    for s in range(cap.shape[0]):
        for p in range(POINTS):
            for j in range(slack.shape[2]):
                if slack[s, p, j] > 0.0:
                    price[s, p, j] = mean / slack[s, p, j]
    return mean, count, time


@kernel
def interior(c, border, value, rows, cap, room, near, share, slack, price, more_slack, more_price):
    """Bring coefficients to those of the fastest law that keeps the rows; returns whether that was reached.

    Parameters
    ----------
    c (n+2,)
        Coefficients of x, changed in place but for the first and last two.
    border (n+1,)
        Places between the segments of the spline.
    value (n,4,3)
        Coefficients of x at the points of each segment.
    rows (n,4,2 d,3)
        Those of acceleration, and of jerk over v, over their limits.
    cap (n,4)
        Highest x.
    room (n,2 d)
        Shares of the limits that may be used.
    near
        How far from the fastest law the coefficients are: 1, or `NEARER`.
    share (n,4), slack, price, more_slack, more_price (n,4,1+4 d)
        Scratch.
    """
    n = cap.shape[0]
    axes = rows.shape[2] // 2
    diagonal = np.empty(n + 2)
    first = np.empty(n + 2)
    second = np.empty(n + 2)
    step = np.empty(n + 2)
    mean, count, time = begun(c, border, value, rows, cap, room, near, share, slack, price)
    centring = 0.2
    for _ in range(MOST_ITERATIONS):
        diagonal[:] = 0.0
        first[:] = 0.0
        second[:] = 0.0
        step[:] = 0.0
        target = centring * mean
        worst = 0.0
        for s in range(n):
            h00 = h01 = h02 = h11 = h12 = h22 = 0.0
            g0 = g1 = g2 = 0.0
            c0 = c[s]
            c1 = c[s + 1]
            c2 = c[s + 2]
            for p in range(POINTS):
                x0 = value[s, p, 0]
                x1 = value[s, p, 1]
                x2 = value[s, p, 2]
                x = x0 * c0 + x1 * c1 + x2 * c2
                slowness = 1.0 / np.sqrt(x)
                pull = 0.0
                bend = 0.0
                if p == 0 or p == POINTS - 1:
                    whole = 0.25 * (border[s + 1] - border[s]) * slowness / x
                    pull = whole
                    bend = 1.5 * whole / x
                if slack[s, p, 0] > 0.0:
                    over = 1.0 / cap[s, p]
                    inverse = 1.0 / slack[s, p, 0]
                    stiff = price[s, p, 0] * inverse
                    pull -= over * (target * inverse - stiff * (1.0 - x * over - slack[s, p, 0]))
                    bend += stiff * over * over
                    worst = max(worst, x * over - 1.0)
                g0 += pull * x0
                g1 += pull * x1
                g2 += pull * x2
                h00 += bend * x0 * x0
                h01 += bend * x0 * x1
                h02 += bend * x0 * x2
                h11 += bend * x1 * x1
                h12 += bend * x1 * x2
                h22 += bend * x2 * x2
                for j in range(2 * axes):
                    if slack[s, p, 1 + 2 * j] == 0.0:
                        continue
                    r0 = rows[s, p, j, 0]
                    r1 = rows[s, p, j, 1]
                    r2 = rows[s, p, j, 2]
                    load = r0 * c0 + r1 * c1 + r2 * c2
                    bound = room[s, j]
                    fall = 0.0
                    if j >= axes:
                        r0 *= share[s, p]
                        r1 *= share[s, p]
                        r2 *= share[s, p]
                        load *= share[s, p]
                        bound *= share[s, p] * slowness
                        fall = -0.5 * bound / x
                    worst = max(worst, abs(load) - bound)
                    for side in range(2):
                        sign = 1.0 - 2.0 * side
                        own = slack[s, p, 1 + 2 * j + side]
                        inverse = 1.0 / own
                        stiff = price[s, p, 1 + 2 * j + side] * inverse
                        pull = target * inverse - stiff * (bound - sign * load - own)
                        k0 = fall * x0 - sign * r0
                        k1 = fall * x1 - sign * r1
                        k2 = fall * x2 - sign * r2
                        g0 += pull * k0
                        g1 += pull * k1
                        g2 += pull * k2
                        h00 += stiff * k0 * k0
                        h01 += stiff * k0 * k1
                        h02 += stiff * k0 * k2
                        h11 += stiff * k1 * k1
                        h12 += stiff * k1 * k2
                        h22 += stiff * k2 * k2
            diagonal[s] += h00
            diagonal[s + 1] += h11
            diagonal[s + 2] += h22
            first[s] += h01
            first[s + 1] += h12
            second[s] += h02
            step[s] += g0
            step[s + 1] += g1
            step[s + 2] += g2
        if worst <= KEPT and mean * count <= SMALL_GAP * time:
            return True
        step[0] = step[1] = step[n] = step[n + 1] = 0.0
        if not solved(diagonal[2:n], first[2:n], second[2:n], step[2:n]):
            return False
        primal = 1.0
        dual = 1.0
        for s in range(n):
            c0 = c[s]
            c1 = c[s + 1]
            c2 = c[s + 2]
            d0 = step[s]
            d1 = step[s + 1]
            d2 = step[s + 2]
            if d1 < 0.0:
                primal = min(primal, -0.6 * c1 / d1)
            for p in range(POINTS):
                x = value[s, p, 0] * c0 + value[s, p, 1] * c1 + value[s, p, 2] * c2
                dx = value[s, p, 0] * d0 + value[s, p, 1] * d1 + value[s, p, 2] * d2
                if dx < 0.0:
                    primal = min(primal, -0.7 * x / dx)
                slowness = 1.0 / np.sqrt(x)
                for j in range(1 + 4 * axes):
                    own = slack[s, p, j]
                    if own == 0.0:
                        continue
                    if j == 0:
                        change = 1.0 - (x + dx) / cap[s, p] - own
                    else:
                        row = (j - 1) // 2
                        sign = 1.0 - 2.0 * ((j - 1) % 2)
                        load = rows[s, p, row, 0] * (c0 + d0) + rows[s, p, row, 1] * (c1 + d1)
                        load += rows[s, p, row, 2] * (c2 + d2)
                        bound = room[s, row]
                        if row >= axes:
                            load *= share[s, p]
                            bound *= share[s, p] * slowness * (1.0 - 0.5 * dx / x)
                        change = bound - sign * load - own
                    more = (target - price[s, p, j] * change) / own - price[s, p, j]
                    more_slack[s, p, j] = change
                    more_price[s, p, j] = more
                    if change < 0.0:
                        primal = min(primal, -TO_BORDER * own / change)
                    if more < 0.0:
                        dual = min(dual, -TO_BORDER * price[s, p, j] / more)
        gap = 0.0
        for s in range(n):
            for p in range(POINTS):
                for j in range(1 + 4 * axes):
                    if slack[s, p, j] > 0.0:
                        slack[s, p, j] += primal * more_slack[s, p, j]
                        price[s, p, j] += dual * more_price[s, p, j]
                        gap += slack[s, p, j] * price[s, p, j]
        for k in range(2, n):
            c[k] += primal * step[k]
        mean = gap / count
        least = min(primal, dual)
        centring = 0.1 if least > 0.9 else (0.2 if least > 0.5 else (0.4 if least > 0.2 else 0.7))
    return False
