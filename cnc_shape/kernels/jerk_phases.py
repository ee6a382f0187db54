"""Motion in phases of constant path jerk: ``s = v t + a t^2/2 + b t^3/6``."""
# pyright: basic

import numpy as np

from cnc_shape.kernels import inlined, kernel

MOST_STEPS = 60  # of a Newton iteration or a bisection


@kernel
def travel_time(v, a, b, h):
    """Smallest t with ``v t + a t^2/2 + b t^3/6 = h`` where no coefficient is negative.

    Each term alone bounds t from above, and the sum is convex: Newton descends to the root.
    """
    t = np.inf
    if v > 0.0:
        t = min(t, h / v)
    if a * t * t > 2.0 * h:
        t = np.sqrt(2.0 * h / a)
    if b * t * t * t > 6.0 * h:
        t = np.cbrt(6.0 * h / b)
    for _ in range(MOST_STEPS):
        step = (t * (v + t * (a / 2.0 + t * b / 6.0)) - h) / (v + t * (a + t * b / 2.0))
        if not step > 0.0:
            break
        lower = t - step
        if lower >= t:
            break
        t = lower
    return t


@inlined
def moved(v, a, b, t):
    """Distance after `t`."""
    return t * (v + t * (a / 2.0 + t * b / 6.0))


@kernel
def time_to(v, a, b, most, h):
    """Time in [0, `most`] at which a phase that never turns back has moved by `h`."""
    low = 0.0
    high = most
    t = min(most, h / v) if v > 0.0 else 0.5 * most
    for _ in range(2 * MOST_STEPS):
        gap = moved(v, a, b, t) - h
        if gap > 0.0:
            high = t
        else:
            low = t
        speed = v + t * (a + t * b / 2.0)
        following = t - gap / speed if speed > 0.0 else 0.5 * (low + high)
        if not low <= following <= high:
            following = 0.5 * (low + high)
        if abs(following - t) <= 1e-15 * most:
            return following
        t = following
    return t


@inlined
def speed_at(phases, low, high, place):
    """Phase among `low` to `high` in which `place` lies, the time in it, and the speed."""
    n = low
    while n + 1 < high and phases[n + 1, 1] <= place:
        n += 1
    t = time_to(phases[n, 2], phases[n, 3], phases[n, 4], phases[n, 0], place - phases[n, 1])
    return n, t, phases[n, 2] + t * (phases[n, 3] + t * phases[n, 4] / 2.0)


@inlined
def last_speed(phases, n):
    """Speed at the end of a phase."""
    t = phases[n, 0]
    return phases[n, 2] + t * (phases[n, 3] + t * phases[n, 4] / 2.0)


@inlined
def put(phases, cell, m, t, place, v, a, b, k):
    """Write a phase."""
    phases[m, 0] = t
    phases[m, 1] = place
    phases[m, 2] = v
    phases[m, 3] = a
    phases[m, 4] = b
    cell[m] = k
