"""The equations of a multi-mode shaper, and their solutions from many starts at once.

A shaper leaves nothing of a mode with ``s = omega (zeta + j sqrt(1 - zeta^2))`` if
``sum A_i e^{s t_i} = 0``, and nothing of its derivative of order d by s if ``sum A_i t_i^d e^{s t_i} = 0``.
With K such complex conditions and ``sum A_i = 1``, K + 1 impulses (K + 1 amplitudes, K times) have as many
equations as unknowns: isolated solutions, usually many.

Modes that lie close together make almost equal equations. Their differences do not: the span of
e^{s_0 t}, e^{s_1 t}, ... is that of the divided differences of e^{st} at s_0, s_1, ..., which stay
independent as the modes meet and end as the derivatives. Around the centre c of such a cluster they are
``e^{c t} p(t)`` with

    p_j(t) = sum_m h_m(s_0 - c, ..., s_j - c) t^{m+j} / (m+j)!

(h_m: complete homogeneous symmetric polynomial of degree m). A mode alone has p = 1, its derivatives
t^j / j!; so one form serves distinct, close and repeated modes alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from cnc_shape.arrays import FloatArray

ComplexArray: TypeAlias = NDArray[np.complex128]

CLUSTER_RADIUS = 0.25  # -, of |s - s_0| in units of the search: closer modes share a cluster
SERIES_TERMS = 26  # of e^{(s - c) t}: rounding at |s - c| t = 2
LONGEST_TIME = 8.0  # in units of the search: up to it the series is good
ROUNDING = 1e-18  # -, of a term of the series
RIDGE = 1e-6  # -, keeps the first amplitudes tame where times coincide
ITERATIONS = 40  # of Levenberg-Marquardt
LARGEST_STEP = 0.2  # -, of a time in one iteration, in units of the search
STEEPEST_DAMPING = 1e8  # -, a start that needs more has failed
FLAT_DIRECTION = 1e-13  # -, damping of an unknown that changes nothing: the time of an impulse of 0
CONVERGED = 1e-20  # -, |F|^2
SMALLEST_SCALE = 1e-12  # -, of a column of the Jacobian
RANK_TOLERANCE = 1e-13  # -, of the scaled Jacobian
POLISHING_STEPS = 12  # of Newton; quadratic, three or four do


@dataclass(frozen=True, eq=False, slots=True)
class Conditions:
    """``sum_i A_i e^{c_k t_i} p_k(t_i) = 0`` for every row k, in the time unit of the search."""

    centres: ComplexArray  # (k,) c
    polynomials: ComplexArray  # (k,q) p, ascending powers

    @property
    def impulses(self) -> int:
        """How many impulses have as many unknowns as equations."""
        return self.centres.size + 1

    def basis(self, times: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Values and time derivatives of ``e^{c t} p(t)``, each (b,k,m), for `times` (b,m).

        Every row is scaled by its decay up to the last time, ``e^{-Re(c) t_N}``: V without overflow.
        """
        last = times.max(axis=1)[:, None, None]
        t = times[:, None, :]
        c = self.centres[None, :, None]
        wave = np.exp(c * t - c.real * last)
        if self.polynomials.shape[1] == 1:
            value = wave * self.polynomials[:, 0, None]
            return value, c * value
        p = np.zeros(wave.shape, dtype=np.complex128)
        slope = np.zeros_like(p)
        for coefficient in self.polynomials.T[::-1]:
            slope = slope * t + p
            p = p * t + coefficient[:, None]
        return wave * p, wave * (c * p + slope)


def conditions(poles: Sequence[complex], orders: Sequence[int]) -> Conditions:
    """Zero vibration at `poles` (s, in the time unit of the search), with derivatives up to `orders`."""
    clusters: list[list[tuple[complex, int]]] = []
    for pole, order in zip(poles, orders, strict=True):
        for cluster in clusters:
            if abs(pole - cluster[0][0]) <= CLUSTER_RADIUS:
                cluster.append((pole, order))
                break
        else:
            clusters.append([(pole, order)])
    centres: list[complex] = []
    rows: list[ComplexArray] = []
    for cluster in clusters:
        centre = cluster[0][0] + sum(pole - cluster[0][0] for pole, _ in cluster) / len(cluster)
        nodes = [pole - centre for pole, order in cluster for _ in range(order + 1)]
        differences = _divided_differences(nodes)
        centres += [centre] * len(nodes)
        rows += list(differences)
    weight = LONGEST_TIME ** np.arange(max(row.size for row in rows))
    width = max(int(np.flatnonzero(np.abs(row) * weight[: row.size] > ROUNDING)[-1]) + 1 for row in rows)
    polynomials = np.zeros((len(rows), width), dtype=np.complex128)
    for line, row in zip(polynomials, rows, strict=True):
        line[: min(width, row.size)] = row[:width]
    return Conditions(np.array(centres), polynomials)


def _divided_differences(nodes: Sequence[complex]) -> ComplexArray:
    """Power series in t of the divided differences of ``e^{x t}`` at the first 1, 2, ... `nodes` x."""
    count = len(nodes)
    symmetric = np.zeros(SERIES_TERMS, dtype=np.complex128)
    symmetric[0] = 1.0
    factorial = np.cumprod(np.concatenate([[1.0], np.arange(1.0, SERIES_TERMS + count)]))
    rows = np.zeros((count, SERIES_TERMS + count), dtype=np.complex128)
    for j, node in enumerate(nodes):
        for m in range(1, SERIES_TERMS):  # h_m(x_0..x_j) = h_m(x_0..x_{j-1}) + x_j h_{m-1}(x_0..x_j)
            symmetric[m] += node * symmetric[m - 1]
        rows[j, j : j + SERIES_TERMS] = symmetric / factorial[j : j + SERIES_TERMS]
    return rows


