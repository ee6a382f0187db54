"""The fastest law below an envelope whose acceleration nowhere falls faster than a jerk allows.

The envelope of two scans (`kernels/jerk_scan.py`) has phases with ``0 <= b <= J``, and its acceleration falls
by steps between them. A law that touches such a step from below would fall by a step as well, so it must
leave the envelope before and come back after it. Between it is an arc ``b = -J``, tangent to a phase P before
and a phase Q after: as with the convex hull of points (Graham's scan), phases come one by one onto a stack,
and what an arc to the new one passes below is taken off again.

An arc that leaves P later is higher, and the gap from Q to it has one maximum, because the acceleration of
the arc falls and that of Q does not. A tangent found by Newton's method whose ends lie within P and Q is
therefore the one; where it finds none, the gap decides by bisection.
"""
# pyright: basic

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.jerk_phases import MOST_STEPS, moved, put, time_to

SHORTEST = 1e-12  # s, a shorter phase is rounding
NO_KINK = 1e-9  # s, times the jerk: a smaller step of acceleration is rounding
NEWTON_STEPS = 12
LAST_STEP = 1e-15  # -, of the phases: after it nothing is left but rounding
ROUNDING = 1e-13  # -, of places and speeds
POP, TANGENT, END = 0, 1, 2  # what an arc does: passes below P, touches Q, meets the end of Q


@kernel
def tangent(vp, ap, bp, tp, uq, vq, aq, bq, tq, jerk, t1, t2):
    """Arc tangent to both phases, by Newton's method: whether there is one, its two ends, its length."""
    for _ in range(NEWTON_STEPS):
        a1 = ap + bp * t1
        v1 = vp + t1 * (ap + t1 * bp / 2.0)
        a2 = aq + bq * t2
        v2 = vq + t2 * (aq + t2 * bq / 2.0)
        t = (a1 - a2) / jerk
        end = v1 + t * (a1 - t * jerk / 2.0)
        speed_gap = end - v2
        gap = moved(vp, ap, bp, t1) + moved(v1, a1, -jerk, t) - uq - moved(vq, aq, bq, t2)
        m11 = a1 * (1.0 + bp / jerk)
        m12 = -a2 * (1.0 + bq / jerk)
        m21 = (1.0 + bp / jerk) * (v1 + a1 * t)
        m22 = -end * bq / jerk - v2
        determinant = m11 * m22 - m12 * m21
        if determinant == 0.0:
            return False, t1, t2, t
        step1 = (speed_gap * m22 - gap * m12) / determinant
        step2 = (gap * m11 - speed_gap * m21) / determinant
        if not abs(step1) + abs(step2) < np.inf:
            return False, t1, t2, t
        t1 -= step1
        t2 -= step2
        if abs(step1) + abs(step2) <= LAST_STEP * (tp + tq):
            break
    slack = 1e-13 * (tp + tq)
    if not (-slack <= t1 <= tp + slack and -slack <= t2 <= tq + slack):
        return False, t1, t2, 0.0
    t1 = min(max(t1, 0.0), tp)
    t2 = min(max(t2, 0.0), tq)
    a1 = ap + bp * t1
    v1 = vp + t1 * (ap + t1 * bp / 2.0)
    a2 = aq + bq * t2
    v2 = vq + t2 * (aq + t2 * bq / 2.0)
    t = (a1 - a2) / jerk
    if t < 0.0 or v1 < 0.0 or v2 < 0.0:
        return False, t1, t2, t
    speed_gap = v1 + t * (a1 - t * jerk / 2.0) - v2
    gap = moved(vp, ap, bp, t1) + moved(v1, a1, -jerk, t) - uq - moved(vq, aq, bq, t2)
    good = abs(speed_gap) <= 10.0 * ROUNDING * max(v1, v2) and abs(gap) <= ROUNDING * (
        abs(uq) + 10.0 * max(v1, v2) * (t + t2)
    )
    return good, t1, t2, t


