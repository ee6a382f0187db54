"""Margins: how far a stable loop is from oscillating, at the inputs of its drives.

The loop has as many channels as drives. Its Nyquist curves are the eigenvalues of the loop transfer matrix
along the unit circle: det(1 + k L) = 0 where k = -1/lambda, so a gain or a phase that changes alike in all
drives is told exactly by where they cross the negative real axis and the unit circle. What drives that change
unlike each other may do is told by the largest singular value of (1 + L)^-1, the maximum sensitivity.

A servo motor has a loop of its own besides, at its torque: there its inertia, its current loop and what the
controllers take them for come in (`servo_margins`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cnc_shape.arrays import BoolArray, FloatArray
from cnc_shape.controllers.control import Control
from cnc_shape.controllers.loop_model import LoopModel, loop_model, loop_transfer, rows_of
from cnc_shape.controllers.servo_model import at_ratio, torque_transfer
from cnc_shape.machine import Drive, ServoMotor

GRID = 160  # frequencies, evenly on a logarithmic scale up to half the sample rate
PER_DELAY = 10  # frequencies more for each sample of delay, evenly: each turns the curves by half a circle
MOST_EVEN = 2000  # ticks of delay that the frequencies of a motor's loop are made for
SLOWEST = 1e-2  # of the highest position gain: where the grid begins
REFINED = 6  # times, each by REFINEMENT
REFINEMENT = 8
NEAR = 2e-5  # - and rad: eigenvalues this near to a crossing cross there

NOTHING = 1e-9  # -, eigenvalues below are none

Eigenvalues = NDArray[np.complex128]  # (f,j)
Loci = Callable[[FloatArray], Eigenvalues]  # of frequencies (f,), rad/s
Sizes = Callable[[FloatArray], FloatArray]  # of (1 + L)^-1 at frequencies (f,), rad/s


@dataclass(frozen=True, slots=True)
class Margins:
    """How much a stable loop bears, all drives alike; infinite where there is no end."""

    gain: float  # -, factor of the gain above 1
    phase: float  # rad
    sensitivity: float  # -, largest singular value of (1 + L)^-1, joints counted in mm at the tool
    delay: float  # s


NO_LOOP = Margins(np.inf, np.inf, 1.0, np.inf)


def margins(
    drives: Sequence[Drive], control: Control, inverse_jacobian: FloatArray, tangent: FloatArray
) -> Margins:
    """Margins of a stable loop at a pose (c,c) and a tangent (3,); see `loop_model`."""
    return worst_margins(drives, control, inverse_jacobian, tangent[None])


def worst_margins(
    drives: Sequence[Drive], control: Control, inverse_jacobian: FloatArray, tangents: FloatArray
) -> Margins:
    """Smallest margins of a stable loop at a pose (c,c) over tangents (t,3), and largest sensitivity."""
    count = len(tangents)
    model = loop_model(drives, control, np.repeat(inverse_jacobian[None], count, axis=0), tangents)
    if not model.gains.size:
        return NO_LOOP
    return worst(_margins(rows_of(model, np.array([row]))) for row in range(count))


def worst(several: Iterable[Margins]) -> Margins:
    """Smallest of several margins, and largest sensitivity."""
    found = list(several)
    return Margins(
        min(one.gain for one in found),
        min(one.phase for one in found),
        max(one.sensitivity for one in found),
        min(one.delay for one in found),
    )


def servo_margins(motor: ServoMotor, control: Control, gain_ratio: float | None = None) -> Margins:
    """Margins of a motor's stable velocity and position loop at its torque; see `servo_model`.

    The position gain is that of `control`. The velocity gain is held at a ratio to the nominal one; without,
    where the compensation of `control` starts it.
    """
    control = control if gain_ratio is None else at_ratio(control, gain_ratio)
    ticks = motor.velocity_loop.ticks(control.sample_time)
    period = control.sample_time / ticks
    late = min(ticks * (control.delay_samples + 1), MOST_EVEN)

    def loci(frequencies: FloatArray) -> Eigenvalues:
        return torque_transfer(motor, control, np.exp(1j * period * frequencies))[:, None]

    def sizes(frequencies: FloatArray) -> FloatArray:
        return 1.0 / np.abs(1.0 + loci(frequencies)[:, 0])

    return _told(loci, sizes, _frequencies(period, control.position_gain, late))


def largest_factors(base: LoopModel, whole: LoopModel) -> FloatArray:
    """Factors by which what `whole` has more than `base` may grow before a pole leaves the unit circle, (n,).

    Both are the same loop at the same n pairs of pose and tangent; `base` is stable, or has no gain at all.
    Infinite where there is no end. The poles themselves are never computed: long delays are no burden.
    """
    grid = _grid(whole)
    identity = np.eye(whole.gains.size)

    def factor(row: int) -> float:
        rows = np.array([row])
        less, more = rows_of(base, rows), rows_of(whole, rows)

        def loci(frequencies: FloatArray) -> Eigenvalues:
            z = np.exp(1j * whole.sample_time * frequencies)
            held = loop_transfer(less, z)[0]
            other = loop_transfer(more, z)[0] - held
            return _eigenvalues(np.asarray(np.linalg.inv(identity + held), np.complex128) @ other)

        largest = _opposed(loci, grid, loci(grid))[1].max(initial=0.0)
        return 1.0 / largest if largest > NOTHING else np.inf

    return np.array([factor(row) for row in range(len(whole))])


def _margins(model: LoopModel) -> Margins:
    identity = np.eye(model.gains.size)
    scale = model.lever[0][:, None] / model.lever[0]

    def transfer(frequencies: FloatArray) -> NDArray[np.complex128]:
        return loop_transfer(model, np.exp(1j * model.sample_time * frequencies))[0]

    def loci(frequencies: FloatArray) -> Eigenvalues:
        return _eigenvalues(transfer(frequencies))

    def sizes(frequencies: FloatArray) -> FloatArray:
        smallest = np.linalg.svd(identity + scale * transfer(frequencies), compute_uv=False)[:, -1]
        return np.asarray(1.0 / smallest, dtype=np.float64)

    return _told(loci, sizes, _grid(model))


def _told(loci: Loci, sizes: Sizes, grid: FloatArray) -> Margins:
    """Margins that Nyquist curves leave, and the largest of the sizes of (1 + L)^-1."""
    curves = loci(grid)
    opposed, reached = _opposed(loci, grid, curves)
    turned = _crossings(loci, grid, curves, _over_unit_circle)
    here = loci(turned)
    circled = np.abs(np.abs(here) - 1.0) < NEAR
    angle = np.angle(-here[circled])
    delay = np.mod(angle, 2.0 * np.pi) / np.broadcast_to(turned[:, None], here.shape)[circled]
    return Margins(
        float((1.0 / reached[reached < 1.0]).min(initial=np.inf)),
        float(np.abs(angle).min(initial=np.inf)),
        _largest(sizes, np.sort(np.concatenate([grid, opposed, turned]))),
        float(delay.min(initial=np.inf)),
    )


def _grid(model: LoopModel) -> FloatArray:
    """Frequencies up to half the sample rate, rad/s, so dense that the curves turn little between them."""
    return _frequencies(model.sample_time, float(model.gains.max()), model.delay_samples)


def _frequencies(period: float, gain: float, late: int) -> FloatArray:
    """Frequencies of a loop with a position gain in 1/s that ticks every `period`, `late` ticks late."""
    end = np.pi / period
    slowest = SLOWEST * min(gain or end, end)
    even = np.linspace(0.0, end, PER_DELAY * late + 2)[1:]
    grid = np.union1d(np.geomspace(slowest, end, GRID), even)
    grid[-1] = end * (1.0 - 1e-9)
    return grid


def _eigenvalues(transfer: NDArray[np.complex128]) -> Eigenvalues:
    """Eigenvalues (f,j) of matrices (f,j,j); those that are but round-off become NOTHING."""
    found = np.asarray(np.linalg.eigvals(transfer), dtype=np.complex128)
    return np.where(np.abs(found) < NOTHING, NOTHING, found)


def _opposed(loci: Loci, grid: FloatArray, curves: Eigenvalues) -> tuple[FloatArray, FloatArray]:
    """Frequencies at which eigenvalues pass the negative real axis, and their sizes there.

    At half the sample rate all curves are real: they may end on the negative axis without passing it.
    """
    frequencies = _crossings(loci, grid, curves, _over_negative_axis)
    here = np.concatenate([curves[-1:], loci(frequencies)])
    return frequencies, np.abs(here[np.abs(np.angle(-here)) < NEAR])


def _crossings(
    loci: Loci, grid: FloatArray, curves: Eigenvalues, over: Callable[[Eigenvalues], BoolArray]
) -> FloatArray:
    """Frequencies at which an eigenvalue passes `over` a line, rad/s."""
    passed = np.flatnonzero(over(curves))
    low, high = grid[passed], grid[passed + 1]
    share = np.linspace(0.0, 1.0, REFINEMENT + 1)
    for _ in range(REFINED if passed.size else 0):
        finer = (low[:, None] + share * (high - low)[:, None]).ravel()
        passed = np.flatnonzero(over(loci(finer)))
        passed = passed[(passed + 1) % share.size != 0]  # not from one bracket to the next
        low, high = finer[passed], finer[passed + 1]
    return 0.5 * (low + high)


def _over_unit_circle(curves: Eigenvalues) -> BoolArray:
    """Steps of the grid (f-1,) in which an eigenvalue passes the unit circle: sorted sizes are continuous."""
    outside = np.sort(np.abs(curves), axis=1) > 1.0
    return (outside[1:] != outside[:-1]).any(axis=1)


def _over_negative_axis(curves: Eigenvalues) -> BoolArray:
    """Steps of the grid (f-1,) in which an eigenvalue passes the negative real axis.

    Sorted angles are continuous around the circle but for one eigenvalue passing the cut, which shifts all
    by one place: the shift at which they move least is the one that took place.
    """
    angle = np.sort(np.angle(-curves), axis=1)  # 0 on the negative axis, the cut on the positive one
    before, after = angle[:-1], angle[1:]
    shifts = np.stack([np.roll(after, shift, axis=1) for shift in range(angle.shape[1])])
    moved = np.mod(shifts - before + np.pi, 2.0 * np.pi) - np.pi
    least = np.abs(moved).sum(axis=2).argmin(axis=0)
    step = moved[least, np.arange(len(before))]
    return ((before > 0.0) != (before + step > 0.0)).any(axis=1)


def _largest(sizes: Sizes, grid: FloatArray) -> float:
    """Largest of the sizes over frequency, around the highest point of the grid."""
    here = sizes(grid)
    largest = here.max()
    for _ in range(REFINED):
        top = int(np.argmax(here))
        around = grid[max(top - 1, 0) : top + 2]
        grid = np.linspace(float(around[0]), float(around[-1]), 2 * REFINEMENT + 1)
        here = sizes(grid)
        largest = max(largest, here.max())
    return float(largest)