def residual_and_jacobian(
    rows: Conditions, times: FloatArray, amplitudes: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """F (b,2k+1) and dF/d(amplitudes, times but the first) (b,2k+1,2m-1) at `times`, `amplitudes` (b,m)."""
    value, slope = rows.basis(times)
    batch, k, m = value.shape
    jacobian = np.empty((batch, 2 * k + 1, 2 * m - 1))
    jacobian[:, 0, :m] = 1.0
    jacobian[:, 0, m:] = 0.0
    jacobian[:, 1 : k + 1, :m] = value.real
    jacobian[:, k + 1 :, :m] = value.imag
    moved = slope[:, :, 1:] * amplitudes[:, None, 1:]
    jacobian[:, 1 : k + 1, m:] = moved.real
    jacobian[:, k + 1 :, m:] = moved.imag
    residual = np.einsum("brm,bm->br", jacobian[:, :, :m], amplitudes)
    residual[:, 0] -= 1.0
    return residual, jacobian


def least_squares_amplitudes(rows: Conditions, times: FloatArray) -> FloatArray:
    """Amplitudes (b,m) that come closest to the conditions at `times` (b,m)."""
    m = times.shape[1]
    _, jacobian = residual_and_jacobian(rows, times, np.zeros_like(times))
    linear = jacobian[:, :, :m]
    normal = linear.transpose(0, 2, 1) @ linear + RIDGE * np.eye(m)
    return np.asarray(np.linalg.solve(normal, linear[:, 0, :, None])[:, :, 0], dtype=np.float64)


def solve_from(rows: Conditions, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Levenberg-Marquardt from all starts `times` (b,m) at once.

    Returns
    -------
    tuple
        Times, not yet sorted, and amplitudes of those that converged, each (c,m).
    """
    m = times.shape[1]
    x = np.concatenate([least_squares_amplitudes(rows, times), times[:, 1:]], axis=1)
    damping = np.full(len(x), 1e-2)
    residual, jacobian = _at(rows, x, m)
    cost = (residual**2).sum(axis=1)
    found: list[FloatArray] = []
    for _ in range(ITERATIONS):
        done = cost < CONVERGED
        found.append(x[done])
        going = ~done & (damping < STEEPEST_DAMPING)
        if not going.any():
            break
        x, damping, residual, jacobian, cost = (
            array[going] for array in (x, damping, residual, jacobian, cost)
        )
        transposed = jacobian.transpose(0, 2, 1)
        normal = transposed @ jacobian
        diagonal = np.einsum("bii->bi", normal)
        floor = FLAT_DIRECTION * diagonal.sum(axis=1, keepdims=True)
        diagonal += damping[:, None] * diagonal + floor
        step = -np.linalg.solve(normal, (transposed @ residual[:, :, None]))[:, :, 0]
        longest = np.abs(step[:, m:]).max(axis=1, initial=0.0)
        step *= np.minimum(1.0, LARGEST_STEP / np.maximum(longest, 1e-300))[:, None]
        tried = x + step
        new_residual, new_jacobian = _at(rows, tried, m)
        new_cost = (new_residual**2).sum(axis=1)
        better = new_cost < cost
        x = np.where(better[:, None], tried, x)
        residual = np.where(better[:, None], new_residual, residual)
        jacobian = np.where(better[:, None, None], new_jacobian, jacobian)
        cost = np.where(better, new_cost, cost)
        damping = np.where(better, damping * 0.1, damping * 8.0)
    else:
        found.append(x[cost < CONVERGED])
    solutions = np.concatenate(found)
    return np.concatenate([np.zeros((len(solutions), 1)), solutions[:, m:]], axis=1), solutions[:, :m]


def polish(
    rows: Conditions, times: FloatArray, amplitudes: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Newton to the last digit from one solution (m,), by least squares if it has fewer impulses.

    Returns
    -------
    tuple
        Times, amplitudes, and the largest |F| left.
    """
    m = times.size
    x = np.concatenate([amplitudes, times[1:]])
    residual, jacobian = _at(rows, x[None], m)
    error = float(np.abs(residual).max())
    for _ in range(POLISHING_STEPS):
        scale = np.sqrt((jacobian[0] ** 2).sum(axis=0)).clip(min=SMALLEST_SCALE)
        step = cast("FloatArray", np.linalg.lstsq(jacobian[0] / scale, residual[0], rcond=RANK_TOLERANCE)[0])
        tried = x - step / scale
        new_residual, new_jacobian = _at(rows, tried[None], m)
        new_error = float(np.abs(new_residual).max())
        if not new_error < error:
            break
        x, residual, jacobian, error = tried, new_residual, new_jacobian, new_error
    return np.concatenate([[0.0], x[m:]]), x[:m], error


def _at(rows: Conditions, x: FloatArray, m: int) -> tuple[FloatArray, FloatArray]:
    """F and its Jacobian at unknowns `x` (b,2m-1): the amplitudes, then the times but the first."""
    times = np.concatenate([np.zeros((len(x), 1)), x[:, m:]], axis=1)
    return residual_and_jacobian(rows, times, x[:, :m])