@kernel
def through(vp, ap, bp, tp, ue, ve, ae, jerk, t1, t):
    """Arc tangent to P that meets the end of Q, by Newton's method: whether there is one, start, length."""
    for _ in range(NEWTON_STEPS):
        a1 = ap + bp * t1
        v1 = vp + t1 * (ap + t1 * bp / 2.0)
        end = v1 + t * (a1 - t * jerk / 2.0)
        speed_gap = end - ve
        gap = moved(vp, ap, bp, t1) + moved(v1, a1, -jerk, t) - ue
        m11 = a1 + bp * t
        m12 = a1 - jerk * t
        m21 = v1 + t * (a1 + t * bp / 2.0)
        m22 = end
        determinant = m11 * m22 - m12 * m21
        if determinant == 0.0:
            return False, t1, t
        step1 = (speed_gap * m22 - gap * m12) / determinant
        step = (gap * m11 - speed_gap * m21) / determinant
        if not abs(step1) + abs(step) < np.inf:
            return False, t1, t
        t1 -= step1
        t -= step
        if abs(step1) + abs(step) <= LAST_STEP * (tp + abs(t)):
            break
    slack = 1e-13 * (tp + abs(t))
    if not (-slack <= t1 <= tp + slack and t >= 0.0):
        return False, t1, t
    t1 = min(max(t1, 0.0), tp)
    a1 = ap + bp * t1
    v1 = vp + t1 * (ap + t1 * bp / 2.0)
    if a1 - jerk * t < ae or v1 < 0.0:
        return False, t1, t
    speed_gap = v1 + t * (a1 - t * jerk / 2.0) - ve
    gap = moved(vp, ap, bp, t1) + moved(v1, a1, -jerk, t) - ue
    good = abs(speed_gap) <= 10.0 * ROUNDING * max(v1, ve) and abs(gap) <= ROUNDING * (
        abs(ue) + 10.0 * max(v1, ve) * t
    )
    return good, t1, t


@kernel
def highest(vp, ap, bp, uq, vq, aq, bq, tq, jerk, t1):
    """Largest excess of the arc that leaves P at `t1` over Q.

    There the accelerations of both are the same, which gives the time on the arc by that on Q: the places
    are left to be made the same, and what parts them grows with the time on Q.

    Returns
    -------
    excess
        Of speed; -1 where the arc comes to rest before it reaches Q.
    t, t2
        Times on the arc and on Q where it is.
    at_end
        Whether that is the end of Q, and the arc is still getting nearer there.
    """
    v1 = vp + t1 * (ap + t1 * bp / 2.0)
    a1 = ap + bp * t1
    rest = (a1 + np.sqrt(a1 * a1 + 2.0 * jerk * v1)) / jerk
    reach = moved(v1, a1, -jerk, rest)
    before = uq - moved(vp, ap, bp, t1)
    if reach < before:
        return -1.0, rest, 0.0, False
    t = (a1 - aq) / jerk
    if t <= 0.0 or (t < rest and moved(v1, a1, -jerk, t) <= before):
        t = time_to(v1, a1, -jerk, rest, before) if before > 0.0 else 0.0
        return v1 + t * (a1 - t * jerk / 2.0) - vq, t, 0.0, False
    whole = before + moved(vq, aq, bq, tq)
    t = (a1 - aq - bq * tq) / jerk
    if whole <= reach and (t >= rest or (t >= 0.0 and whole <= moved(v1, a1, -jerk, t))):
        t = time_to(v1, a1, -jerk, rest, whole)
        return v1 + t * (a1 - t * jerk / 2.0) - (vq + tq * (aq + tq * bq / 2.0)), t, tq, True
    low = 0.0
    high = min(tq, (a1 - aq) / bq) if bq > 0.0 else tq
    t2 = 0.5 * high
    for _ in range(MOST_STEPS):
        t = min((a1 - aq - bq * t2) / jerk, rest)
        gap = before + moved(vq, aq, bq, t2) - moved(v1, a1, -jerk, t)
        if gap < 0.0:
            low = t2
        else:
            high = t2
        slope = vq + t2 * (aq + t2 * bq / 2.0) + (v1 + t * (a1 - t * jerk / 2.0)) * bq / jerk
        following = t2 - gap / slope if slope > 0.0 else 0.5 * (low + high)
        if not low < following < high:
            following = 0.5 * (low + high)
        near = abs(following - t2) <= 10.0 * LAST_STEP * tq
        t2 = following
        if near:
            break
    t = min(max((a1 - aq - bq * t2) / jerk, 0.0), rest)
    return v1 + t * (a1 - t * jerk / 2.0) - (vq + t2 * (aq + t2 * bq / 2.0)), t, t2, False


