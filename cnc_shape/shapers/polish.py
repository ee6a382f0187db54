"""Impulses off the grid: move them until nothing can be shortened, then meet every equation to rounding.

Unknowns ``x = (t_2 … t_N, A_1 … A_N)``. The last time is minimised by sequential linear programming
subject to the demands at the maxima of V, which are looked up anew at every step. A Newton iteration on the
active constraints takes the rest of the error away.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Any, cast

import numpy as np

from cnc_shape.arrays import BoolArray, FloatArray
from cnc_shape.shapers.demands import (
    END_AMPLITUDE,
    ComplexArray,
    Demands,
    keeps,
    peaks,
    waves,
    worst,
    zero_rows,
)

MOST_STEPS = 60
MOST_EXCHANGES, MOST_QUADRATIC_STEPS = 4, 60
MOST_UNKNOWNS = 18  # for quadratic programming, whose time grows with their cube
MOST_REPAIRS = 8
MOST_GROWTH = 2.0  # -, of the duration: an iteration that goes farther has run away
ENOUGH = 1e-8  # -, of the duration: a gain that is not worth another exchange
SNAP = 0.1  # -, how near its bound a running sum is put there
PENALTIES = 100.0, 1e5  # periods a unit of violation: at first, and the highest
NO_VIOLATION = 1e-9
FIRST_RADIUS, LEAST_RADIUS = 0.01, 1e-11
LEAST_GAIN = 1e-11  # periods
MOST_NEWTON_STEPS = 8
NEAR = 0.7  # of the tolerance: a maximum of V that is watched
ACTIVE = 1e-7
LARGEST_STEP = 1e-5  # of Newton's method
NEARLY_ACTIVE = 0.02
ZERO_TOLERANCE = 2e-13  # -, of sum A t^k e^{s t}, t in periods
ALLOWED_EXCESS = 5e-7  # -, of the tolerance
DROPPED = 1e-9  # -, amplitude


@dataclass(frozen=True, eq=False, slots=True)
class Impulses:
    """A candidate: times in periods, amplitudes."""

    times: FloatArray  # (n,)
    amplitudes: FloatArray  # (n,)


def _split(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    n = (x.size + 1) // 2
    return np.concatenate([[0.0], x[: n - 1]]), x[n - 1 :]


def _phasors(
    poles: ComplexArray, orders: FloatArray, t: FloatArray, a: FloatArray
) -> tuple[ComplexArray, ComplexArray]:
    """``F = sum A t^k e^{s t}``, decayed, and its derivatives with respect to x; (m,) and (m, 2n-1)."""
    wave = waves(poles, t)
    power = t[None, :] ** orders[:, None]
    lower = orders[:, None] * t[None, :] ** np.maximum(orders - 1.0, 0.0)[:, None]
    by_amplitude = power * wave
    value = by_amplitude @ a
    by_time = a * (lower + poles[:, None] * power) * wave
    by_time[:, -1] -= poles.real * value
    return value, np.concatenate([by_time[:, 1:], by_amplitude], axis=1)


@dataclass(frozen=True, eq=False, slots=True)
class _Constraints:
    """Equations ``e(x) = 0`` and inequalities ``g(x) >= 0`` with their derivatives, for a set of maxima."""

    demands: Demands
    zeros: ComplexArray  # poles, one per order
    orders: FloatArray
    watched: ComplexArray  # poles where V may touch the tolerance
    linear: FloatArray  # inequalities that are linear: linear @ x >= limit
    limit: FloatArray

    def equations(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        t, a = _split(x)
        value, slope = _phasors(self.zeros, self.orders, t, a)
        total = np.concatenate([np.zeros(t.size - 1), np.ones(t.size)])
        return (
            np.concatenate([[a.sum() - 1.0], value.real, value.imag]),
            np.concatenate([total[None, :], slope.real, slope.imag]),
        )

    def inequalities(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        t, a = _split(x)
        value, slope = _phasors(self.watched, np.zeros(self.watched.size), t, a)
        v = self.demands.tolerance
        return (
            np.concatenate([(v - np.abs(value) ** 2 / v) / 2.0, self.linear @ x - self.limit]),
            np.concatenate([-(value.conj()[:, None] * slope).real / v, self.linear]),
        )


def _linear(demands: Demands, signs: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Gaps, signs and bounds of the impulses as ``matrix @ x >= limit``; signs stay what they are."""
    bounds, n = demands.bounds, signs.size
    times, amplitudes = np.eye(n)[1:], np.eye(n)  # rows pick t_2…t_N out of t, A out of A
    steps = (np.diff(np.eye(n), axis=0) @ times.T, np.full(n - 1, bounds.gap))
    floor = np.zeros(n)
    floor[-1] = END_AMPLITUDE
    blocks: list[tuple[FloatArray, FloatArray]] = [(signs[:, None] * amplitudes, floor)]
    if not bounds.positive:
        sums = np.tril(np.ones((n, n)))[:-1]
        blocks += [
            (sums, np.full(n - 1, bounds.min_running_sum)), (-sums, np.full(n - 1, -bounds.max_running_sum)),
        ]  # fmt: skip
    if bounds.limits_size:
        blocks.append((-signs[:, None] * amplitudes, np.full(n, -bounds.max_amplitude)))
    if bounds.max_sum_abs_amplitude < inf:
        blocks.append((-signs[None, :], np.array([-bounds.max_sum_abs_amplitude])))
    on_amplitudes = np.concatenate([block for block, _ in blocks])
    matrix = np.concatenate(
        [
            np.column_stack([steps[0], np.zeros((n - 1, n))]),
            np.column_stack([np.zeros((len(on_amplitudes), n - 1)), on_amplitudes]),
        ]
    )
    return matrix, np.concatenate([steps[1], *[limit for _, limit in blocks]])


