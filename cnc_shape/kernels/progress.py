# pyright: basic
"""A path at given values of its parameter: axes, and the place on the toolpath."""

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.sampling import point


@kernel
def along_path(travelled, speed, acceleration, start, length, rows, arc_length, stretch):
    """Position, velocity and acceleration of the axes where the path parameter is `travelled`.

    travelled, speed, acceleration (n,): parameter over the whole path and its derivatives; cells: start (k,)
    of each in that parameter, increasing, length (k,), rows (k,4,d), arc_length and stretch (k,). Beyond
    both ends the path rests.

    Returns
    -------
    place (n,), position, velocity, acceleration (n,d)
    """
    n, cells, d = travelled.size, start.size, rows.shape[2]
    place = np.empty(n)
    position, velocity, pushed = np.empty((n, d)), np.empty((n, d)), np.empty((n, d))
    k = 0
    for j in range(n):
        u = travelled[j]
        while k + 1 < cells and start[k + 1] <= u:
            k += 1
        while k > 0 and start[k] > u:
            k -= 1
        s, v, a = u - start[k], speed[j], acceleration[j]
        if s < 0.0 or s > length[k]:
            s, v, a = min(max(s, 0.0), length[k]), 0.0, 0.0
        point(rows[k], s, v, a, position[j], velocity[j], pushed[j])
        place[j] = arc_length[k] + stretch[k] * s
    return place, position, velocity, pushed
