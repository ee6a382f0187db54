"""Motions to measure on: a generated program, smoothed, planned and sampled within a fast stage's limits."""

from __future__ import annotations

from pathlib import Path

from benchmarks import programs
from benchmarks.measuring import workshop
from cnc_shape.feedrate import Profile
from cnc_shape.limits import Limits
from cnc_shape.planning import plan
from cnc_shape.readers import read_program
from cnc_shape.smoothing import Path as SmoothPath
from cnc_shape.smoothing import Smoothing, smooth
from cnc_shape.toolpath import Toolpath, build_toolpath
from cnc_shape.trajectory import Trajectory, sample

LIMITS = (Limits(500.0, 5000.0), Limits(500.0, 5000.0), Limits(200.0, 2000.0))
SAMPLE_TIME = 1e-3  # s
TOLERANCE = Smoothing(0.01)  # mm


def toolpath(kind: str, blocks: int) -> Toolpath:
    """Return the programmed path of a generated program."""
    with workshop() as folder:
        file: Path = folder / f"{kind}.nc"
        programs.write(kind, blocks, file)
        return build_toolpath(read_program(file))


def path(kind: str, blocks: int) -> SmoothPath:
    """Return its C2 path."""
    return smooth(toolpath(kind, blocks), TOLERANCE)


def profile(kind: str, blocks: int) -> Profile:
    """Return its time law."""
    return plan(path(kind, blocks), LIMITS)


def command(kind: str, blocks: int) -> Trajectory:
    """Return its samples."""
    return sample(profile(kind, blocks), SAMPLE_TIME)
