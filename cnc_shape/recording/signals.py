"""Signals: the samples of a case, in memory, and every one of them in a nameless file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen
from cnc_shape.errors import InfeasibleError
from cnc_shape.writers.spool import Spool

PICKS = 8  # samples of a bucket that are kept at most
MOTIONS = ("command", "position", "tool", "velocity", "acceleration")  # columns of an axis each
ERRORS = ("command_error", "drive_error", "tool_error")


class Samples:
    """Every sample of one case, in a nameless file that vanishes with this value."""

    def __init__(self, axes: tuple[str, ...], sample_time: float, spool: Spool) -> None:
        self._axes, self._sample_time, self._spool = axes, sample_time, spool

    def __len__(self) -> int:
        return len(self._spool)

    def pieces(self, name: str, axis: int = 0) -> Iterator[FloatArray]:
        """Yield a signal in consecutive pieces.

        Parameters
        ----------
        name
            Of `Signals`: ``time``, ``command``, ``tool_error``, ``line`` and so on, but for ``foot``.
        axis
            Which column, where the signal has one an axis.
        """
        if name == "time":
            return self._times()
        return self._spool.pieces(columns(len(self._axes))[name].start + axis)

    def read(self, name: str, axis: int = 0) -> FloatArray:
        """Return a whole signal, (n,); it has to fit in memory."""
        return np.concatenate([*self.pieces(name, axis), np.zeros(0)])

    def _times(self) -> Iterator[FloatArray]:
        first = 0
        for piece in self._spool.pieces(0):
            yield frozen(np.arange(first, first + piece.size) * self._sample_time)
            first += piece.size


@dataclass(frozen=True, eq=False, slots=True)
class Signals:
    """The samples of one case for its page: every sample, or the extremes of every `bucket` of them."""

    case: str
    axes: tuple[str, ...]
    factor: int  # 1: every sample; n: at most one of n
    time: FloatArray  # (n,) s
    command: FloatArray  # (n,d) mm or rad
    position: FloatArray  # (n,d) mm or rad, of the drives
    tool: FloatArray  # (n,d) mm or rad
    velocity: FloatArray  # (n,d) mm/s, of the command
    acceleration: FloatArray  # (n,d) mm/s^2, of the command
    command_error: FloatArray  # (n,) mm, contour error of the command
    drive_error: FloatArray  # (n,) mm
    tool_error: FloatArray  # (n,) mm
    foot: FloatArray  # (n,3) mm, the path's nearest point to the tool
    line: IntArray  # (n,) source line of the foot point of the tool
    settling_time: FloatArray  # (m,) s, after the end of the motion
    settling: FloatArray  # (m,d) mm or rad, tool minus drive then
    samples: Samples | None = None  # every sample, where more were kept than are here

    def __post_init__(self) -> None:
        if self.command.shape != (self.time.size, len(self.axes)):
            raise ValueError(f"{self.command.shape=}")

    def __len__(self) -> int:
        return self.time.size

    @property
    def bucket(self) -> int:
        """How many samples those kept were chosen from at a time; 1: every sample is here."""
        return self.factor * PICKS if self.factor > 1 else 1

    @property
    def source(self) -> Signals | Samples:
        """Where most samples are."""
        return self if self.samples is None else self.samples

    def pieces(self, name: str, axis: int = 0) -> Iterator[FloatArray]:
        """Yield a signal as `Samples.pieces` does, in one piece."""
        values: FloatArray = getattr(self, name)
        yield values if values.ndim == 1 else values[:, axis]


def columns(axes: int) -> dict[str, slice]:
    """Where the signals lie in a row; all but ``foot``, the last, are spooled."""
    widths = {**dict.fromkeys(MOTIONS, axes), **dict.fromkeys(ERRORS, 1), "line": 1, "foot": 3}
    ends = np.cumsum(list(widths.values())).tolist()
    return {name: slice(end - width, end) for (name, width), end in zip(widths.items(), ends, strict=True)}


def require_finite(name: str, values: FloatArray, case: str, axes: tuple[str, ...], time: FloatArray) -> None:
    """Refuse a signal, (n,) or (n,d), that holds NaN or infinity.

    Raises
    ------
    InfeasibleError
        It names the signal, its axis, the case and the time.
    """
    bad = np.argwhere(~np.isfinite(values))
    if bad.size:
        row, *column = bad[0].tolist()
        axis = f" of {axes[column[0]].upper()}" if column else ""
        raise InfeasibleError(
            f"{name}{axis} of the case {case} is {values[row, *column]} at t = {time[row]:.6g} s",
            hint="the motion ran away: lower the gains of its loop, or check its shapers",
        )