def polish(demands: Demands, start: Impulses) -> Impulses | None:
    """Shortest impulses near `start`, verified; None where the iteration ends at none.

    Where all running sums lie near their bounds they are put there first, and only the times moved: without
    bounds on single amplitudes the shortest impulses switch from bound to bound.
    """
    n = start.times.size
    x = np.concatenate([start.times[1:], start.amplitudes])
    switching = _switching(demands, start)
    if switching is not None:
        only_times = np.arange(x.size) < n - 1
        found = _polish(demands, np.concatenate([x[: n - 1], switching]), only_times)
        if found is not None:
            return found
    return _polish(demands, x, np.ones(x.size, dtype=np.bool_))


def repair(demands: Demands, start: Impulses) -> Impulses | None:
    """Impulses next to `start` that meet every demand, no matter how long they take."""
    x = np.concatenate([start.times[1:], start.amplitudes])
    linear = _linear(demands, np.where(start.amplitudes < 0.0, -1.0, 1.0))
    return _verified(demands, x, np.ones(x.size, dtype=np.bool_), linear)


def _switching(demands: Demands, start: Impulses) -> FloatArray | None:
    """Amplitudes with every running sum at a bound, if `start` is near such; None else."""
    bounds = demands.bounds
    if bounds.positive or bounds.limits_size or bounds.max_sum_abs_amplitude < inf:
        return None
    sums = np.cumsum(start.amplitudes)[:-1]
    low, high = sums - bounds.min_running_sum < SNAP, bounds.max_running_sum - sums < SNAP
    sums = np.where(low, bounds.min_running_sum, bounds.max_running_sum)
    amplitudes = np.diff(np.concatenate([[0.0], sums, [1.0]]))
    return amplitudes if (low | high).all() and (amplitudes != 0.0).all() else None


def _polish(demands: Demands, x: FloatArray, free: BoolArray) -> Impulses | None:
    linear = _linear(demands, np.where(_split(x)[1] < 0.0, -1.0, 1.0))
    end = _descend(demands, x, free, linear)
    if end is None:
        return None
    best = _verified(demands, end, free, linear)
    for _ in range(MOST_EXCHANGES if int(free.sum()) <= MOST_UNKNOWNS else 0):
        end = _settle(_constraints(demands, end, linear), end, free)
        found = None if end is None else _verified(demands, end, free, linear)
        if found is not None and best is not None and found.times[-1] >= best.times[-1] * (1.0 - ENOUGH):
            break
        best = found or best
        if end is None:
            break
    return best


def _verified(
    demands: Demands, x: FloatArray, free: BoolArray, linear: tuple[FloatArray, FloatArray]
) -> Impulses | None:
    """Meet what is missed by little, with the maxima of V where they come to lie; None if that fails."""
    longest = MOST_GROWTH * float(_split(x)[0][-1])
    for _ in range(MOST_REPAIRS):
        constraints = _constraints(demands, x, linear)
        nearest = _nearest(constraints, x, free)
        if nearest is None:
            return None
        x = _newton(constraints, nearest, free)
        t, a = _split(x)
        if not _in_reach(t, longest):
            return None
        if is_solution(demands, t, a):
            return Impulses(t, a)
    return None


