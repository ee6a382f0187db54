"""What a time law asks of the axes, folded into buckets of time and of path as its pieces come.

A bucket holds the largest of every quantity that was seen in it, so the largest of two neighbouring buckets
is that of both, and buckets can be widened without what they were made from. A row of a bucket, 4 + 3 d
columns: speed of the tool in XYZ, the same with its sign turned, feed rate; how far along the path the motion
is, or in buckets of path, at what time; then velocity, acceleration and jerk, each without its sign, axis by
axis.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.jerk_certificate import axis_motion
from cnc_shape.kernels.jerk_phases import moved

POINTS = 9  # of every piece at least, as many as the certificate looks at
SPREAD = 1.25  # -, by which the speed between two points may exceed that at them
TIE = 1e-9  # -, two uses that differ by less are the same, and the first line has it
APART = 0.25  # mm of path between points that are drawn
MOST_DRAWN = 8  # of a piece


@kernel
def point_use(c, s, v, a, b, alone, feed_rate, row):
    """Fill the row of a point but for time and place; return the speed that the feed rate limits.

    c (4,d): the cell's coefficients; s, v, a, b: path parameter and its derivatives; alone: 1 where rotary
    axes move alone, which have no speed in XYZ, and whose feed rate is none of it.
    """
    axes = c.shape[1]
    tool = 0.0
    turning = 0.0
    for i in range(axes):
        moving, pushed, jerked = axis_motion(c, i, s, v, a, b)
        if i < 3:
            tool += moving * moving
        else:
            turning += moving * moving
        row[4 + i] = abs(moving)
        row[4 + axes + i] = abs(pushed)
        row[4 + 2 * axes + i] = abs(jerked)
    speed = np.sqrt(tool)
    row[0] = speed
    row[1] = -speed
    row[2] = -np.inf if alone == 1 else feed_rate
    return np.sqrt(turning) if alone == 1 else speed


@kernel
def widen(buckets, width, end):
    """Join neighbouring buckets, in place, until `end` lies in one; return their width."""
    half = buckets.shape[0] // 2
    while end >= width * buckets.shape[0]:
        for n in range(half):
            for j in range(buckets.shape[1]):
                buckets[n, j] = max(buckets[2 * n, j], buckets[2 * n + 1, j])
        buckets[half:] = -np.inf
        width *= 2.0
    return width


@kernel
def fold(row, reached, buckets, bucket):
    """Raise a bucket to a row that has `reached` so far; the last takes what rounding puts beyond it."""
    bucket = min(bucket, buckets.shape[0] - 1)
    row[3] = reached
    for j in range(row.size):
        if row[j] > buckets[bucket, j]:
            buckets[bucket, j] = row[j]


@kernel
def fold_pieces(
    time,
    duration,
    u,
    speed,
    path_acceleration,
    path_jerk,
    cell,
    rows,
    feed_rate,
    alone,
    arc_length,
    stretch,
    line,
    widths,
    over_time,
    along_path,
    peaks,
    lines,
):
    """Fold pieces of a time law into the buckets, in place.

    widths (2,): s and mm, of `over_time` and `along_path`, (k,4+3d) each; k is even. peaks (1+3d,): largest
    share of the feed rate, then velocity, acceleration and jerk of every axis, at `POINTS` points a piece;
    lines (1+3d,): where. A piece that spans many buckets is looked at in each of them.
    """
    axes = rows.shape[2]
    row = np.zeros(4 + 3 * axes)
    most = np.empty(4 + 3 * axes)
    for m in range(time.size):
        k = cell[m]
        v = speed[m]
        a = path_acceleration[m]
        b = path_jerk[m]
        t = duration[m]
        place = arc_length[k] + stretch[k] * u[m]
        end = place + stretch[k] * moved(v, a, b, t)
        widths[0] = widen(over_time, widths[0], time[m] + t)
        widths[1] = widen(along_path, widths[1], end)
        first_bucket = int(time[m] / widths[0])
        first_place = int(place / widths[1])
        inside = int((time[m] + t) / widths[0]) == first_bucket and int(end / widths[1]) == first_place
        most[:] = -np.inf
        fastest = 0.0
        ruled = 0.0
        for n in range(POINTS):
            e = t * n / (POINTS - 1)
            here = v + e * (a + e * b / 2.0)
            gone = moved(v, a, b, e)
            fastest = max(fastest, abs(here))
            speed_here = point_use(rows[k], u[m] + gone, here, a + e * b, b, alone[k], feed_rate[k], row)
            ruled = max(ruled, speed_here)
            for j in range(row.size):
                most[j] = max(most[j], row[j])
            if not inside:
                there = place + stretch[k] * gone
                fold(row, there, over_time, int((time[m] + e) / widths[0]))
                fold(row, time[m] + e, along_path, int(there / widths[1]))
        if inside:
            fold(most, end, over_time, first_bucket)
            fold(most, time[m] + t, along_path, first_place)
        if ruled / feed_rate[k] > peaks[0]:
            if ruled / feed_rate[k] > peaks[0] * (1.0 + TIE):
                lines[0] = line[k]
            peaks[0] = ruled / feed_rate[k]
        for j in range(3 * axes):
            if most[4 + j] > peaks[1 + j]:
                if most[4 + j] > peaks[1 + j] * (1.0 + TIE):
                    lines[1 + j] = line[k]
                peaks[1 + j] = most[4 + j]
        between = max(t / widths[0], SPREAD * fastest * stretch[k] * t / widths[1])
        if between > POINTS - 1:
            steps = int(np.ceil(between))
            for n in range(1, steps):
                e = t * n / steps
                here = v + e * (a + e * b / 2.0)
                gone = moved(v, a, b, e)
                point_use(rows[k], u[m] + gone, here, a + e * b, b, alone[k], feed_rate[k], row)
                there = place + stretch[k] * gone
                fold(row, there, over_time, int((time[m] + e) / widths[0]))
                fold(row, time[m] + e, along_path, int(there / widths[1]))


@kernel
def drawn_points(
    time, duration, u, speed, path_acceleration, path_jerk, cell, rows, feed_rate, arc_length, stretch
):
    """Points of the path that are drawn, (n,7): XYZ in mm, speed in mm/s, place in mm, time in s, rapid.

    Each piece gives its start, and more where it is long. The last column is 1 in a rapid and else 0.
    """
    counts = np.empty(duration.size, np.int64)
    for m in range(duration.size):
        travel = stretch[cell[m]] * moved(speed[m], path_acceleration[m], path_jerk[m], duration[m])
        counts[m] = int(min(max(np.ceil(travel / APART), 1.0), MOST_DRAWN))
    points = np.empty((counts.sum(), 7))
    row = 0
    for m in range(duration.size):
        c = rows[cell[m]]
        for n in range(counts[m]):
            e = duration[m] * n / counts[m]
            s = u[m] + moved(speed[m], path_acceleration[m], path_jerk[m], e)
            v = speed[m] + e * (path_acceleration[m] + e * path_jerk[m] / 2.0)
            square = 0.0
            for i in range(3):
                points[row, i] = c[0, i] + s * (c[1, i] + s * (c[2, i] + s * c[3, i]))
                qv = (c[1, i] + s * (2.0 * c[2, i] + 3.0 * c[3, i] * s)) * v
                square += qv * qv
            points[row, 3] = np.sqrt(square)
            points[row, 4] = arc_length[cell[m]] + stretch[cell[m]] * s
            points[row, 5] = time[m] + e
            points[row, 6] = 1.0 if np.isinf(feed_rate[cell[m]]) else 0.0
            row += 1
    return points
