"""The family of specified-duration shapers: all impulse vectors that meet the conditions of paper 002.

For a duration of ``TN`` damped periods there are N impulses, N = 3 up to one period and ``ceil(2 TN) + 1``
beyond, and K = N - 2 conditions (K = 1 for N = 3): ``sum I_i theta_i^k e^{j theta_i} = 0`` for k = 0 ... K-1
(paper 002, eqs 5, 9, 11). With the sum and the last time given, one freedom is left,
``lambda = I_1 / (I_1 + I_N)`` between 0 and 1; lambda and 1 - lambda mirror each other. The vectors of the
family know no damping.

N = 3 is a closed form. For N > 3 the member of lambda = 1/2 is followed from the derivative of ZV with as
many impulses, half a period apart, down to the duration wanted, and the others from it by steps of lambda.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import ceil, comb, pi

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.errors import InfeasibleError

ON_THE_EDGE = 1e-9  # of a period: durations this near to a multiple of a half belong to it
SHARE_STEP, SMALLEST_STEP = 0.0025, 1e-5  # of lambda
SHRINK = 0.8  # of the way from a duration down to where two impulses meet, a step
NEWTON_STEPS = 30
CONVERGED = 1e-13
LARGEST_ERROR = 1e-10  # of the conditions, where Newton's method counts as converged

# (m,) lambda -> (m,N) angles, rad, and (m,N) magnitudes; rows that do not exist are NaN
Family = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


def impulse_count(periods: float) -> int:
    """N of a duration in damped periods (paper 002, section 3)."""
    return 3 if periods <= 1.0 + ON_THE_EDGE else ceil(2.0 * (periods - ON_THE_EDGE)) + 1


def family(periods: float) -> Family:
    """All impulse vectors of a duration of `periods` damped periods.

    Raises
    ------
    InfeasibleError
        Two impulses so close that they cannot be told apart.
    """
    if impulse_count(periods) == 3:
        return partial(_three_impulses, 2.0 * pi * periods)
    return _Followed.of(periods).at


def _three_impulses(last: float, share: FloatArray) -> tuple[FloatArray, FloatArray]:
    """N = 3: the middle vector closes ``R = lambda + (1 - lambda) e^{j theta_3}`` to zero.

    Up to half a period it does so by a negative impulse at the angle of R, beyond by a positive one opposite.
    """
    closing = share + (1.0 - share) * np.exp(1j * last)
    negative = last <= pi
    size = np.abs(closing)
    angle = np.angle(closing) if negative else np.mod(np.angle(-closing), 2.0 * pi)
    zero = np.zeros_like(share)
    angles = np.stack([zero, angle, np.full_like(share, last)], axis=1)
    magnitudes = np.stack([share, -size if negative else size, 1.0 - share], axis=1)
    return angles, magnitudes


@dataclass(frozen=True, eq=False, slots=True)
class _Followed:
    """Members for lambda from 1/2 on in steps, from which any other is a few steps of Newton's method away.

    A row is ``(I_1 ... I_N, x_2 ... x_{N-1})``, ``x_i = theta_i / theta_N``.
    """

    last: float  # rad, theta_N
    shares: FloatArray  # (g,) lambda, from 1/2
    rows: FloatArray  # (g, 2N-2)

    @classmethod
    def of(cls, periods: float) -> _Followed:
        """Follow the family of a duration."""
        middle = _symmetric_member(periods)
        last = 2.0 * pi * periods
        shares, rows, step = [0.5], [middle], SHARE_STEP
        while step >= SMALLEST_STEP and shares[-1] < 1.0 - SHARE_STEP:
            share = min(shares[-1] + step, 1.0 - SHARE_STEP)
            row = _solve(rows[-1], last, share)
            if row is None:
                step *= 0.5
                continue
            shares.append(share)
            rows.append(row)
            step = min(2.0 * step, SHARE_STEP)
        return cls(last, np.array(shares), np.array(rows))

    def at(self, share: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Members of lambda = `share`, (m,)."""
        n = self.rows.shape[1] // 2 + 1
        angles, magnitudes = np.full((share.size, n), np.nan), np.full((share.size, n), np.nan)
        for k, wanted in enumerate(share.tolist()):
            upper = max(wanted, 1.0 - wanted)
            nearest = int(np.abs(self.shares - upper).argmin())
            row = _solve(self.rows[nearest], self.last, upper)
            if row is None:
                continue
            theta = self.last * np.concatenate([[0.0], row[n:], [1.0]])
            if wanted < 0.5:
                angles[k], magnitudes[k] = self.last - theta[::-1], row[:n][::-1]
            else:
                angles[k], magnitudes[k] = theta, row[:n]
        return angles, magnitudes


def _symmetric_member(periods: float) -> FloatArray:
    """The member of lambda = 1/2: from ZV's derivative at (N - 1) / 2 periods down to `periods`."""
    n = impulse_count(periods)
    edge, top = 0.5 * (n - 2), 0.5 * (n - 1)
    magnitudes = np.array([comb(n - 1, i) for i in range(n)]) / 2.0 ** (n - 1)
    row = np.concatenate([magnitudes, np.arange(1, n - 1) / (n - 1)])
    reached = top
    while reached > periods + ON_THE_EDGE:
        reached = max(periods, edge + SHRINK * (reached - edge))
        found = _solve(row, 2.0 * pi * reached, 0.5)
        if found is None:
            raise InfeasibleError(
                f"two impulses of a shaper of {periods:g} damped periods nearly coincide",
                hint=f"{edge:g} periods have one impulse less",
            )
        row = found
    return row


def _solve(start: FloatArray, last: float, share: float) -> FloatArray | None:
    """Newton's method for the conditions, or None where it does not end at impulses in order."""
    row = start
    for _ in range(NEWTON_STEPS):
        value, slope = _conditions(row, last, share)
        try:
            step = np.linalg.solve(slope, value)
        except np.linalg.LinAlgError:
            return None
        row = row - step
        if not np.isfinite(row).all() or np.abs(row).max() > 1e6:
            return None
        if np.abs(step).max() <= CONVERGED:
            break
    n = row.size // 2 + 1
    inner = row[n:]
    in_order = inner[0] > 0.0 and inner[-1] < 1.0 and bool((np.diff(inner) > 0.0).all())
    return row if in_order and np.abs(_conditions(row, last, share)[0]).max() <= LARGEST_ERROR else None


def _conditions(row: FloatArray, last: float, share: float) -> tuple[FloatArray, FloatArray]:
    """The 2N - 2 conditions and their derivatives by the unknowns; (2N-2,) and (2N-2,2N-2)."""
    n = row.size // 2 + 1
    magnitudes = row[:n]
    x = np.concatenate([[0.0], row[n:], [1.0]])
    swing = np.exp(1j * last * x)
    order = np.arange(n - 2, dtype=np.float64)[:, None]
    power = x**order
    by_angle = np.where(order > 0, order * x ** np.maximum(order - 1.0, 0.0), 0.0) + 1j * last * power
    left, slope = power * swing, magnitudes * by_angle * swing
    closing = left @ magnitudes
    value = np.concatenate(
        [
            closing.real,
            closing.imag,
            [magnitudes.sum() - 1.0, magnitudes[0] * (1.0 - share) - share * magnitudes[-1]],
        ]
    )
    ends = np.zeros((2, 2 * n - 2))
    ends[0, :n] = 1.0
    ends[1, 0], ends[1, n - 1] = 1.0 - share, -share
    complex_rows = np.concatenate([left, slope[:, 1:-1]], axis=1)
    return value, np.concatenate([complex_rows.real, complex_rows.imag, ends])