def _settle(constraints: _Constraints, x: FloatArray, free: BoolArray) -> FloatArray | None:
    """Sequential quadratic programming with the maxima of V where they are: for ends that are no corner."""
    from scipy.optimize import minimize  # pyright: ignore[reportUnknownVariableType]  # scipy ships no types

    last = (x.size + 1) // 2 - 2
    gradient = np.zeros(int(free.sum()))
    gradient[last] = 1.0
    some = constraints.equations(x)[1][:, free].any(axis=1)
    moves = constraints.inequalities(x)[1][:, free].any(axis=1)

    def whole(z: FloatArray) -> FloatArray:
        y = x.copy()
        y[free] = z
        return y

    def duration(z: FloatArray) -> float:
        return float(z[last])

    def slope(z: FloatArray) -> FloatArray:
        return gradient

    def zero(z: FloatArray) -> FloatArray:
        return constraints.equations(whole(z))[0][some]

    def zero_slope(z: FloatArray) -> FloatArray:
        return constraints.equations(whole(z))[1][some][:, free]

    def room(z: FloatArray) -> FloatArray:
        return constraints.inequalities(whole(z))[0][moves]

    def room_slope(z: FloatArray) -> FloatArray:
        return constraints.inequalities(whole(z))[1][moves][:, free]

    find = cast("Callable[..., Any]", minimize)
    result = find(
        duration, x[free], jac=slope, method="SLSQP",
        constraints=[
            *([{"type": "eq", "fun": zero, "jac": zero_slope}] if some.any() else []),
            {"type": "ineq", "fun": room, "jac": room_slope},
        ],
        options={"maxiter": MOST_QUADRATIC_STEPS, "ftol": 1e-12},
    )  # fmt: skip
    end = whole(np.asarray(result.x, dtype=np.float64))
    longest = MOST_GROWTH * float(_split(x)[0][-1])
    return end if np.isfinite(end).all() and _in_reach(_split(end)[0], longest) else None


def _in_reach(times: FloatArray, longest: float) -> bool:
    """Whether an iteration has not run away."""
    return bool(np.isfinite(times).all() and (np.diff(times) > 0.0).all() and times[-1] <= longest)


def _constraints(demands: Demands, x: FloatArray, linear: tuple[FloatArray, FloatArray]) -> _Constraints:
    """Return the constraints at `x`: those of its own maxima of V."""
    t, a = _split(x)
    zeros = [(zero.pole, order) for zero in demands.zeros for order in range(zero.order + 1)]
    found = [peaks(band, t, a, NEAR * demands.tolerance)[0] for band in demands.bands]
    return _Constraints(
        demands,
        np.array([zero for zero, _ in zeros], dtype=np.complex128),
        np.array([order for _, order in zeros], dtype=np.float64),
        np.concatenate([np.empty(0, dtype=np.complex128), *found]),
        *linear,
    )


def _descend(
    demands: Demands, x: FloatArray, free: BoolArray, linear: tuple[FloatArray, FloatArray]
) -> FloatArray | None:
    """Sequential linear programming in a trust region on ``t_N + penalty * (largest violation)``.

    The shortest impulses meet as many constraints as they have unknowns, as a rule: a corner, which linear
    programs find as fast as Newton's method would if it knew which constraints are active.
    """
    from scipy.optimize import linprog  # pyright: ignore[reportUnknownVariableType]  # scipy ships no types

    n = (x.size + 1) // 2
    matrix, limit = linear
    cost = np.zeros(x.size + 1)
    penalty = PENALTIES[0]
    cost[n - 2] = 1.0
    constraints = _constraints(demands, x, linear)
    (e, by_e), (g, by_g) = constraints.equations(x), constraints.inequalities(x)
    violation, radius = _violation(e, g, len(limit)), FIRST_RADIUS
    for _ in range(MOST_STEPS):
        cost[-1] = penalty
        curved = len(g) - len(limit)
        rows = np.concatenate([by_e[1:], -by_e[1:], -by_g[:curved]])
        rows = np.column_stack([rows, np.full(len(rows), -1.0)])
        rows = np.concatenate([rows, np.column_stack([-matrix, np.zeros(len(matrix))])])
        sides = np.concatenate([-e[1:], e[1:], g])
        result: Any = linprog(
            cost, A_ub=rows, b_ub=sides, A_eq=np.append(by_e[0], 0.0)[None, :], b_eq=-e[:1], method="highs",
            options={"primal_feasibility_tolerance": 1e-10},
            bounds=[*[(-radius, radius) if moves else (0.0, 0.0) for moves in free.tolist()], (0.0, None)],
        )  # fmt: skip
        if result.x is None:
            return None
        step = np.asarray(result.x[:-1], dtype=np.float64)
        promised = penalty * (violation - float(result.x[-1])) - step[n - 2]
        if promised <= LEAST_GAIN or radius < LEAST_RADIUS:
            if violation < NO_VIOLATION or penalty >= PENALTIES[1]:
                break
            penalty, radius = 10.0 * penalty, FIRST_RADIUS / 10.0
            continue
        tried = x + step
        constraints = _constraints(demands, tried, linear)
        there, those = constraints.equations(tried), constraints.inequalities(tried)
        misses = _violation(there[0], those[0], len(limit))
        gained = penalty * (violation - misses) - step[n - 2]
        if gained > 0.1 * promised:
            x, violation = tried, misses
            (e, by_e), (g, by_g) = there, those
        radius *= 2.0 if gained > 0.7 * promised else 0.3 if gained < 0.3 * promised else 1.0
    return x


