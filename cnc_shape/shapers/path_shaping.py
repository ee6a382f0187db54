"""Path shaping: the time law goes through the shaper, the axes stay on the path.

Where the structure does not sit between drive and tool, or where the drives' path is what counts, the
travel along the path is shaped instead of the axes. The price is at the tool: the acceleration across the
path on curves is not shaped (it follows the speed squared), and the structure's deflection on curves stays.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.chunks import with_last
from cnc_shape.feedrate import Profile
from cnc_shape.kernels.progress import along_path
from cnc_shape.shapers.shaper import Shaper, convolve
from cnc_shape.shapers.shaping import shaping
from cnc_shape.smoothing import Path, join_paths
from cnc_shape.trajectory import SamplingState, Trajectory, sampling

PARAMETER = ("u",)  # the one axis of a time law


def common_shaper(shapers: Mapping[str, Shaper]) -> Shaper:
    """One shaper for all axes: every distinct one after the other.

    Raises
    ------
    OptionError
        They have too many impulses together.
    """
    distinct: dict[tuple[bytes, bytes], Shaper] = {}
    for shaper in shapers.values():
        distinct.setdefault((shaper.times.tobytes(), shaper.amplitudes.tobytes()), shaper)
    return convolve(list(distinct.values()))


@dataclass(frozen=True, eq=False, slots=True)
class PathShapingState:
    """Between two chunks: the time law's last samples, and the cells that it may still be in."""

    sampled: SamplingState | None
    shaped: Trajectory | None
    path: Path | None
    start: FloatArray  # (k,) path parameter over the whole path at the start of those cells
    end: float  # the same at their end
    end_time: float  # s, of the shaped motion so far: the cycle time, after the last chunk


PathSamplingStep: TypeAlias = Callable[
    [PathShapingState | None, Profile, bool], Iterator[tuple[PathShapingState, Trajectory]]
]


def path_sampling(shaper: Shaper, sample_time: float) -> PathSamplingStep:
    """Return the resumable step from Profile to the Trajectory of its shaped time law.

    Like `trajectory.sampling` it is an iterator; the motion lasts longer by the shaper's duration.
    """
    draw = sampling(sample_time)
    shape = shaping({PARAMETER[0]: shaper}, sample_time)

    def step(
        state: PathShapingState | None, profile: Profile, last: bool
    ) -> Iterator[tuple[PathShapingState, Trajectory]]:
        now = state or PathShapingState(None, None, None, frozen(np.zeros(0)), 0.0, 0.0)
        path, start, end = _longer(now, profile.path)
        law = replace(profile, path=_parameter(profile.path, start[start.size - len(profile.path) :]))
        for (sampled, travel), end_of_chunk in with_last(draw(now.sampled, law, last)):
            shaped, travel = shape(now.shaped, travel, last and end_of_chunk)
            place, *signals = along_path(
                travel.position[:, 0], travel.velocity[:, 0], travel.acceleration[:, 0],
                start, path.length, path.coefficients, path.arc_length, path.stretch,
            )  # fmt: skip
            keep = _passed(start, shaped)
            now = PathShapingState(
                sampled, shaped, path.cut(slice(keep, None)), start[keep:], end,
                sampled.end_time + shaper.duration,
            )  # fmt: skip
            yield now, Trajectory(path.axes, sample_time, frozen(place), *map(frozen, signals))

    return step


def _longer(now: PathShapingState, new: Path) -> tuple[Path, FloatArray, float]:
    """The cells that are still needed and the new ones, where they start, and where the last one ends."""
    borders: FloatArray = np.cumsum(np.concatenate([[now.end], new.length]))
    start = frozen(np.concatenate([now.start, borders[:-1]]))
    path = new if now.path is None or len(now.path) == 0 else join_paths([now.path, new])
    return path, start, float(borders[-1])


def _parameter(path: Path, start: FloatArray) -> Path:
    """The path whose only axis is its own parameter."""
    coefficients = np.zeros((len(path), 4, 1))
    coefficients[:, 0, 0] = start
    coefficients[:, 1, 0] = path.length > 0.0
    return replace(path, axes=PARAMETER, coefficients=frozen(coefficients))


def _passed(start: FloatArray, history: Trajectory | None) -> int:
    """How many cells at the front no sample to come can be in."""
    if history is None or len(history) == 0 or start.size == 0:
        return 0
    rearmost = float(history.position.min())
    return max(int(np.searchsorted(start, rearmost, side="right")) - 1, 0)
