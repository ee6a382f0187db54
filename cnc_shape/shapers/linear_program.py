"""Best impulses on a grid of times, by linear programming.

On a fixed grid every demand is linear in the amplitudes but ``|F| <= v``, a cone. A cone is the
intersection of half planes ``Re(e^{-j phi} F) <= v``: a few to begin with, then one at every maximum of V
that the last answer leaves too high, until none is (Kelley's cutting planes). Half planes hold for any
duration, so they are kept from one to the next.

The unknowns are the running sums B, not the amplitudes: their bounds then cost no rows. What is minimised
is the excess over the tolerance. It is positive where the duration is too short, and the answer is then
still the one that comes closest: it shows where the impulses of the shortest sequence will lie.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi
from typing import Any

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.shapers.demands import ComplexArray, Demands, peaks, pole, waves, zero_rows

FIRST_PHASES = 6  # half planes a frequency begins with
FIRST_FREQUENCIES = 9
MOST_ROUNDS = 12
KEPT = 0.8  # -, of the tolerance: how near to a half plane an answer comes that needs it
CUT_TOLERANCE = 2e-3  # -, of the tolerance: how much of a cone the half planes may leave out
ZERO_SHARE = 1e-3  # -, of the excess that a zero may have beside quiet bands


@dataclass(frozen=True, eq=False, slots=True)
class Cuts:
    """Half planes ``Re(e^{-j phase} F(pole)) <= v``."""

    poles: ComplexArray  # (m,)
    phases: FloatArray  # (m,) rad


@dataclass(frozen=True, eq=False, slots=True)
class GridAnswer:
    """Amplitudes on a grid, and by how much they miss the tolerance."""

    times: FloatArray  # (n,) periods
    amplitudes: FloatArray  # (n,)
    excess: float  # -, not above 0 where the duration suffices


def first_cuts(demands: Demands) -> Cuts:
    """Return the half planes to begin with: a coarse polygon at some frequencies of every band."""
    poles = [
        pole(np.linspace(*band.omega, FIRST_FREQUENCIES), zeta)
        for band in demands.bands
        for zeta in sorted(set(band.zeta))
    ]
    at = np.concatenate(poles) if poles else np.empty(0, dtype=np.complex128)
    phases = np.linspace(0.0, 2.0 * pi, FIRST_PHASES, endpoint=False)
    return Cuts(np.repeat(at, FIRST_PHASES), np.tile(phases, at.size))


def best_on_grid(
    demands: Demands, times: FloatArray, cuts: Cuts, enough: float | None = None
) -> tuple[GridAnswer, Cuts]:
    """Minimise the excess on a grid of times; return the half planes that matter, too.

    With `enough` the answer may stop as soon as it is clear whether the excess is larger than that: half
    planes allow more than the cones, so an excess of theirs is one of the cones'.
    """
    answer = _solve(demands, times, cuts)
    for _ in range(MOST_ROUNDS if demands.bands else 0):
        if answer.excess == inf or (enough is not None and answer.excess > enough):
            break
        level = demands.tolerance + max(answer.excess, enough or 0.0, 0.0) + CUT_TOLERANCE * demands.tolerance
        at = np.concatenate([peaks(band, times, answer.amplitudes, level)[0] for band in demands.bands])
        if at.size == 0:
            break
        phases = np.angle(waves(at, times) @ answer.amplitudes)
        cuts = Cuts(np.concatenate([cuts.poles, at]), np.concatenate([cuts.phases, phases]))
        answer = _solve(demands, times, cuts)
    return answer, _that_matter(demands, answer, cuts)


def _that_matter(demands: Demands, answer: GridAnswer, cuts: Cuts) -> Cuts:
    """The first half planes, and of the others those that the answer comes near to."""
    height = (waves(cuts.poles, answer.times) @ answer.amplitudes * np.exp(-1j * cuts.phases)).real
    kept = height > KEPT * demands.tolerance
    kept[: first_cuts(demands).poles.size] = True
    return Cuts(cuts.poles[kept], cuts.phases[kept])


def _solve(demands: Demands, times: FloatArray, cuts: Cuts) -> GridAnswer:
    from scipy.optimize import linprog  # pyright: ignore[reportUnknownVariableType]  # scipy ships no types

    bounds, n = demands.bounds, times.size
    exact = zero_rows(demands.zeros, times)
    half_planes = (waves(cuts.poles, times) * np.exp(-1j * cuts.phases)[:, None]).real
    rows = np.concatenate([exact.real, exact.imag, -exact.real, -exact.imag, half_planes])
    limit = np.concatenate([np.zeros(4 * len(exact)), np.full(len(half_planes), demands.tolerance)])
    lowest = 0.0 if demands.zeros else -demands.tolerance

    if bounds.positive:
        box = [(0.0, min(bounds.max_amplitude, 1.0))] * n
        total, one = np.append(np.ones(n), 0.0)[None, :], np.ones(1)
    else:
        limit = limit - rows[:, -1]
        rows = rows[:, :-1] - rows[:, 1:]
        box = [(bounds.min_running_sum, bounds.max_running_sum)] * (n - 1)
        total = one = None
    share = np.full(len(rows), -1.0)
    share[: 4 * len(exact)] = -ZERO_SHARE if demands.bands else -1.0
    rows = np.column_stack([rows, share])
    matrix: Any = rows
    extra = 0
    if not bounds.positive and (bounds.limits_size or bounds.max_sum_abs_amplitude < inf):
        matrix, limit, extra = _with_sizes(demands, rows, limit, n)
    columns = rows.shape[1] + extra
    cost = np.zeros(columns)
    cost[rows.shape[1] - 1] = 1.0
    if total is not None:
        total = np.column_stack([total, np.zeros((1, extra))])
    result: Any = linprog(
        cost, A_ub=matrix, b_ub=limit, A_eq=total, b_eq=one, method="highs",
        bounds=[*box, (lowest, None), *[(0.0, None)] * extra],
    )  # fmt: skip
    if result.x is None:
        return GridAnswer(times, np.zeros(n), inf)
    x = np.asarray(result.x, dtype=np.float64)
    amplitudes = x[:n] if bounds.positive else np.diff(np.concatenate([[0.0], x[: n - 1], [1.0]]))
    return GridAnswer(times, amplitudes, float(x[rows.shape[1] - 1]))


def _with_sizes(demands: Demands, rows: FloatArray, limit: FloatArray, n: int) -> tuple[Any, FloatArray, int]:
    """Add what bounds single amplitudes: ``|B_i - B_{i-1}| <= a``, and ``sum |A| = 1 + 2 sum A^- <= S``."""
    import scipy.sparse

    sparse: Any = scipy.sparse  # ships no types
    bounds = demands.bounds
    step: Any = sparse.diags_array([1.0, -1.0], offsets=[0, -1], shape=(n, n - 1))
    offset = np.zeros(n)  # A = step @ B + offset
    offset[-1] = 1.0
    empty: Any = sparse.csr_array((n, 1))
    blocks: list[list[Any]] = [[sparse.csr_array(rows[:, :-1]), sparse.csr_array(rows[:, -1:])]]
    if bounds.limits_size:
        blocks += [[step, empty], [-step, empty]]
        limit = np.concatenate([limit, bounds.max_amplitude - offset, bounds.max_amplitude + offset])
    extra = 0
    if bounds.max_sum_abs_amplitude < inf:
        extra = n
        blocks = [[*block, None] for block in blocks]
        blocks += [
            [-step, empty, -sparse.eye_array(n)],
            [sparse.csr_array((1, n - 1)), sparse.csr_array((1, 1)), sparse.csr_array(np.ones((1, n)))],
        ]
        limit = np.concatenate([limit, offset, [0.5 * (bounds.max_sum_abs_amplitude - 1.0)]])
    return sparse.block_array(blocks, format="csr"), limit, extra
