"""Laws for stretches that the scans find none for: from rest to rest, slower than need be.

Between two rests any law can be run through slower as a whole: with velocities times s, accelerations
times s^2, jerks times s^3. So a law that pays no heed to curvature, the seven phases of a straight, need only
be slowed until the certificate is content.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.jerk_cells import looked_at, prepared
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
    first = np.int64(0)
    put(law, cell, first, ramp, 0.0, 0.0, 0.0, b, first)
    put(law, cell, first + 1, hold, place, low, high, 0.0, first)
    put(law, cell, first + 2, ramp, later, top - low, high, -b, first)
    put(law, cell, first + 3, cruise / top, half, top, 0.0, 0.0, first)
    put(law, cell, first + 4, ramp, distance - half, top, 0.0, -b, first)
    put(law, cell, first + 5, hold, distance - later, top - low, -high, 0.0, first)
    put(law, cell, first + 6, ramp, distance - place, low, -high, b, first)
    return PHASES


@kernel
def slow_law(rows, length, limit_v2, straight, along, acceleration, jerk, begin, end, tolerances):
    """Pieces of a law of the cells `begin` to `end` from rest to rest, their cells counted from `begin`."""
    count = end - begin
    size, first, _, _, limits, straight_a, _ = prepared(
        rows, length, limit_v2, straight, along, acceleration, jerk, begin, end
    )
    v = np.inf
    a = np.inf
    b = np.inf
    nodes = np.zeros(count + 1)
    for k in range(count):
        nodes[k + 1] = nodes[k] + size[k]
        v = min(v, np.sqrt(min(limit_v2[begin + k, 0], limit_v2[begin + k, 1])))
        for i in range(first.shape[2]):
            rate = max(abs(first[k, 0, i]), abs(first[k, 1, i]))
            if rate > 0.0:
                a = min(a, limits[0, i] / rate)
                b = min(b, limits[1, i] / rate)
    law = np.empty((PHASES, 5))
    law_cell = np.empty(PHASES, np.int64)
    w = straight_phases(nodes[count], v, a, b, law, law_cell)
    pieces = np.empty((PHASES + 2 * count + 1, 6))
    cell = np.empty(PHASES + 2 * count + 1, np.int64)
    none = np.int64(0)
    m = cut(law, law_cell, w, nodes, none, pieces, cell)
    worst = np.zeros((count, 5))
    looked_at(pieces, cell, none, m, straight_a, rows, begin, along, acceleration, jerk, tolerances, worst)
    share = 1.0
    for k in range(count):
        share = min(share, 1.0 / np.sqrt(max(1.0, worst[k, 0])))
        share = min(share, 1.0 / np.cbrt(max(1.0, max(worst[k, 1], max(worst[k, 2], worst[k, 3])))))
    if share < 1.0:
        share *= 1.0 - SLACK
    for n in range(m):
        pieces[n, 1] /= share
        pieces[n, 3] *= share
        pieces[n, 4] *= share * share
        pieces[n, 5] *= share * share * share
    return pieces[:m], cell[:m]