def _violation(e: FloatArray, g: FloatArray, linear: int) -> float:
    curved = g[: g.size - linear]
    return max(0.0, float(np.abs(e).max()), -float(curved.min()) if curved.size else 0.0)


def _nearest(constraints: _Constraints, x: FloatArray, free: BoolArray) -> FloatArray | None:
    """Point next to `x` that meets the linearised constraints: least largest step, by a linear program."""
    from scipy.optimize import linprog  # pyright: ignore[reportUnknownVariableType]  # scipy ships no types

    (e, by_e), (g, by_g) = constraints.equations(x), constraints.inequalities(x)
    scale = max(float(np.abs(e).max()), -float(g.min()))
    if scale < 1e-13:
        return x
    by_e, by_g, one = by_e[:, free], by_g[:, free], np.eye(int(free.sum()))
    moves = by_g.any(axis=1)
    active = g[moves] < NEARLY_ACTIVE
    rows = np.concatenate([-by_g[moves][active], one, -one])
    reach = np.concatenate([np.zeros(int(active.sum())), np.ones(2 * len(one))])
    some = by_e.any(axis=1)
    result: Any = linprog(
        np.append(np.zeros(len(one)), 1.0),
        A_ub=np.column_stack([rows, -reach]),
        b_ub=np.concatenate([np.minimum(g[moves][active] / scale, 1e4), np.zeros(2 * len(one))]),
        A_eq=np.column_stack([by_e[some], np.zeros(int(some.sum()))]) if some.any() else None,
        b_eq=-e[some] / scale if some.any() else None,
        bounds=[(None, None)] * len(one) + [(0.0, None)], method="highs",
        options={"primal_feasibility_tolerance": 1e-9},
    )  # fmt: skip
    if result.x is None:
        return None
    nearest = x.copy()
    nearest[free] += scale * np.asarray(result.x[:-1], dtype=np.float64)
    return nearest


def _newton(constraints: _Constraints, x: FloatArray, free: BoolArray) -> FloatArray:
    """Meet equations and active inequalities: least-norm Newton steps."""
    for _ in range(MOST_NEWTON_STEPS):
        e, by_e = constraints.equations(x)
        g, by_g = constraints.inequalities(x)
        active = g < ACTIVE
        error = np.concatenate([e, g[active]])
        if np.abs(error).max() < 1e-15:
            break
        by_x = np.concatenate([by_e, by_g[active]])[:, free]
        step = np.zeros(x.size)
        step[free] = np.linalg.lstsq(by_x, error, rcond=1e-10)[0]
        if np.abs(step).max() > LARGEST_STEP:
            break
        x = x - step
    return x


def is_solution(demands: Demands, times: FloatArray, amplitudes: FloatArray) -> bool:
    """Whether impulses do what is asked, seen on a grid denser than that of the design."""
    zeros = zero_rows(demands.zeros, times) @ amplitudes
    return (
        bool((np.abs(zeros) <= ZERO_TOLERANCE).all())
        and keeps(demands.bounds, times, amplitudes)
        and worst(demands, times, amplitudes) <= demands.tolerance * (1.0 + ALLOWED_EXCESS)
    )