@kernel
def arc(vp, ap, bp, tp, uq, vq, aq, bq, tq, jerk):
    """Arc from P to Q: what it does, when it leaves P, how long it takes, when it touches Q."""
    kink = (ap + bp * tp - aq) / jerk
    good, t1, t2, t = tangent(
        vp, ap, bp, tp, uq, vq, aq, bq, tq, jerk,
        max(0.0, tp - 0.5 * kink / (1.0 + bp / jerk)), min(tq, 0.5 * kink / (1.0 + bq / jerk)),
    )  # fmt: skip
    if good:
        return TANGENT, t1, t, t2
    excess, t, t2, at_end = highest(vp, ap, bp, uq, vq, aq, bq, tq, jerk, 0.0)
    if excess > 0.0:
        return POP, 0.0, 0.0, 0.0
    ue = uq + moved(vq, aq, bq, tq)
    ve = vq + tq * (aq + tq * bq / 2.0)
    ae = aq + bq * tq
    low = 0.0
    high = tp
    t1 = 0.5 * tp
    last = np.inf
    for step in range(MOST_STEPS):
        if not low < t1 < high:
            break
        excess, s, s2, more_end = highest(vp, ap, bp, uq, vq, aq, bq, tq, jerk, t1)
        if excess > 0.0:
            high = t1
        else:
            low = t1
            t = s
            t2 = s2
            at_end = more_end
        if step % 4 == 3:
            if more_end:
                good, n1, n = through(vp, ap, bp, tp, ue, ve, ae, jerk, t1, s)
                if good:
                    return END, n1, n, tq
            else:
                good, n1, n2, n = tangent(vp, ap, bp, tp, uq, vq, aq, bq, tq, jerk, t1, s2)
                if good:
                    return TANGENT, n1, n, n2
        a1 = ap + bp * t1
        v1 = vp + t1 * (ap + t1 * bp / 2.0)
        end = v1 + s * (a1 - s * jerk / 2.0)
        slope = a1 + bp * s - (a1 - jerk * s) * (v1 + s * (a1 + s * bp / 2.0)) / end
        newton = excess != -1.0 and slope > 0.0 and abs(excess) < 0.5 * last
        last = abs(excess)
        t1 = t1 - excess / slope if newton else 0.5 * (low + high)
        if not low < t1 < high:
            t1 = 0.5 * (low + high)
    return (END if at_end else TANGENT), low, t, t2


@kernel
def round_off(phases, cell, count, nodes, least_jerk, law, law_cell):
    """Round the steps of an envelope; returns how many phases the law has, 0 if it has none.

    Parameters
    ----------
    phases (m,5), cell (m,), count
        The envelope.
    nodes (k+1,)
        Places of the cells' ends.
    least_jerk (k,)
        Jerk by which the acceleration may fall in each cell; an arc keeps the least of all it may touch.
    law (2 m+2,5), law_cell
        Output; places count from the start of the cell, which for an arc is that of the phase it leaves.
    """
    m = 0
    lowest = np.empty(least_jerk.size, np.int64)  # cells whose jerk is less than all that follow, so far
    lows = 0
    seen = 0
    is_arc = np.zeros(law.shape[0], np.bool_)
    for n in range(count):
        tq = phases[n, 0]
        if tq < SHORTEST:
            continue
        k = cell[n]
        while seen <= k:
            while lows > 0 and least_jerk[lowest[lows - 1]] >= least_jerk[seen]:
                lows -= 1
            lowest[lows] = seen
            lows += 1
            seen += 1
        uq = phases[n, 1]
        vq = phases[n, 2]
        aq = phases[n, 3]
        bq = phases[n, 4]
        dropped = False
        joined = True
        while m > 0:
            p = m - 1
            if is_arc[p]:
                if law[p, 3] + law[p, 4] * law[p, 0] <= aq - law[p, 4] * NO_KINK:
                    break
                m -= 1
                joined = False
                continue
            first = law_cell[p]
            low = 0
            high = lows - 1
            while low < high:
                middle = (low + high) // 2
                if lowest[middle] >= first:
                    high = middle
                else:
                    low = middle + 1
            jerk = least_jerk[lowest[low]]
            tp = law[p, 0]
            up = law[p, 1]
            vp = law[p, 2]
            ap = law[p, 3]
            bp = law[p, 4]
            if joined and ap + bp * tp <= aq + NO_KINK * jerk:
                break
            apart = (nodes[k] - nodes[first]) + (uq - up)
            what, t1, t, t2 = arc(vp, ap, bp, tp, apart, vq, aq, bq, tq, jerk)
            if what == POP:
                if m > 1:
                    m -= 1
                    joined = False
                    continue
                return 0
            law[p, 0] = t1
            a1 = ap + bp * t1
            v1 = vp + t1 * (ap + t1 * bp / 2.0)
            put(law, law_cell, m, t, up + moved(vp, ap, bp, t1), v1, a1, -jerk, first)
            is_arc[m] = True
            m += 1
            if what == END:
                dropped = True
            else:
                uq += moved(vq, aq, bq, t2)
                vq += t2 * (aq + t2 * bq / 2.0)
                aq += bq * t2
                tq -= t2
            break
        if not dropped:
            put(law, law_cell, m, tq, uq, vq, aq, bq, k)
            is_arc[m] = False
            m += 1
    return m
