"""Laws for stretches that the scans find none for: from rest to rest, slower than need be.

Between two rests any law can be run through slower as a whole: with velocities times s, accelerations
times s^2, jerks times s^3. So a law that pays no heed to curvature, the seven phases of a straight, need only
be slowed until the certificate is content.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.jerk_caps import derivatives, straight_jerk
from cnc_shape.kernels.jerk_certificate import certificate
from cnc_shape.kernels.jerk_phases import put
from cnc_shape.kernels.jerk_pieces import cut

PHASES = 7
SLACK = 1e-9  # -, by which it is slower than the certificate asks for


@kernel
def straight_phases(distance, v, a, b, law, cell):
    """Phases from rest to rest on a straight of the cells' total length; returns how many (at most 7)."""
    ramp = a / b if v * b >= a * a else np.sqrt(v / b)
    hold = v / (b * ramp) - ramp
    if v * (2.0 * ramp + hold) > distance:
        ramp = a / b
        if distance >= 2.0 * b * ramp**3:
            top = 0.5 * (-a * ramp + np.sqrt((a * ramp) ** 2 + 4.0 * a * distance))
            hold = top / a - ramp
        else:
            ramp = np.cbrt(0.5 * distance / b)
            hold = 0.0
    hold = max(hold, 0.0)
    high = b * ramp
    top = high * (ramp + hold)
    low = 0.5 * high * ramp
    half = top * (ramp + 0.5 * hold)
    place = b * ramp**3 / 6.0
    later = half - (top * ramp - place)
    cruise = max(distance - 2.0 * half, 0.0)
    put(law, cell, 0, ramp, 0.0, 0.0, 0.0, b, 0)
    put(law, cell, 1, hold, place, low, high, 0.0, 0)
    put(law, cell, 2, ramp, later, top - low, high, -b, 0)
    put(law, cell, 3, cruise / top, half, top, 0.0, 0.0, 0)
    put(law, cell, 4, ramp, distance - half, top, 0.0, -b, 0)
    put(law, cell, 5, hold, distance - later, top - low, -high, 0.0, 0)
    put(law, cell, 6, ramp, distance - place, low, -high, b, 0)
    return PHASES


@kernel
def slow_law(
    rows, length, feed_rate, alone, limit_v2, straight, velocity, acceleration, jerk, begin, end, tolerances
):  # fmt: skip
    """Pieces of a law of the cells `begin` to `end` from rest to rest, and their cells counted from `begin`."""
    count = end - begin
    d = acceleration.size
    size = length[begin:end].copy()
    first = np.empty((count, 2, d))
    bend = np.empty((count, 2, d))
    third = np.empty((count, d))
    derivatives(rows[begin:end], size, first, bend, third)
    straight_a = np.empty(count)
    straight_b = np.empty(count)
    limits = limit_v2[begin:end]
    straight_jerk(limits, straight[begin:end], first, bend, third, jerk, straight_a, straight_b)
    v = np.inf
    a = np.inf
    b = np.inf
    nodes = np.zeros(count + 1)
    for k in range(count):
        nodes[k + 1] = nodes[k] + size[k]
        v = min(v, np.sqrt(min(limits[k, 0], limits[k, 1])))
        for i in range(d):
            rate = max(abs(first[k, 0, i]), abs(first[k, 1, i]))
            if rate > 0.0:
                a = min(a, acceleration[i] / rate)
                b = min(b, jerk[i] / rate)
    law = np.empty((PHASES, 5))
    law_cell = np.empty(PHASES, np.int64)
    w = straight_phases(nodes[count], v, a, b, law, law_cell)
    pieces = np.empty((PHASES + 2 * count + 1, 6))
    cell = np.empty(PHASES + 2 * count + 1, np.int64)
    m = cut(law, law_cell, w, nodes, 0, pieces, cell)
    worst = np.zeros((count, 7))
    certificate(
        pieces, cell, 0, m, straight_a, rows, begin, feed_rate, alone, velocity, acceleration, jerk,
        tolerances, worst,
    )  # fmt: skip
    share = 1.0
    for k in range(count):
        share = min(share, 1.0 / max(1.0, max(worst[k, 0], worst[k, 2])))
        share = min(share, 1.0 / np.sqrt(max(1.0, worst[k, 1])))
        share = min(share, 1.0 / np.cbrt(max(1.0, max(worst[k, 3], max(worst[k, 4], worst[k, 5])))))
    if share < 1.0:
        share *= 1.0 - SLACK
    for n in range(m):
        pieces[n, 1] /= share
        pieces[n, 3] *= share
        pieces[n, 4] *= share * share
        pieces[n, 5] *= share * share * share
    return pieces[:m], cell[:m]
