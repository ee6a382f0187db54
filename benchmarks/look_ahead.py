"""Look-ahead: the speeds along a path, against the same in pure Python.

Without a jerk limit, the peer does for straight cells what `feedrate.plan` does: limits from axes and feed,
one scan backwards to brake in time, one forwards to drive, and the trapezoid of every cell. On curved cells,
and with a jerk limit, the peer is our own law, interpreted.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from functools import partial
from math import inf, sqrt
from pathlib import Path

import numpy as np
import numpy.typing as npt

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.measuring import Kind, Row, best_of, child, report, workshop
from benchmarks.motions import LIMITS, TOLERANCE, path
from cnc_shape.arrays import frozen, frozen_integers
from cnc_shape.limits import Limits
from cnc_shape.planning import plan
from cnc_shape.program import Motion, PathMode, Program
from cnc_shape.smoothing import Path as SmoothPath
from cnc_shape.smoothing import smooth
from cnc_shape.toolpath import build_toolpath

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


Points = npt.NDArray[np.float64]


def raster(blocks: int) -> Points:
    """Points (blocks+1,3) of rows to and fro, 100 mm long."""
    row, column = np.divmod(np.arange(blocks + 1), 1000)
    return np.column_stack([0.1 * np.where(row % 2, 999 - column, column), 0.1 * row, 0.0 * row])


def spiral(blocks: int) -> Points:
    """Points (blocks+1,3) of a flat spiral outwards from radius 28 mm, 0.5 mm a turn."""
    growth = 0.5 / (2.0 * np.pi)  # mm/rad
    angle = np.sqrt(2.0 * (5000.0 + 0.1 * np.arange(blocks + 1)) / growth)
    return np.column_stack([growth * angle * np.cos(angle), growth * angle * np.sin(angle), 0.0 * angle])


def relief(blocks: int) -> Points:
    """Points (blocks+1,3) of rows to and fro over waves, 0.05 to 0.3 mm apart."""
    random = np.random.default_rng(1)
    row, x = np.divmod(np.append(0.0, np.cumsum(random.uniform(0.05, 0.3, blocks))), 100.0)
    x, y, z = np.where(row % 2, 100.0 - x, x), 0.2 * row, np.zeros(blocks + 1)
    for _ in range(12):
        across, along = random.normal(size=2) * 2.0 * np.pi / 10.0  # rad/mm
        z += 0.25 * np.sin(across * x + along * y + random.uniform(0.0, 7.0))
    return np.column_stack([x, y, z])


SHAPES: dict[str, Callable[[int], Points]] = {"raster": raster, "spiral": spiral, "relief": relief}
MILL = (Limits(200.0, 2000.0, 5e4),) * 3


def shape_path(shape: str, blocks: int) -> SmoothPath:
    """Return the C2 path of a program of short straights at 100 mm/s."""
    points = SHAPES[shape](blocks)
    n = blocks
    whole = np.zeros(n, np.int64)
    program = Program(
        source="", axes=("x", "y", "z"), start=frozen(points[0]),
        motion=frozen_integers(whole + int(Motion.FEED)), target=frozen(points[1:]),
        center=frozen(np.zeros((n, 3))), normal=frozen(np.tile([0.0, 0.0, 1.0], (n, 1))),
        sweep=frozen(np.zeros(n)), feed_rate=frozen(np.full(n, 100.0)),
        dwell=frozen(np.zeros(n)), path_mode=frozen_integers(whole + int(PathMode.BLEND)),
        path_tolerance=frozen(np.full(n, np.nan)), merge_tolerance=frozen(np.full(n, np.nan)),
        line=frozen_integers(np.arange(1, n + 1)),
    )  # fmt: skip
    return smooth(build_toolpath(program), TOLERANCE)


def interpreted(folder: Path, what: str) -> float:
    """Time that our own law takes without a compiler, s: a cell of ``curved``, or a block of a shape."""
    command = [sys.executable, str(Path(__file__).resolve()), INTERPRETED, what]
    return float(child(command, folder, environment={"NUMBA_DISABLE_JIT": "1"}).output)


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
        told = interpreted(folder, "curved")
        stage, name = "look-ahead, curved cells", "the same scan, interpreted"
        yield Row(stage, Kind.SPEED_UP, 40.0, name, "ns/cell", ours * 1e9, told * 1e9)
        for shape in SHAPES:
            long = shape_path(shape, CELLS // 2)
            ours = best_of(ROUNDS, partial(plan, long, MILL)) / (CELLS // 2)
            told = interpreted(folder, shape)
            stage, name = f"look-ahead, jerk limit, {shape}", "the same law, interpreted"
            yield Row(stage, Kind.SPEED_UP, 40.0, name, "ns/block", ours * 1e9, told * 1e9)


if __name__ == "__main__":
    if INTERPRETED in sys.argv:
        shape = sys.argv[-1]
        if shape in SHAPES:
            short = shape_path(shape, INTERPRETED_BLOCKS)
            print(best_of(1, partial(plan, short, MILL)) / INTERPRETED_BLOCKS)
        else:
            short = path("printer", INTERPRETED_BLOCKS)
            print(best_of(1, partial(plan, short, LIMITS)) / len(short))
    else:
        report(rows())
