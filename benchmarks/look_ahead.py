"""Look-ahead without jerk limit: the fastest speeds along a path, against the same in pure Python.

The peer does for straight cells what `feedrate.plan` does: limits from axes and feed, one scan backwards
to brake in time, one forwards to drive, and the trapezoid of every cell. On curved cells the peer is
our own scan, interpreted.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import partial
from math import inf, sqrt
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.measuring import Kind, Row, best_of, child, report, workshop
from benchmarks.motions import LIMITS, path
from cnc_shape.arrays import frozen, frozen_integers
from cnc_shape.planning import plan
from cnc_shape.smoothing import Path as SmoothPath

CELLS = 200_000
INTERPRETED_BLOCKS = 2_000
INTERPRETED = "--interpreted"
ROUNDS = 5


def straight_path(cells: int) -> SmoothPath:
    """Return a slanted line in cells of random lengths, each with a feed of its own, and the end."""
    random = np.random.default_rng(1)
    length = np.append(random.uniform(0.05, 0.5, cells), 0.0)
    start = np.append(0.0, np.cumsum(length)[:-1])
    direction = np.array([0.6, 0.8, 0.0])
    coefficients = np.zeros((cells + 1, 4, 3))
    coefficients[:, 0] = start[:, None] * direction
    coefficients[:-1, 1] = direction
    stop = np.zeros(cells + 1, dtype=np.bool_)
    stop[[0, -1]] = True
    stop.setflags(write=False)
    nothing = frozen(np.zeros(cells + 1))
    return SmoothPath(
        ("x", "y", "z"), frozen(start), frozen(length), frozen(coefficients),
        frozen(random.uniform(50.0, 150.0, cells + 1)), stop, nothing, frozen(start),
        frozen(np.ones(cells + 1)), frozen_integers(np.arange(cells + 1)),
    )  # fmt: skip


Cell = tuple[float, float, tuple[float, float, float]]  # length, feed rate, direction


def cells_of(straight: SmoothPath) -> list[Cell]:
    """Turn the cells into plain numbers."""
    length, feed = straight.length[:-1].tolist(), straight.feed_rate[:-1].tolist()
    directions = [tuple(row) for row in straight.coefficients[:-1, 1].tolist()]
    return list(zip(length, feed, directions, strict=True))


def plan_in_python(cells: list[Cell]) -> list[tuple[float, float, float, float, float]]:
    """Pieces (time, duration, place, velocity, acceleration) from rest to rest."""
    axes = [(limits.velocity, limits.acceleration) for limits in LIMITS]
    limit_v2: list[float] = []
    rates: list[float] = []
    for _, feed, direction in cells:
        speed, rate = feed, inf
        for share, (velocity, acceleration) in zip(direction, axes, strict=True):
            if share:
                share = abs(share)
                if velocity < speed * share:
                    speed = velocity / share
                if acceleration < rate * share:
                    rate = acceleration / share
        limit_v2.append(speed * speed)
        rates.append(rate)
    reach_v2 = [0.0] * (len(cells) + 1)
    v2 = 0.0
    for k in range(len(cells) - 1, 0, -1):
        v2 += 2.0 * rates[k] * cells[k][0]
        if limit_v2[k] < v2:
            v2 = limit_v2[k]
        if limit_v2[k - 1] < v2:
            v2 = limit_v2[k - 1]
        reach_v2[k] = v2
    pieces: list[tuple[float, float, float, float, float]] = []
    time = v2 = 0.0
    for k, (length, _, _) in enumerate(cells):
        a, next_v2 = rates[k], reach_v2[k + 1]
        if v2 + 2.0 * a * length < next_v2:
            next_v2 = v2 + 2.0 * a * length
        top_v2 = 0.5 * (v2 + next_v2) + a * length
        if limit_v2[k] < top_v2:
            top_v2 = limit_v2[k]
        start, top, end = sqrt(v2), sqrt(top_v2), sqrt(next_v2)
        rise, fall = (top_v2 - v2) / (2.0 * a), (top_v2 - next_v2) / (2.0 * a)
        cruise = length - rise - fall
        if rise > 0.0:
            pieces.append((time, (top - start) / a, 0.0, start, a))
            time += (top - start) / a
        if cruise > 1e-12:
            pieces.append((time, cruise / top, rise, top, 0.0))
            time += cruise / top
        if fall > 0.0:
            pieces.append((time, (top - end) / a, length - fall, top, -a))
            time += (top - end) / a
        v2 = next_v2
    return pieces


def rows() -> Iterator[Row]:
    """Measure."""
    straight = straight_path(CELLS)
    cells = cells_of(straight)
    pieces = plan_in_python(cells)
    assert abs(plan(straight, LIMITS).end_time / (pieces[-1][0] + pieces[-1][1]) - 1.0) < 1e-9
    ours = best_of(ROUNDS, partial(plan, straight, LIMITS)) / CELLS
    peer = best_of(2, partial(plan_in_python, cells)) / CELLS
    stage = "look-ahead, straight cells"
    yield Row(stage, Kind.SPEED_UP, 40.0, "pure Python", "ns/cell", ours * 1e9, peer * 1e9)

    curved = path("printer", CELLS // 4)
    ours = best_of(ROUNDS, partial(plan, curved, LIMITS)) / len(curved)
    with workshop() as folder:
        command = [sys.executable, str(Path(__file__).resolve()), INTERPRETED]
        told = child(command, folder, environment={"NUMBA_DISABLE_JIT": "1"}).output
    stage, name = "look-ahead, curved cells", "the same scan, interpreted"
    yield Row(stage, Kind.SPEED_UP, 40.0, name, "ns/cell", ours * 1e9, float(told) * 1e9)


if __name__ == "__main__":
    if INTERPRETED in sys.argv:
        short = path("printer", INTERPRETED_BLOCKS)
        print(best_of(1, partial(plan, short, LIMITS)) / len(short))
    else:
        report(rows())
