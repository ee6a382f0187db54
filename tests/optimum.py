"""The shortest time of a path under a jerk limit, as near as sequential linear programs tell it.

In x = v^2 over the path parameter u, acceleration along the path is x'/2 and jerk v x''/2, so the rows of an
axis are

    |q' x'/2 + q'' x| <= A,     |q' x''/2 + 3/2 q'' x' + q''' x| <= J / v

Only J/v is not linear in x. It is convex: its tangent at the last solution is a stricter limit, and the next
solution keeps it again. Time, the sum of 2 h / (v_k + v_k+1), is convex in x, and its tangent is minimised
within a trust region.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from motions import divided
from scipy import sparse
from scipy.optimize import linprog

from cnc_shape.feedrate import Profile
from cnc_shape.limits import Limits
from cnc_shape.smoothing import Path

CLOSE = 2e-4  # -, by which the last round made it faster
SLOWEST = 1.0  # mm^2/s^2, of the tangents


@dataclass(frozen=True, eq=False)
class Fastest:
    """Places of the nodes (n,) mm, squared speeds there (n,) mm^2/s^2, and the time."""

    place: np.ndarray
    x: np.ndarray
    time: float


def speeds_at(profile: Profile, places: np.ndarray) -> np.ndarray:
    """Squared path speed (n,) at `places`, counted from the start of the program, by bisection."""
    border = np.concatenate([[0.0], np.cumsum(profile.path.length)])
    start = border[profile.cell] + profile.u
    m = np.maximum(np.searchsorted(start, places, side="right") - 1, 0)
    v, a, b = profile.velocity[m], profile.acceleration[m], profile.jerk[m]
    low, high = np.zeros(m.size), profile.duration[m].copy()
    for _ in range(60):
        t = 0.5 * (low + high)
        short = t * (v + t * (a / 2 + t * b / 6)) < places - start[m]
        low, high = np.where(short, t, low), np.where(short, high, t)
    return (v + low * (a + low * b / 2)) ** 2


def fastest(path: Path, limits: Sequence[Limits], law: Profile, nodes=700, most_rounds=12) -> Fastest:
    """Shortest time of a path without a stop, from rest to rest, sought from the speeds of `law` on.

    The limits hold at some `nodes` and in the cells next to them, and x is linear between: it is an estimate,
    not a bound, and no law that can be run.
    """
    path = divided(path, nodes)
    moving = path.length > 0.0
    c, h = path.coefficients[moving], path.length[moving]
    n = h.size
    place = np.concatenate([[0.0], np.cumsum(h)])
    reach = np.array([[limit.velocity, limit.acceleration, limit.jerk] for limit in limits]).T
    ends = [
        (c[:, 1] + e * (2 * c[:, 2] + 3 * e * c[:, 3]), 2 * c[:, 2] + 6 * e * c[:, 3], 6 * c[:, 3])
        for e in (np.zeros((n, 1)), h[:, None])
    ]
    at = [sparse.eye(n, n + 1, k).tocsr() for k in (0, 1)]
    slope = sparse.diags(0.5 / h) @ (at[1] - at[0])  # acceleration in the cells
    before, after = h[:-1], h[1:]
    mean = sparse.diags(after / (before + after)) @ slope[:-1]
    mean += sparse.diags(before / (before + after)) @ slope[1:]
    change = sparse.diags(2.0 / (before + after)) @ (slope[1:] - slope[:-1])
    inner = at[0][1:]
    cap, fixed, fixed_bound, bent, bent_bound = np.full(n + 1, np.inf), [], [], [], []
    for side, (first, second, third) in enumerate(ends):
        own = slice(1, None) if side == 0 else slice(None, -1)
        nodes_here = slice(0, n) if side == 0 else slice(1, n + 1)
        speed = np.linalg.norm(first, axis=1)
        cap[nodes_here] = np.minimum(cap[nodes_here], (path.feed_rate[moving] / speed) ** 2)
        for i, (velocity, acceleration, jerk) in enumerate(reach.T):
            if not (first[:, i].any() or second[:, i].any() or third[:, i].any()):
                continue
            with np.errstate(divide="ignore"):
                cap[nodes_here] = np.minimum(cap[nodes_here], (velocity / np.abs(first[:, i])) ** 2)
            row = sparse.diags(first[:, i]) @ slope + sparse.diags(second[:, i]) @ at[side]
            fixed += [row, -row]
            fixed_bound += [np.full(2 * n, acceleration)]
            row = sparse.diags(first[own, i]) @ change + sparse.diags(3.0 * second[own, i]) @ mean
            bent += [row + sparse.diags(third[own, i]) @ inner]
            bent_bound += [jerk]
    cap[[0, -1]] = 0.0

    def time(x: np.ndarray) -> float:
        v = np.sqrt(x)
        steps = 2.0 * h / (v[1:] + v[:-1])
        return steps.sum() + 0.5 * (steps[0] + steps[-1])  # from rest with constant jerk: x ~ u^(4/3)

    x = speeds_at(law, place)
    x[[0, -1]] = 0.0
    times: list[float] = []
    for _ in range(most_rounds):
        tangent_at = np.maximum(x[1:-1], SLOWEST)
        rows, bounds = list(fixed), list(fixed_bound)
        for row, jerk in zip(bent, bent_bound, strict=True):
            tangent = sparse.diags(0.5 * jerk * tangent_at**-1.5) @ inner
            rows += [row + tangent, tangent - row]
            bounds += [np.tile(1.5 * jerk * tangent_at**-0.5, 2)]
        matrix = sparse.vstack(rows).tocsr()
        scale = 1.0 / np.maximum(np.abs(matrix).max(axis=1).toarray().ravel(), 1e-12)
        v = np.sqrt(np.maximum(x, SLOWEST))
        each = h / (v[1:] + v[:-1]) ** 2
        cost = np.zeros(n + 1)
        cost[:-1] -= each / v[:-1]
        cost[1:] -= each / v[1:]
        high = np.minimum(cap, np.maximum(3.0 * x, SLOWEST))
        result = linprog(
            cost / np.abs(cost).max(), sparse.diags(scale) @ matrix, scale * np.concatenate(bounds),
            bounds=np.column_stack([np.minimum(0.3 * x, high), high]), method="highs-ipm",
        )  # fmt: skip
        if result.x is None:
            break
        x = np.maximum(result.x, 0.0)
        x[[0, -1]] = 0.0
        times.append(time(x))
        if len(times) > 1 and abs(times[-1] - times[-2]) <= CLOSE * times[-1]:
            break
    return Fastest(place, x, min(times))


def excess(path: Path, limits: Sequence[Limits], law: Profile, nodes=700) -> float:
    """By how much a law takes longer, (-)."""
    return law.end_time / fastest(path, limits, law, nodes).time - 1.0
