"""The C2 path of hats over a polyline.

The second derivative of a polyline in its own length is an impulse at every vertex: the step D of the
tangent. Replacing each impulse by a triangle ("hat") of unit area and half-width l gives a path

    q(u) = P(u) + sum_i D_i l_i (1 - |x|)^3 / 6,      x = (u - u_i) / l_i,  |x| < 1

whose second derivative is continuous. Hats may overlap. Its distance from P is at most the sum S of the
terms' sizes, which is convex between vertices: S at the vertices bounds it everywhere.

Lengths along the path are integers, in ticks: sums are exact, so nothing depends on where a chunk starts.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel

TICK = 2.0**-38  # mm or rad, 3.6e-12
COLLINEAR = 1e-12  # -, a smaller step of the tangent is rounding
LONGEST_BLEND = 20.0  # mm, half-width of the widest hat
LONGEST_BLEND_RATIO = 300.0  # -, the same over the tolerance
ROTARY_BLEND_TOLERANCE = 9e-4  # rad, deviation of a rotary axis by rounding
SAME_EDGE = 1e-6  # -, difference of edges that are equal
ROUNDS = 9  # of fitting the widths; the last is a guarantee
SHRINK = 0.999


@kernel
def edges(start, end, alone):
    """Ticks (n,) of the edges and their derivative by path parameter (n,d)."""
    n, d = start.shape
    ticks = np.zeros(n, np.int64)
    tangent = np.zeros((n, d))
    for k in range(n):
        square = 0.0
        low = 3 if alone[k] == 1 else 0
        high = d if alone[k] == 1 else 3
        for i in range(low, high):
            square += (end[k, i] - start[k, i]) ** 2
        rest = True
        for i in range(d):
            rest = rest and end[k, i] == start[k, i]
        if not rest:
            ticks[k] = max(1, int(np.rint(np.sqrt(square) / TICK)))
            for i in range(d):
                tangent[k, i] = (end[k, i] - start[k, i]) / (ticks[k] * TICK)
    return ticks, tangent


@kernel
def turns(tangent, stop):
    """Step of the tangent at the start of each edge: in XYZ (n,), and the largest of a rotary axis (n,)."""
    n, d = tangent.shape
    turn = np.zeros(n)
    twist = np.zeros(n)
    for k in range(1, n):
        if stop[k] == 1:
            continue
        square = 0.0
        for i in range(3):
            square += (tangent[k, i] - tangent[k - 1, i]) ** 2
        turn[k] = np.sqrt(square)
        for i in range(3, d):
            twist[k] = max(twist[k], abs(tangent[k, i] - tangent[k - 1, i]))
        if turn[k] < COLLINEAR:
            turn[k] = 0.0
        if twist[k] < COLLINEAR:
            twist[k] = 0.0
    return turn, twist


@kernel
def lipschitz(u, width):
    """Let neighbouring widths, in ticks, differ by half their distance at most.

    So the supports begin and end in the order of their vertices.
    """
    n = width.size
    for k in range(1, n):
        width[k] = min(width[k], width[k - 1] + ((u[k] - u[k - 1]) >> 1))
    for k in range(n - 2, -1, -1):
        width[k] = min(width[k], width[k + 1] + ((u[k + 1] - u[k]) >> 1))


@kernel
def first_widths(u, tolerance, turn, twist, stop):
    """Half-widths (n,) in ticks to start from: the widest of a corner by itself."""
    n = u.size
    width = np.zeros(n, np.int64)
    to_stop = np.int64(1) << 61
    for k in range(n):
        if stop[k] == 1:
            to_stop = 0
        elif k > 0:
            to_stop += u[k] - u[k - 1]
        width[k] = min(to_stop, np.int64(LONGEST_BLEND / TICK))
        if k == 0 or stop[k] == 1:
            continue
        budget = min(tolerance[k - 1], tolerance[k])
        length = min(LONGEST_BLEND, LONGEST_BLEND_RATIO * budget)
        if turn[k] > 0.0:
            half = min(1.0, 0.5 * turn[k])  # sin(theta/2)
            sine = 2.0 * half * np.sqrt(1.0 - half * half)
            alone = 6.0 * budget / sine if turn[k] <= 1.4142135623730951 and sine > 0.0 else 6.0 * budget
            shorter = u[k] - u[k - 1]
            if k + 1 < n:
                shorter = min(shorter, u[k + 1] - u[k])
            fits = 2.0 * alone <= shorter * TICK
            length = min(length, alone if fits else 3.0 * budget / half)
        if twist[k] > 0.0:
            length = min(length, 6.0 * ROTARY_BLEND_TOLERANCE / twist[k])
        width[k] = min(width[k], np.int64(length / TICK))
    to_stop = np.int64(1) << 61
    for k in range(n - 1, -1, -1):
        width[k] = min(width[k], to_stop)
        if stop[k] == 1:
            to_stop = 0
        if k > 0:
            to_stop += u[k] - u[k - 1]
    return width


@kernel
def in_step(u, width, stop):
    """Shorten widths, in ticks, to whole multiples of edges that are equal: on the polygon of an arc.

    Triangles that wide add up to a constant; any other width lets the curvature of an arc ripple.
    """
    for k in range(1, u.size - 1):
        edge = u[k] - u[k - 1]
        if stop[k] == 0 and width[k] >= edge and abs(u[k + 1] - u[k] - edge) <= SAME_EDGE * edge:
            width[k] -= width[k] % edge


@kernel
def widths(u, tolerance, turn, twist, stop):
    """Half-widths (n,) of the hats in ticks, such that the path stays within the edges' tolerances.

    Where the sizes of the hats that reach a vertex sum up to more than its tolerance, all of them shrink.
    A corner that no other hat reaches is measured across its edges and keeps its width. All rounds but the
    last shrink by half the excess in logarithms, because the other vertices shrink as well; the last one
    shrinks by all of it, which is enough by itself.
    """
    n = u.size
    width = first_widths(u, tolerance, turn, twist, stop)
    size = np.empty(n)
    swing = np.empty(n)
    others = np.empty(n, np.int64)
    factor = np.empty(n)
    for round_ in range(ROUNDS):
        segment = 0
        for k in range(1, n + 1):  # a stop neither takes nor gives a width
            if k == n or stop[k] == 1:
                lipschitz(u[segment + 1 : k], width[segment + 1 : k])
                segment = k
        size[:] = 0.0
        swing[:] = 0.0
        others[:] = 0
        for i in range(n):
            if width[i] == 0 or turn[i] + twist[i] == 0.0:
                continue
            length = width[i] * TICK
            size[i] += length * turn[i] / 6.0
            swing[i] += length * twist[i] / 6.0
            for side in (-1, 1):
                k = i + side
                while 0 <= k < n and abs(u[k] - u[i]) < width[i]:
                    y = 1.0 - abs(u[k] - u[i]) / width[i]
                    size[k] += length * turn[i] * y**3 / 6.0
                    swing[k] += length * twist[i] * y**3 / 6.0
                    others[k] += 1
                    k += side
        worst = 1.0
        for k in range(n):
            factor[k] = 1.0
            if k == 0 or stop[k] == 1:
                continue
            excess = swing[k] / ROTARY_BLEND_TOLERANCE
            if others[k] > 0:
                excess = max(excess, size[k] / min(tolerance[k - 1], tolerance[k]))
            if excess > 1.0 + 1e-9:
                factor[k] = SHRINK / (excess if round_ == ROUNDS - 1 else np.sqrt(excess))
                worst = max(worst, excess)
        if worst == 1.0:
            break
        for i in range(n):
            if width[i] == 0 or turn[i] + twist[i] == 0.0:
                continue
            least = factor[i]
            for side in (-1, 1):
                k = i + side
                while 0 <= k < n and abs(u[k] - u[i]) < width[i]:
                    least = min(least, factor[k])
                    k += side
            size[i] = least
        for i in range(n):
            if width[i] > 0 and turn[i] + twist[i] > 0.0 and size[i] < 1.0:
                width[i] = np.int64(width[i] * size[i])
    in_step(u, width, stop)
    segment = 0
    for k in range(1, n + 1):
        if k == n or stop[k] == 1:
            lipschitz(u[segment + 1 : k], width[segment + 1 : k])
            segment = k
    return width
