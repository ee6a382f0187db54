"""Knots: where the straight pieces meet that stand for a sampled motion, each at constant speed.

The motion along a piece is linear in time. Coordinates are counted in decimal steps, as they are
written, so that what is chosen here is to the last digit what a control will read.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from math import ceil, log10, sqrt
from typing import TypeAlias

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.errors import OptionError
from cnc_shape.kernels.knots import find_knots
from cnc_shape.program import ROTARY
from cnc_shape.trajectory import Trajectory
from cnc_shape.units import MICROMETRE
from cnc_shape.writers.samples import positions

DECIMALS = 6  # of mm and degrees at least
STEPS = 100.0  # in the tolerance at least: rounding takes little of it
LEFT_OUT = 2.0  # steps of the tolerance that rounding of coordinates and times may take
DRIFT = 0.1  # of the tolerance, left for drifts that are held: see creep.py
REST = 8  # periods without motion that are a rest
SMALLEST, LARGEST = 1e-6, 1.0  # mm, tolerances that make sense


@dataclass(frozen=True, slots=True)
class Grid:
    """How closely a program follows its motion, and with how many decimals."""

    tolerance: float  # mm over X, Y, Z together, and degrees over A, B, C together
    decimals: int  # of mm and degrees

    @property
    def steps(self) -> float:
        """Decimal steps in 1 mm or 1 degree."""
        return 10.0**self.decimals


def make_grid(tolerance: float) -> Grid:
    """Choose the decimals for a tolerance of mm and of degrees.

    Raises
    ------
    OptionError
        Outside `SMALLEST` to `LARGEST`.
    """
    if not SMALLEST <= tolerance <= LARGEST:
        raise OptionError(
            f"the tolerance of {tolerance / MICROMETRE:g} µm is outside "
            f"{SMALLEST / MICROMETRE:g} to {LARGEST / MICROMETRE:g} µm",
            hint="1 µm is the default",
            argument="tolerance_um",
        )
    return Grid(tolerance, max(DECIMALS, ceil(log10(STEPS / tolerance) - 1e-9)))


@dataclass(frozen=True, eq=False, slots=True)
class Knots:
    """Ends of consecutive pieces. The first of a motion is its start."""

    sample: IntArray  # (k,) number of the sample that the knot is
    place: FloatArray  # (k,d) decimal steps

    def __len__(self) -> int:
        return self.sample.size


@dataclass(frozen=True, eq=False, slots=True)
class KnotState:
    """The piece under way; the arrays as in the kernel."""

    origin: FloatArray
    latest: FloatArray
    low: FloatArray
    high: FloatArray
    first: int
    seen: int
    still: int


KnotStep: TypeAlias = Callable[[KnotState | None, Trajectory, bool], tuple[KnotState | None, Knots]]


def knotting(grid: Grid) -> KnotStep:
    """Return the resumable step from Trajectory to Knots; the last chunk ends with the last sample.

    A piece passes each sample at the sample's own time: within the tolerance in X, Y, Z together, and in
    degrees within the same number in A, B, C together (a millidegree is a µm at a radius of 57 mm).
    """

    def step(state: KnotState | None, command: Trajectory, last: bool) -> tuple[KnotState | None, Knots]:
        directions, cover = _directions(command.axes)
        slack = cover * ((1.0 - DRIFT) * grid.tolerance * grid.steps - LEFT_OUT)
        now = state or _nothing_yet(*directions.shape)
        place = np.rint(positions(command, now.seen) * grid.steps) + 0.0  # no -0
        origin, latest, low, high = now.origin.copy(), now.latest.copy(), now.low.copy(), now.high.copy()
        sample, knots, first, seen, still = find_knots(
            place, directions, slack, REST, origin, latest, low, high, now.first, now.seen, now.still
        )
        if last and seen > 1:
            sample, knots = np.append(sample, seen - 1), np.vstack([knots, latest])
        now = KnotState(frozen(origin), frozen(latest), frozen(low), frozen(high), first, seen, still)
        return now, Knots(frozen_integers(sample), frozen(knots))

    return step


def _nothing_yet(ways: int, axes: int) -> KnotState:
    point, slope = frozen(np.zeros(axes)), frozen(np.zeros(ways))
    return KnotState(point, point, slope, slope, 0, 0, 0)


def _directions(axes: Sequence[str]) -> tuple[FloatArray, FloatArray]:
    """Directions (m,d) along which deviations are held, and what of the tolerance each may take, (m,).

    Linear and rotary axes have theirs apart. Those of three axes are the normals of a cube, of its edges and
    of its corners: no vector is longer than 1/cos of the widest angle between a vector and the next of them
    times its largest share along them, which leaves 89 % of the tolerance. Of two axes there are eight, 98 %.
    """
    rotary = np.array([axis in ROTARY for axis in axes])
    parts: list[FloatArray] = []
    cover: list[float] = []
    for members in (np.flatnonzero(~rotary), np.flatnonzero(rotary)):
        if members.size == 0:
            continue
        ways, share = _ways(members.size)
        part = np.zeros((len(ways), rotary.size))
        part[:, members] = ways
        parts.append(part)
        cover += [share] * len(ways)
    return np.vstack(parts), np.array(cover)


def _ways(axes: int) -> tuple[FloatArray, float]:
    if axes == 1:
        return np.ones((1, 1)), 1.0
    if axes == 2:
        angles = np.arange(8) * np.pi / 8
        return np.column_stack([np.cos(angles), np.sin(angles)]), float(np.cos(np.pi / 16))
    signs = np.array([sign for sign in product((-1.0, 0.0, 1.0), repeat=3) if sign > (0.0, 0.0, 0.0)])
    nearest = 1.0 / sqrt(1.0 + (sqrt(2.0) - 1.0) ** 2 + (sqrt(3.0) - sqrt(2.0)) ** 2)
    return signs / np.linalg.norm(signs, axis=1)[:, None], nearest
