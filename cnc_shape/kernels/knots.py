# pyright: basic
"""A sampled motion as few straight pieces: where they meet."""

import numpy as np

from cnc_shape.kernels import kernel


@kernel
def slopes(origin, point, periods, directions, slope):
    """Slope along every direction (m,d) of the straight motion between two points (d,): into `slope` (m,)."""
    for m in range(directions.shape[0]):
        along = 0.0
        for a in range(point.size):
            along += directions[m, a] * (point[a] - origin[a])
        slope[m] = along / periods


@kernel
def find_knots(points, directions, slack, rest, origin, latest, low, high, first, seen, still):
    """Find the samples where straight pieces of constant speed have to meet.

    A piece starts on a sample and goes on as long as the straight motion from there to the newest sample
    passes every sample between them within `slack` along every direction. Each of those leaves a window
    of slopes to the motions that pass it; the windows only narrow, so one look at each sample is enough
    (the swinging door of data historians, Bristol 1990, one door a direction). A rest of `rest` periods or
    more is a piece of its own.

    points (n,d), the next samples; directions (m,d) unit vectors; slack (m,).
    State of the piece under way, changed in place: origin (d,) its first point; latest (d,) the newest one;
    low, high (m,) the slopes, per period, that it may still have. first: number of its first sample; seen:
    samples so far; still: periods without motion up to the newest sample.

    Returns the numbers (k,) of the samples that are knots, their points (k,d), and first, seen and still
    anew. The very first sample is a knot; the very last is not among them.
    """
    count, axes = points.shape
    numbers = np.empty(count + 1, dtype=np.int64)
    knots = np.empty((count + 1, axes))
    slope = np.empty(directions.shape[0])
    found = 0
    for row in range(count):
        if seen == 0:
            numbers[0] = 0
            knots[0] = points[0]
            found = 1
            origin[:] = latest[:] = points[0]
            low[:] = -np.inf
            high[:] = np.inf
            seen = 1
            continue
        moved = False
        for a in range(axes):
            moved = moved or points[row, a] != latest[a]
        begin = first
        if moved and still >= rest:
            begin = seen - 1  # a rest is over
        still = 0 if moved else still + 1
        if still >= rest:
            begin = max(first, seen - still)  # where the rest has begun
        slopes(origin, points[row], seen - first, directions, slope)
        if begin == first and still < rest:
            for m in range(slope.size):
                if slope[m] < low[m] or slope[m] > high[m]:
                    begin = seen - max(still, 1)  # not in the middle of a standstill
        if begin > first:
            numbers[found] = first = begin
            knots[found] = origin[:] = latest
            found += 1
            low[:] = -np.inf
            high[:] = np.inf
            slopes(origin, points[row], seen - first, directions, slope)
        for m in range(slope.size):
            low[m] = max(low[m], slope[m] - slack[m] / (seen - first))
            high[m] = min(high[m], slope[m] + slack[m] / (seen - first))
        latest[:] = points[row]
        seen += 1
    return numbers[:found].copy(), knots[:found].copy(), first, seen, still
