"""Lines and arcs as straight edges: polygons about the arcs, and where the path rests."""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel

ARC = 2  # Motion.ARC; Motion.RAPID and Motion.FEED are lines
DWELL = 6  # Motion.DWELL
EXACT_STOP = 0  # PathMode
BLEND = 2

LARGEST_STEP = 0.35  # rad, angle of a polygon's edge seen from the arc's centre
ARC_SHARE = 1.0 / 14.0  # the polygon's unit of error as a share of the path tolerance; it uses three of them,
# and hats as wide as two edges use ten
NO_TRAVEL = 1e-9  # mm, a move with less XYZ travel that turns rotary axes is rotary-only
COS_REVERSAL = -0.9659258262890683  # cos 165 degrees
EXACT_PATH_TOLERANCE = 1e-3  # mm, transition where an exact path bends without a corner
SMALLEST_TOLERANCE = 1e-5  # mm, so that an arc has a bearable number of edges
COS_EXACT_CORNER = 0.9998476951563913  # cos 1 degree: a sharper corner of an exact path is a stop
LARGEST_SPIRAL = 0.01  # -, change of the radius of an arc that still gets a polygon about it


@kernel
def copy_point(source, row, target, to):
    """Copy one row; written out because a slice assignment compiles for seconds."""
    for i in range(target.shape[1]):
        target[to, i] = source[row, i]


@kernel
def arc_radii(start, end, center, normal, r):
    """Radius at both ends of the arc in row `r`, and the rise of its end along the normal, mm."""
    rise = 0.0
    inner = 0.0
    outer = 0.0
    for i in range(3):
        rise += (end[r, i] - start[r, i]) * normal[r, i]
    for i in range(3):
        inner += (start[r, i] - center[r, i]) ** 2
        outer += (end[r, i] - center[r, i] - rise * normal[r, i]) ** 2
    return np.sqrt(inner), np.sqrt(outer), rise


@kernel
def arc_edges(inner, outer, rise, sweep, tolerance):
    """Return how an arc of `sweep` rad is cut: steps of angle, 1 if about it, and the distance from it, mm.

    A polygon about the arc touches it in the middle of every edge; its corners lie outside by
    ``r (1/cos(phi/2) - 1)``. Where the radius or the height changes with the angle, its straight edge also
    misses the curve by a third-order term in z and r, and a second-order one in r. A spiral whose radius
    changes by more than a little gets chords instead: off by ``phi^2/8`` of its second derivative by angle.
    """
    unit = ARC_SHARE * tolerance
    angle = abs(sweep)
    largest = max(inner, outer)
    climb = abs(rise) / angle
    spiral = abs(outer - inner) / angle
    if abs(outer - inner) > LARGEST_SPIRAL * largest:
        bend = largest + 2.0 * spiral
        count = max(1, int(np.ceil(angle / min(LARGEST_STEP, np.sqrt(24.0 * unit / bend)))))
        return count, 0, (angle / count) ** 2 / 8.0 * bend
    step = min(LARGEST_STEP, np.sqrt(24.0 * unit / largest))
    if climb + spiral > 0.0:
        step = min(step, (10.0 * unit / (climb + spiral)) ** (1.0 / 3.0))
    if spiral > 0.0:
        step = min(step, np.sqrt(unit * largest) / spiral)
    count = max(1, int(np.ceil(angle / step)))
    step = angle / count
    distance = (
        largest * (1.0 / np.cos(0.5 * step) - 1.0)
        + 0.02 * (climb + spiral) * step**3
        + (spiral * step) ** 2 / largest
    )
    return count, 1, distance


@kernel
def arc_arm(start, end, center, normal, sweep, r, inner, outer, rise, arm):
    """Unit vector `arm` (3,) from the axis of the arc in row `r` to its start.

    Where it starts on the axis: the direction it leaves in, its end turned back.
    """
    if inner > 1e-12 * outer:
        for i in range(3):
            arm[i] = (start[r, i] - center[r, i]) / inner
        return
    c = np.cos(sweep[r])
    s = np.sin(sweep[r])
    for i in range(3):
        j = (i + 1) % 3
        m = (i + 2) % 3
        along = end[r, i] - center[r, i] - rise * normal[r, i]
        ej = end[r, j] - center[r, j] - rise * normal[r, j]
        em = end[r, m] - center[r, m] - rise * normal[r, m]
        arm[i] = (c * along - s * (normal[r, j] * em - normal[r, m] * ej)) / outer


@kernel
def arc_length_between(inner, outer, rise, angle, low, high):
    """Length of an arc between two shares of its angle, by Simpson's rule; exact for circles and helices."""
    total = 0.0
    for n in range(3):
        radius = inner + (outer - inner) * (low + 0.5 * n * (high - low))
        speed = np.sqrt((radius * angle) ** 2 + (outer - inner) ** 2 + rise * rise)
        total += speed * (4.0 if n == 1 else 1.0) / 6.0
    return total * (high - low)


