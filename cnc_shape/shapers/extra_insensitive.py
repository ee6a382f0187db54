"""Extra-insensitive shapers: a tolerated vibration at the mode buys a wide band in which no more is left.

Undamped, an EI shaper of h humps has h + 2 impulses half a period apart whose V is a Chebyshev polynomial,
``V(r) = v |T_{h+1}(x0 cos(pi r / 2))|`` with ``x0 = cosh(acosh(1 / v) / (h + 1))``: it touches the tolerance
v at all humps and is zero h + 1 times between them, as in a Dolph-Chebyshev window.

With damping there is no closed form. The conditions are kept and the damping is raised in steps: V = v with
zero slope at every hump, V = 0 between them, and at the mode itself the middle hump (h odd) or the middle
zero (h even). Unknown are amplitudes, times, humps and zeros: as many as equations.

The zero above the last hump moves up with damping, and the conditions cannot be met for ever. Where they end
the shaper goes on with one impulse, one zero and one hump less: above the mode damping itself keeps V low.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import acosh, cosh, pi, sqrt
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.errors import InfeasibleError, OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers.shaper import Shaper

if TYPE_CHECKING:
    from collections.abc import Callable

LARGEST_STEP = 0.02  # -, of the damping ratio
SMALLEST_STEP = 1e-3
RESIDUAL = 1e-10  # -, of the equations, where a solution counts as one
LEAST_TOLERANCE, LARGEST_TOLERANCE = 1e-6, 0.9


@dataclass(frozen=True, slots=True)
class _Design:
    """Impulses and curve of V of an EI shaper, for a mode of 1 Hz undamped."""

    amplitudes: FloatArray  # (n,)
    times: FloatArray  # (n,) s, the first 0
    zeros: FloatArray  # (n-1,) frequency ratios where V = 0
    humps: FloatArray  # (n-2,) frequency ratios where V = v with zero slope
    middle: int  # row of the hump (odd) or zero (even number of humps at first) that sits at ratio 1
    middle_is_hump: bool

    @property
    def can_lose_one(self) -> bool:
        """Whether the middle is not the last."""
        last = (self.humps if self.middle_is_hump else self.zeros).size - 1
        return self.middle < last

    def unknowns(self) -> FloatArray:
        """What is solved for, in one row; zeros as their inverse, which passes through infinity."""
        zeros, humps = 1.0 / self.zeros, self.humps
        if self.middle_is_hump:
            humps = np.delete(humps, self.middle)
        else:
            zeros = np.delete(zeros, self.middle)
        return np.concatenate([self.amplitudes, self.times[1:], zeros, humps])

    def with_unknowns(self, row: FloatArray) -> _Design:
        """The design that `row` stands for."""
        n = self.amplitudes.size
        zero_count = n - 1 if self.middle_is_hump else n - 2
        amplitudes, times, inverse, humps = np.split(row, [n, 2 * n - 1, 2 * n - 1 + zero_count])
        if self.middle_is_hump:
            humps = np.insert(humps, self.middle, 1.0)
        else:
            inverse = np.insert(inverse, self.middle, 1.0)
        return _Design(
            amplitudes, np.append(0.0, times), 1.0 / inverse, humps, self.middle, self.middle_is_hump
        )

    def without_the_last(self) -> _Design:
        """The last two impulses as one, the last zero and hump gone: where to start from for the next."""
        amplitudes = np.append(self.amplitudes[:-2], self.amplitudes[-2:].sum())
        times = np.append(self.times[:-2], self.times[-1])
        return _Design(amplitudes, times, self.zeros[:-1], self.humps[:-1], self.middle, self.middle_is_hump)

    def equations(self, damping_ratio: float, tolerance: float) -> FloatArray:
        """What must be zero: the sum, V at the zeros, V and its slope at the humps (spec, section 2)."""
        times = self.times
        exponent = (
            2.0 * pi * (damping_ratio * (times - times[-1]) + 1j * sqrt(1.0 - damping_ratio**2) * times)
        )
        at_zeros = np.exp(np.outer(self.zeros, exponent)) @ self.amplitudes
        growth = np.exp(np.outer(self.humps, exponent))
        at_humps, slope = growth @ self.amplitudes, growth @ (self.amplitudes * exponent)
        return np.concatenate(
            [
                [self.amplitudes.sum() - 1.0],
                at_zeros.real,
                at_zeros.imag,
                np.abs(at_humps) ** 2 / tolerance**2 - 1.0,
                (at_humps.conj() * slope).real / tolerance,
            ]
        )

    @property
    def in_order(self) -> bool:
        """Whether impulses, zeros and humps are where they belong."""
        return bool(
            (np.diff(self.times) > 0.0).all()
            and (self.amplitudes > 0.0).all()
            and (self.zeros > 0.0).all()
            and (np.diff(self.zeros) > 0.0).all()
        )


def extra_insensitive(mode: Mode, *, humps: int, vibration_tolerance: float) -> Shaper:
    """EI shaper of any number of humps, exact with damping.

    Parameters
    ----------
    mode
        The vibration.
    humps
        1 for EI, 2 for two-hump EI, and on.
    vibration_tolerance
        V at the humps, 0.05 for 5 %.

    Raises
    ------
    OptionError
        A tolerance outside 1e-6 ... 0.9.
    InfeasibleError
        More damping than the conditions can be met with.
    """
    if not LEAST_TOLERANCE <= vibration_tolerance <= LARGEST_TOLERANCE:
        raise OptionError(
            f"the vibration tolerance of an EI shaper lies between {LEAST_TOLERANCE:g} and "
            f"{LARGEST_TOLERANCE:g}, not {vibration_tolerance:g}",
            hint="5 % is 0.05",
            argument="vibration_tolerance",
        )
    design = _raise_damping(_undamped(humps, vibration_tolerance), mode.damping_ratio, vibration_tolerance)
    amplitudes = design.amplitudes / design.amplitudes.sum()
    return Shaper(times=frozen(design.times / mode.natural_frequency), amplitudes=frozen(amplitudes))


def _undamped(humps: int, tolerance: float) -> _Design:
    order = humps + 1
    stretch = cosh(acosh(1.0 / tolerance) / order)
    zeros = 2.0 / pi * np.arccos(np.cos((np.arange(order) + 0.5) * pi / order) / stretch)
    tops = 2.0 / pi * np.arccos(np.cos(np.arange(1, order) * pi / order) / stretch)
    amplitudes = np.poly(np.exp(1j * pi * zeros)).real
    middle_is_hump = humps % 2 == 1
    return _Design(
        amplitudes / amplitudes.sum(),
        np.linspace(0.0, 0.5 * order, order + 1),
        zeros,
        tops,
        humps // 2,
        middle_is_hump,
    )


def _raise_damping(design: _Design, damping_ratio: float, tolerance: float) -> _Design:
    """Follow the solution from no damping to `damping_ratio`."""
    from scipy.optimize import root  # pyright: ignore[reportUnknownVariableType]  # scipy ships no types

    find = cast("Callable[..., Any]", root)
    reached, step = 0.0, LARGEST_STEP
    while reached < damping_ratio:
        target = min(damping_ratio, reached + step)
        found = _solved(design, target, tolerance, find)
        if found is not None:
            design, reached, step = found, target, min(1.5 * step, LARGEST_STEP)
        elif step > SMALLEST_STEP:
            step *= 0.5
        else:
            shorter = (
                _solved(design.without_the_last(), reached, tolerance, find) if design.can_lose_one else None
            )
            if shorter is None:
                raise InfeasibleError(
                    f"this shaper exists up to a damping ratio of {reached:.2g}, not for {damping_ratio:g}",
                    hint="with so much damping zv or zvd is as insensitive",
                )
            design, step = shorter, LARGEST_STEP
    return design


def _solved(
    start: _Design, damping_ratio: float, tolerance: float, find: Callable[..., Any]
) -> _Design | None:
    """The solution near `start`, or None."""

    def equations(row: FloatArray) -> FloatArray:
        return start.with_unknowns(row).equations(damping_ratio, tolerance)

    solution = np.asarray(find(equations, start.unknowns(), tol=1e-14).x, dtype=np.float64)
    if not np.isfinite(solution).all():
        return None
    design = start.with_unknowns(solution)
    return design if design.in_order and np.abs(equations(solution)).max() <= RESIDUAL else None


def ei(mode: Mode, *, vibration_tolerance: float = 0.05) -> Shaper:
    """Extra insensitive: V = tolerance at the mode, zero on either side of it; as long as ZVD."""
    return extra_insensitive(mode, humps=1, vibration_tolerance=vibration_tolerance)


def two_hump_ei(mode: Mode, *, vibration_tolerance: float = 0.05) -> Shaper:
    """Two-hump EI: V = 0 at the mode, a hump at the tolerance on either side; about 1.5 periods long."""
    return extra_insensitive(mode, humps=2, vibration_tolerance=vibration_tolerance)


def three_hump_ei(mode: Mode, *, vibration_tolerance: float = 0.05) -> Shaper:
    """Three-hump EI: V = tolerance at the mode and on two humps beside it; about two periods long."""
    return extra_insensitive(mode, humps=3, vibration_tolerance=vibration_tolerance)
