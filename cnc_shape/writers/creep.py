"""Creep: motion so slow that a control would hurry it.

In inverse time LinuxCNC multiplies F by the length of the move in X, Y, Z (of its rotary axes, if it has
none) and takes what is below 0.1 mm/min, or degrees, for 0.1. A table that turns for a second while X drifts
by a nanometre would turn in an instant. Such a drift waits until it has come to a share of the tolerance,
and is then made good in a short move that is quick enough.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil
from typing import TypeAlias

import numpy as np

from cnc_shape.arrays import BoolArray, FloatArray, frozen, frozen_integers
from cnc_shape.program import ROTARY
from cnc_shape.writers.knots import DRIFT, Grid, Knots

SLOWEST = 1.1 * 0.1 / 60.0  # mm/s or degrees/s; the control's limit, and a little more


@dataclass(frozen=True, eq=False, slots=True)
class Place:
    """Where a program has come to."""

    sample: int
    place: FloatArray  # (d,) decimal steps
    drifted: bool = False  # a drift is held: the motion is not quite there


CreepStep: TypeAlias = Callable[[Place | None, Knots, bool], tuple[Place | None, Knots]]


def without_creep(axes: Sequence[str], sample_time: float, grid: Grid) -> CreepStep:
    """Return the resumable step from Knots to Knots between which nothing creeps.

    The last knot of the last chunk stays where it is.
    """
    rotary = np.array([axis in ROTARY for axis in axes])
    slowest = SLOWEST * sample_time * grid.steps  # decimal steps a period
    share = DRIFT * grid.tolerance * grid.steps  # decimal steps

    def step(state: Place | None, knots: Knots, last: bool) -> tuple[Place | None, Knots]:
        if len(knots) == 0:
            return state, knots
        here = state or Place(int(knots.sample[0]), knots.place[0])
        periods = np.diff(knots.sample, prepend=here.sample)
        linear, turn = _travels(np.diff(knots.place, axis=0, prepend=here.place[None, :]), rotary)
        least = slowest * periods
        slow = np.where(linear > 0.0, linear < least, (turn > 0.0) & (turn < least))
        if not (slow.any() or here.drifted):
            return Place(int(knots.sample[-1]), knots.place[-1]), knots
        way: list[Place] = []
        for row in range(len(knots)):
            end = Place(int(knots.sample[row]), knots.place[row])
            if slow[row] or here.drifted:
                way += _around(
                    here, end, rotary, slowest, 0.0 if last and row == len(knots) - 1 else share, share
                )
            else:
                way.append(end)
            here = way[-1]
        return here, Knots(
            frozen_integers([place.sample for place in way]), frozen([place.place for place in way])
        )

    return step


def _travels(travel: FloatArray, rotary: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Lengths of moves (n,d) in the linear and in the rotary axes, (n,) each."""
    linear, turn = (np.sqrt((travel[:, part] ** 2).sum(axis=1)) for part in (~rotary, rotary))
    return linear, turn


def _around(
    start: Place, end: Place, rotary: BoolArray, slowest: float, waits: float, share: float
) -> list[Place]:
    """Return the knots on the way to `end`: that alone, that with a drift held, or the stairs of a drift.

    slowest: decimal steps a period. A drift of up to `waits` decimal steps waits; stairs rise by `share`.
    """
    periods, travel = end.sample - start.sample, end.place - start.place
    (linear,), (turn,) = (lengths.tolist() for lengths in _travels(travel[None, :], rotary))
    least = slowest * periods
    if linear >= least or (linear == 0.0 and (turn >= least or turn == 0.0)):
        return [end]
    held = ~rotary if turn >= least else np.ones_like(rotary)
    drift = linear if turn >= least else max(linear, turn)
    if drift <= waits:
        return [Place(end.sample, frozen(np.where(held, start.place, end.place)), drifted=True)]
    stairs = min(ceil(drift / share), periods)
    tops = [start.sample + round(periods * stair / stairs) for stair in range(stairs + 1)]
    climb = max(1, int((linear or turn) / stairs / slowest))  # periods
    way = [start]
    for before, top in pairwise(tops):
        foot = max(top - climb, before)
        if foot > before:
            along = np.rint(start.place + travel * ((foot - start.sample) / periods))
            way.append(Place(foot, frozen(np.where(held, way[-1].place, along))))
        way.append(Place(top, frozen(np.rint(start.place + travel * ((top - start.sample) / periods)))))
    return [*way[1:-1], end]