@kernel
def polygonize(
    kind,
    start,
    end,
    center,
    normal,
    sweep,
    feed_rate,
    dwell,
    mode,
    tolerance,
    arc_length,
    line,
    memory,
    flags,
):
    """Turn the rows of a toolpath into straight edges, and mark where the path rests.

    `memory` (1+d,): dwell to come, direction in which the last row ended; `flags` (5,): a row came
    before, it ends in an exact stop, it is exact, it is rotary-only, a stop is to come. Both are updated
    in place. `tolerance` (m,) mm has no nan.

    Returns
    -------
    start, end (n,d)
    values (6,n)
        Place and travel on the toolpath, tolerance, what of it the polygon uses, mm; feed rate; dwell.
    marks (4,n)
        Line, stop, rotary-only, and the toolpath's row, counted from 1; negative for an arc.
    """
    rows, d = start.shape
    total = 0
    counts = np.zeros(rows, np.int64)
    about = np.zeros(rows, np.int64)
    budgets = np.empty(rows)
    spents = np.zeros(rows)
    for r in range(rows):
        budgets[r] = max(tolerance[r], SMALLEST_TOLERANCE)
        if mode[r] != BLEND or tolerance[r] <= 0.0:
            budgets[r] = EXACT_PATH_TOLERANCE
        if kind[r] == DWELL:
            continue
        counts[r] = 1
        if kind[r] == ARC:
            inner, outer, rise = arc_radii(start, end, center, normal, r)
            count, about[r], spents[r] = arc_edges(inner, outer, rise, sweep[r], budgets[r])
            counts[r] = count + about[r]
        total += counts[r]

    o_start = np.empty((total, d))
    o_end = np.empty((total, d))
    o_values = np.empty((6, total))  # place, travel, tolerance, spent, feed_rate, dwell
    o_marks = np.zeros((4, total), np.int64)  # line, stop, alone, row
    n = 0
    direction = np.empty(d)
    point = np.empty((1, d))
    arm = np.empty(3)
    for r in range(rows):
        if kind[r] == DWELL:
            flags[4] = 1
            memory[0] += dwell[r]
            continue
        first = n
        travel = arc_length[r + 1] - arc_length[r]
        alone = False
        if kind[r] == ARC:
            inner, outer, rise = arc_radii(start, end, center, normal, r)
            arc_arm(start, end, center, normal, sweep, r, inner, outer, rise, arm)
            count = counts[r] - about[r]
            shift = 0.5 if about[r] == 1 else 1.0
            lift = 1.0 / np.cos(0.5 * sweep[r] / count) if about[r] == 1 else 1.0
            length = 0.0
            for k in range(counts[r]):
                low = max(0.0, (k - 1.0 + shift) / count)
                length += arc_length_between(inner, outer, rise, sweep[r], low, min(1.0, (k + shift) / count))
            scale = travel / length
            place = arc_length[r]
            copy_point(start, r, o_start, n)
            for k in range(counts[r]):
                share = min(1.0, (k + shift) / count)
                low = max(0.0, (k - 1.0 + shift) / count)
                along = scale * arc_length_between(inner, outer, rise, sweep[r], low, share)
                o_values[0, n] = place
                o_values[1, n] = along
                place += along
                if k == counts[r] - 1:
                    copy_point(end, r, o_end, n)
                    o_values[1, n] = arc_length[r + 1] - o_values[0, n]
                    n += 1
                    break
                radius = (inner + (outer - inner) * share) * lift
                c = radius * np.cos(sweep[r] * share)
                s = radius * np.sin(sweep[r] * share)
                for i in range(3):
                    j = (i + 1) % 3
                    m = (i + 2) % 3
                    side = normal[r, j] * arm[m] - normal[r, m] * arm[j]
                    point[0, i] = center[r, i] + c * arm[i] + s * side + rise * share * normal[r, i]
                for i in range(3, d):
                    point[0, i] = start[r, i] + (end[r, i] - start[r, i]) * (place - arc_length[r]) / travel
                copy_point(point, 0, o_end, n)
                n += 1
                copy_point(point, 0, o_start, n)
        else:
            copy_point(start, r, o_start, n)
            copy_point(end, r, o_end, n)
            o_values[0, n] = arc_length[r]
            o_values[1, n] = travel
            square = 0.0
            turn = 0.0
            for i in range(d):
                if i < 3:
                    square += (end[r, i] - start[r, i]) ** 2
                else:
                    turn += (end[r, i] - start[r, i]) ** 2
            alone = np.sqrt(square) < NO_TRAVEL and turn > 0.0
            n += 1
        for k in range(first, n):
            o_values[2, k] = budgets[r]
            o_values[3, k] = spents[r]
            o_values[4, k] = feed_rate[r]
            o_values[5, k] = 0.0
            o_marks[0, k] = line[r]
            o_marks[2, k] = 1 if alone else 0
            o_marks[3, k] = 1 + r if kind[r] != ARC else -1 - r

        exact = mode[r] != BLEND or tolerance[r] <= 0.0
        cosine = 0.0
        norm = 0.0
        for i in range(3):
            direction[i] = o_end[first, i] - o_start[first, i]
            norm += direction[i] ** 2
            cosine += direction[i] * memory[1 + i]
        cosine /= max(np.sqrt(norm), 1e-300)
        stop = (
            flags[0] == 0 or flags[1] == 1 or flags[4] == 1 or flags[3] == 1 or alone or cosine < COS_REVERSAL
        )
        if (exact or flags[2] == 1) and cosine < COS_EXACT_CORNER:
            stop = True
        if stop:
            o_marks[1, first] = 1
            o_values[5, first] = memory[0]
            memory[0] = 0.0
        norm = 0.0
        for i in range(3):
            direction[i] = o_end[n - 1, i] - o_start[n - 1, i]
            norm += direction[i] ** 2
        for i in range(3):
            memory[1 + i] = direction[i] / max(np.sqrt(norm), 1e-300)
        flags[0] = 1
        flags[1] = 1 if mode[r] == EXACT_STOP else 0
        flags[2] = 1 if exact else 0
        flags[3] = 1 if alone else 0
        flags[4] = 0
    return o_start, o_end, o_values, o_marks
