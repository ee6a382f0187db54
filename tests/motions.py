"""Motions for tests: programs in bulk, chunks of them, and the whole way from toolpath to samples."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
from paths import rows

from cnc_shape.arrays import frozen, frozen_integers
from cnc_shape.feedrate import Profile
from cnc_shape.limits import Limits
from cnc_shape.planning import planning
from cnc_shape.program import Motion, PathMode, Program
from cnc_shape.smoothing import Path, Smoothing, smoothing
from cnc_shape.toolpath import Toolpath, build_toolpath
from cnc_shape.trajectory import Trajectory, sampling

MILL = [Limits(200.0, 2000.0)] * 3
PRINTER = [Limits(300.0, 5000.0)] * 3


def lines(
    points, feed_rate=100.0, mode=PathMode.BLEND, tolerance=np.nan, axes=("x", "y", "z"), **columns
) -> Toolpath:
    """Straight feeds through `points` (n+1,d); columns may vary by row."""
    points = np.asarray(points, dtype=float)
    n, d = points.shape[0] - 1, len(axes)
    if points.shape[1] < d:
        points = np.hstack([points, np.zeros((n + 1, d - points.shape[1]))])

    def column(value):
        return np.broadcast_to(np.asarray(value), (n,)).copy()

    return build_toolpath(
        Program(
            source="test.nc", axes=axes, start=frozen(points[0]),
            motion=frozen_integers(column(columns.get("motion", Motion.FEED))), target=frozen(points[1:]),
            center=frozen(np.zeros((n, 3))), sweep=frozen(np.zeros(n)),
            normal=frozen(np.tile([0.0, 0.0, 1.0], (n, 1))),
            feed_rate=frozen(column(feed_rate)), dwell=frozen(column(columns.get("dwell", 0.0))),
            path_mode=frozen_integers(column(mode)), path_tolerance=frozen(column(tolerance)),
            merge_tolerance=frozen(column(columns.get("merge_tolerance", np.nan))),
            line=frozen_integers(np.arange(1, n + 1)),
        )
    )  # fmt: skip


def chunks(toolpath: Toolpath, sizes) -> list[Toolpath]:
    """Cut a toolpath into chunks of `sizes` rows, over and over."""
    parts, first, n = [], 0, len(toolpath)
    while first < n:
        for size in sizes:
            parts.append(rows(toolpath, first, min(n, first + size)))
            first = min(n, first + size)
    return parts


def streamed(parts, limits, tolerance=0.01, sample_time=1e-3, most=65536):
    """Columns of the paths, profiles and trajectories of chunks, joined; and the most edges held back."""
    smooth, plan, draw = smoothing(Smoothing(tolerance)), planning(limits), sampling(sample_time, most)
    smoothed = planned = sampled = None
    paths, profiles, blocks, held = [], [], [], 0
    for number, part in enumerate(parts, 1):
        last = number == len(parts)
        smoothed, path = smooth(smoothed, part, last)
        planned, profile = plan(planned, path, last)
        paths.append(path)
        profiles.append(profile)
        drawn = list(draw(sampled, profile, last))
        sampled = drawn[-1][0]
        blocks += [block for _, block in drawn]
        held = max(held, sum(len(edges) for edges in smoothed.parts) if smoothed else 0)
    columns = {}
    for kind, values in ((Path, paths), (Profile, profiles), (Trajectory, blocks)):
        for field in fields(kind):
            if field.name not in ("axes", "path", "cell", "sample_time", "replayed", "rounded"):
                columns[f"{kind.__name__}.{field.name}"] = np.concatenate(
                    [getattr(v, field.name) for v in values]
                )
    return columns, held


def assert_same_bits(one, other):
    """Every column has the same shape and the same bits."""
    for name, column in one.items():
        assert column.shape == other[name].shape, name
        np.testing.assert_array_equal(
            column.view(np.int64) if column.dtype == float else column,
            other[name].view(np.int64) if column.dtype == float else other[name],
            err_msg=name,
        )


def points_of(path: Path, per_cell=5):
    """Points of every cell, (k*per_cell,d), and their places on the toolpath."""
    e = path.length[:, None] * np.linspace(0.0, 1.0, per_cell)
    c = path.coefficients
    q = c[:, None, 0] + e[..., None] * (
        c[:, None, 1] + e[..., None] * (c[:, None, 2] + e[..., None] * c[:, None, 3])
    )
    place = path.arc_length[:, None] + path.stretch[:, None] * e
    return q.reshape(-1, q.shape[2]), place.ravel()


def gaps(path: Path):
    """Largest jump of q, q', q'' between cells that follow each other without a stop."""
    c, h = path.coefficients, path.length[:, None]
    ends = [
        c[:, 0] + h * (c[:, 1] + h * (c[:, 2] + h * c[:, 3])),
        c[:, 1] + h * (2 * c[:, 2] + 3 * h * c[:, 3]),
    ]
    ends.append(2 * c[:, 2] + 6 * h * c[:, 3])
    starts = [c[:, 0], c[:, 1], 2 * c[:, 2]]
    through = ~path.stop[1:]
    jumps = [np.abs(end[:-1] - start[1:]) for end, start in zip(ends, starts, strict=True)]
    return jumps[0].max(initial=0.0), jumps[1][through].max(initial=0.0), jumps[2][through].max(initial=0.0)


