"""Margins: how far a stable loop is from oscillating, at the inputs of its drives.

The loop has as many channels as drives. Its Nyquist curves are the eigenvalues of the loop transfer matrix
along the unit circle: det(1 + k L) = 0 where k = -1/lambda, so a gain or a phase that changes alike in all
drives is told exactly by where they cross the negative real axis and the unit circle. What drives that change
unlike each other may do is told by the largest singular value of (1 + L)^-1, the maximum sensitivity.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cnc_shape.arrays import BoolArray, FloatArray
from cnc_shape.controllers.control import Control
from cnc_shape.controllers.loop_model import LoopModel, loop_model, loop_transfer
from cnc_shape.machine import Drive

GRID = 160  # frequencies, evenly on a logarithmic scale up to half the sample rate
SLOWEST = 1e-2  # of the highest position gain: where the grid begins
REFINED = 5  # times, each by REFINEMENT
REFINEMENT = 8
NEAR = 1e-3  # - and rad: eigenvalues this near to a crossing cross there

Eigenvalues = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Margins:
    """How much a stable loop bears, all drives alike; infinite where there is no end."""

    gain: float  # -, factor of the gain above 1
    phase: float  # rad
    sensitivity: float  # -, largest singular value of (1 + L)^-1 over frequency
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
    found = NO_LOOP
    for tangent in tangents:
        model = loop_model(drives, control, inverse_jacobian[None], tangent[None])
        if not model.gains.size:
            return NO_LOOP
        here = _margins(model)
        found = Margins(
            min(found.gain, here.gain),
            min(found.phase, here.phase),
            max(found.sensitivity, here.sensitivity),
            min(found.delay, here.delay),
        )
    return found


def _margins(model: LoopModel) -> Margins:
    end = np.pi / model.sample_time
    slowest = SLOWEST * min(float(model.gains.max()) or end, end)
    grid = np.geomspace(slowest, end * (1.0 - 1e-9), GRID)
    loci = _loci(model, grid)
    # at half the sample rate the loop is real: a curve may end on the negative axis without crossing it
    last = _loci_at(model, np.array([-1.0 + 0.0j]))[0]
    gains, phases, delays = [np.inf], [np.inf], [np.inf]
    gains.extend((-1.0 / last.real[(last.real < 0.0) & (last.real > -1.0)]).tolist())
    opposed = _crossings(model, grid, loci, _over_negative_axis)
    for frequency in opposed:
        here = _loci(model, np.array([frequency]))[0]
        size = np.abs(here)[np.abs(np.angle(-here)) < NEAR]
        gains.extend((1.0 / size[size < 1.0]).tolist())
    turned = _crossings(model, grid, loci, _over_unit_circle)
    for frequency in turned:
        here = _loci(model, np.array([frequency]))[0]
        angle = np.angle(-here)[np.abs(np.abs(here) - 1.0) < NEAR]
        phases.extend(np.abs(angle).tolist())
        delays.extend((np.mod(angle, 2.0 * np.pi) / frequency).tolist())
    watched = np.sort(np.concatenate([grid, opposed, turned]))
    return Margins(min(gains), min(phases), _sensitivity(model, watched), min(delays))


def _loci(model: LoopModel, frequencies: FloatArray) -> Eigenvalues:
    """Eigenvalues of L at frequencies (f,) rad/s, (f,j)."""
    return _loci_at(model, np.exp(1j * model.sample_time * frequencies))


def _loci_at(model: LoopModel, z: NDArray[np.complex128]) -> Eigenvalues:
    return np.asarray(np.linalg.eigvals(loop_transfer(model, z)[0]), dtype=np.complex128)


def _crossings(
    model: LoopModel, grid: FloatArray, loci: Eigenvalues, over: Callable[[Eigenvalues], BoolArray]
) -> list[float]:
    """Frequencies at which an eigenvalue passes `over` a line, rad/s."""
    brackets = [grid[i : i + 2] for i in np.flatnonzero(over(loci))]
    for _ in range(REFINED):
        finer: list[FloatArray] = [np.linspace(low, high, REFINEMENT + 1) for low, high in brackets]
        brackets = [inner[i : i + 2] for inner in finer for i in np.flatnonzero(over(_loci(model, inner)))]
    return [float(bracket.mean()) for bracket in brackets]


def _over_unit_circle(loci: Eigenvalues) -> BoolArray:
    """Steps of the grid (f-1,) in which an eigenvalue passes the unit circle: sorted sizes are continuous."""
    outside = np.sort(np.abs(loci), axis=1) > 1.0
    return (outside[1:] != outside[:-1]).any(axis=1)


def _over_negative_axis(loci: Eigenvalues) -> BoolArray:
    """Steps of the grid (f-1,) in which an eigenvalue passes the negative real axis.

    Sorted angles are continuous around the circle but for one eigenvalue passing the cut, which shifts all
    by one place: the shift at which they move least is the one that took place.
    """
    angle = np.sort(np.angle(-loci), axis=1)  # 0 on the negative axis, the cut on the positive one
    before, after = angle[:-1], angle[1:]
    shifts = np.stack([np.roll(after, shift, axis=1) for shift in range(angle.shape[1])])
    moved = np.mod(shifts - before + np.pi, 2.0 * np.pi) - np.pi
    least = np.abs(moved).sum(axis=2).argmin(axis=0)
    step = moved[least, np.arange(len(before))]
    return ((before > 0.0) != (before + step > 0.0)).any(axis=1)


def _sensitivity(model: LoopModel, grid: FloatArray) -> float:
    """Largest singular value of (1 + L)^-1 over frequency, around the highest point of the grid."""
    identity = np.eye(model.gains.size)

    def size(frequencies: FloatArray) -> FloatArray:
        transfer = loop_transfer(model, np.exp(1j * model.sample_time * frequencies))[0]
        smallest = np.linalg.svd(identity + transfer, compute_uv=False)[:, -1]
        return np.asarray(1.0 / smallest, dtype=np.float64)

    sizes = size(grid)
    largest = sizes.max()
    for _ in range(REFINED):
        top = int(np.argmax(sizes))
        around = grid[max(top - 1, 0) : top + 2]
        grid = np.linspace(float(around[0]), float(around[-1]), 2 * REFINEMENT + 1)
        sizes = size(grid)
        largest = max(largest, sizes.max())
    return float(largest)
