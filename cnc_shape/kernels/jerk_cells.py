"""What the planning of a stretch has to know of its cells, and what it has to look at in the end.

The speed along the path is ``|q'| v`` in XYZ. Its change, ``|q'| a + (q' . q'')/|q'| v^2``, has the form of
an axis's acceleration: where it is limited, the scans know one axis more, without a limit of jerk.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.jerk_caps import derivatives, straight_jerk
from cnc_shape.kernels.jerk_certificate import certificate
from cnc_shape.kernels.jerk_phases import moved

ANY_JERK = 1e30  # of the speed along the path
LOOKS = 17  # at the change of the speed in a piece


@kernel
def along_path(rows, s):
    """|q'| and (q' . q'')/|q'| of XYZ at the place `s` of a cell."""
    square = 0.0
    inner = 0.0
    for i in range(min(rows.shape[1], 3)):
        first = rows[1, i] + s * (2.0 * rows[2, i] + 3.0 * rows[3, i] * s)
        square += first * first
        inner += first * (2.0 * rows[2, i] + 6.0 * rows[3, i] * s)
    norm = np.sqrt(square)
    return norm, inner / norm if norm > 0.0 else 0.0


@kernel
def with_speed(rows, along, begin, size, first, bend, third):
    """The derivatives with those of one axis more, the speed along the path."""
    count, _, d = first.shape
    more_first = np.empty((count, 2, d + 1))
    more_bend = np.empty((count, 2, d + 1))
    more_third = np.zeros((count, d + 1))
    for k in range(count):
        for i in range(d):
            more_third[k, i] = third[k, i]
            for side in range(2):
                more_first[k, side, i] = first[k, side, i]
                more_bend[k, side, i] = bend[k, side, i]
        for side in range(2):
            norm, change = along_path(rows[begin + k], side * size[k])
            more_first[k, side, d] = norm / along[begin + k]
            more_bend[k, side, d] = change / along[begin + k]
    return more_first, more_bend, more_third


@kernel
def prepared(rows, length, limit_v2, straight, along, acceleration, jerk, begin, end):
    """Return what the scans need to know of the cells `begin` to `end`.

    Parameters
    ----------
    along (k,)
        Limit of the acceleration along each cell; (0,): none.

    Returns
    -------
    size (n,)
    first, bend (n,2,d), third (n,d)
    limits (2,d)
        Of acceleration and jerk.
    straight_a, straight_b (n,)
    """
    count = end - begin
    d = acceleration.size
    size = length[begin:end].copy()
    first = np.empty((count, 2, d))
    bend = np.empty((count, 2, d))
    third = np.empty((count, d))
    derivatives(rows[begin:end], size, first, bend, third)
    more = d + 1 if along.size > 0 else d
    limits = np.empty((2, more))
    for i in range(d):
        limits[0, i] = acceleration[i]
        limits[1, i] = jerk[i]
    if along.size > 0:
        limits[0, d] = 1.0
        limits[1, d] = ANY_JERK
        first, bend, third = with_speed(rows, along, begin, size, first, bend, third)
    straight_a = np.empty(count)
    straight_b = np.empty(count)
    straight_jerk(
        limit_v2[begin:end], straight[begin:end], first, bend, third, limits[1], straight_a, straight_b
    )
    return size, first, bend, third, limits, straight_a, straight_b


@kernel
def along_ratio(rows, along, s, v, a, b, t):
    """Largest ratio of the change of the speed along the path to its limit in a piece.

    Points beside the largest one tell by a parabola how much larger it is between them.
    """
    found = 0.0
    before = 0.0
    last = 0.0
    for n in range(LOOKS):
        e = t * n / (LOOKS - 1)
        here_v = v + e * (a + e * b / 2.0)
        norm, change = along_path(rows, s + moved(v, a, b, e))
        here = (norm * (a + e * b) + change * here_v * here_v) / along
        found = max(found, abs(here))
        if n > 1:
            bent = 2.0 * last - before - here
            slope = 0.5 * (here - before)
            if bent != 0.0 and abs(slope) < abs(bent):
                found = max(found, abs(last + 0.5 * slope * slope / bent))
        before = last
        last = here
    return found


@kernel
def looked_at(
    pieces, cell, first_piece, last_piece, straight_a, rows, begin, along, acceleration, jerk, tolerances,
    worst,
):  # fmt: skip
    """The certificate of pieces of a law (`jerk_certificate.certificate`), with that along the path."""
    certificate(
        pieces, cell, first_piece, last_piece, straight_a, rows, begin, acceleration, jerk, tolerances, worst
    )
    if along.size == 0:
        return
    for m in range(first_piece, last_piece):
        k = cell[m]
        if straight_a[k] > 0.0 or along[begin + k] == np.inf:
            continue
        ratio = along_ratio(
            rows[begin + k], along[begin + k], pieces[m, 2], pieces[m, 3], pieces[m, 4], pieces[m, 5],
            pieces[m, 1],
        )  # fmt: skip
        worst[k, 0] = max(worst[k, 0], ratio)