def refined(path: Path, parts: int) -> Path:
    """The same path with every cell but the rests cut into equal ones."""
    return cut_cells(path, np.where(path.length > 0.0, parts, 1))


def divided(path: Path, cells: int) -> Path:
    """The same path in about as many `cells`: none is longer than their mean, none whole but the rests."""
    return cut_cells(
        path, np.where(path.length > 0.0, 1 + np.ceil(path.length * cells / path.length.sum()), 1)
    )


def cut_cells(path: Path, count: np.ndarray) -> Path:
    """The same path with each cell cut into as many equal ones."""
    count = count.astype(np.int64)
    k = np.repeat(np.arange(len(path)), count)
    share = np.concatenate([np.arange(n) / n for n in count])
    e, c = (share * path.length[k])[:, None], path.coefficients[k]
    coefficients = np.stack(
        [
            c[:, 0] + e * (c[:, 1] + e * (c[:, 2] + e * c[:, 3])),
            c[:, 1] + e * (2 * c[:, 2] + 3 * e * c[:, 3]),
            c[:, 2] + 3 * e * c[:, 3],
            c[:, 3],
        ],
        axis=1,
    )
    stop = path.stop[k] & (share == 0.0)
    stop.setflags(write=False)
    return Path(
        path.axes, frozen(path.u[k] + e[:, 0]), frozen(path.length[k] / count[k]), frozen(coefficients),
        frozen(path.feed_rate[k]), stop, frozen(np.where(stop, path.dwell[k], 0.0)),
        frozen(path.arc_length[k] + path.stretch[k] * e[:, 0]), frozen(path.stretch[k]),
        frozen_integers(path.line[k]),
    )  # fmt: skip


def wander(rng: np.random.Generator, n: int) -> Toolpath:
    """A random program: dense curves, tiny and long moves, corners, feeds, exact stops, dwells."""
    turn = rng.normal(size=n) * np.where(rng.random(n) < 0.9, 0.02, 1.5)
    size = rng.choice([0.005, 0.05, 0.5, 5.0, 40.0], size=n, p=[0.3, 0.3, 0.3, 0.09, 0.01])
    motion = np.where(rng.random(n) < 0.003, Motion.DWELL, Motion.FEED)
    size[motion == Motion.DWELL] = 0.0
    heading = np.cumsum(turn)
    steps = np.column_stack(
        [size * np.cos(heading), size * np.sin(heading), 0.02 * size * rng.normal(size=n)]
    )
    points = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    feeds = rng.choice([20.0, 100.0, 180.0], size=n // 50 + 1)[np.arange(n) // 50]
    mode = np.where(rng.random(n) < 0.004, PathMode.EXACT_STOP, PathMode.BLEND)
    return lines(points, feeds, mode, motion=motion, dwell=np.where(motion == Motion.DWELL, 0.25, 0.0))
