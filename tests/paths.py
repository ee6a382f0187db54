"""Toolpaths for tests, from a few words."""

from __future__ import annotations

import numpy as np

from cnc_shape.arrays import frozen, frozen_integers
from cnc_shape.program import Motion, PathMode, Program
from cnc_shape.toolpath import Toolpath, build_toolpath

Z = (0.0, 0.0, 1.0)


def line(*end, feed_rate=20.0, mode=PathMode.BLEND, tolerance=np.nan):
    """A straight feed to `end`."""
    return {
        "motion": Motion.FEED,
        "target": end,
        "feed_rate": feed_rate,
        "mode": mode,
        "tolerance": tolerance,
    }


def arc(end, center, sweep, normal=Z, feed_rate=20.0, mode=PathMode.BLEND, tolerance=np.nan):
    """An arc, helix or spiral to `end` about an axis through `center`."""
    return {
        "motion": Motion.ARC, "target": end, "center": center, "sweep": sweep, "normal": normal,
        "feed_rate": feed_rate, "mode": mode, "tolerance": tolerance,
    }  # fmt: skip


def dwell(seconds):
    """A wait."""
    return {"motion": Motion.DWELL, "dwell": seconds}


def program(*moves, start=(0.0, 0.0, 0.0), axes=("x", "y", "z")) -> Program:
    """A program of `moves` from `start`; line numbers count from 1."""
    d = len(axes)
    position = np.array([*start, *[0.0] * (d - len(start))])
    first = position.copy()
    columns: dict[str, list] = {
        name: []
        for name in (
            "motion",
            "target",
            "center",
            "normal",
            "sweep",
            "feed_rate",
            "dwell",
            "mode",
            "tolerance",
        )
    }
    for move in moves:
        position = np.array([*move.get("target", position), *position[len(move.get("target", position)) :]])
        columns["motion"].append(int(move["motion"]))
        columns["target"].append(position)
        columns["center"].append(move.get("center", (0.0, 0.0, 0.0)))
        columns["normal"].append(move.get("normal", Z))
        columns["sweep"].append(move.get("sweep", 0.0))
        columns["feed_rate"].append(move.get("feed_rate", np.inf))
        columns["dwell"].append(move.get("dwell", 0.0))
        columns["mode"].append(int(move.get("mode", PathMode.BLEND)))
        columns["tolerance"].append(move.get("tolerance", np.nan))
    n = len(moves)
    return Program(
        source="test.nc", axes=axes, start=frozen(first),
        motion=frozen_integers(np.array(columns["motion"], dtype=np.int64)),
        target=frozen(np.array(columns["target"]).reshape(n, d)),
        center=frozen(np.array(columns["center"]).reshape(n, 3)), normal=frozen(np.array(columns["normal"]).reshape(n, 3)),
        sweep=frozen(columns["sweep"]), feed_rate=frozen(columns["feed_rate"]), dwell=frozen(columns["dwell"]),
        path_mode=frozen_integers(np.array(columns["mode"], dtype=np.int64)), path_tolerance=frozen(columns["tolerance"]),
        merge_tolerance=frozen(np.full(n, np.nan)), line=frozen_integers(np.arange(1, n + 1)),
    )  # fmt: skip


def toolpath(*moves, **options) -> Toolpath:
    """The toolpath of `program`."""
    return build_toolpath(program(*moves, **options))


def rows(path: Toolpath, first: int, last: int) -> Toolpath:
    """Rows first...last-1 as a chunk."""
    cut = {name: getattr(path, name) for name in Toolpath.__slots__}
    for name, column in cut.items():
        if name == "arc_length":
            cut[name] = frozen(column[first : last + 1])
        elif name not in ("source", "axes"):
            view = np.ascontiguousarray(column[first:last])
            view.setflags(write=False)
            cut[name] = view
    return Toolpath(**cut)
