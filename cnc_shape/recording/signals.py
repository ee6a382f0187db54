"""Signals: the samples of a case, in memory, and every one of them in a nameless file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen
from cnc_shape.errors import InfeasibleError
from cnc_shape.response import MotorSignals
from cnc_shape.writers.spool import Spool

PICKS = 8  # samples of a bucket that are kept at most
MOTOR_PICKS = 3  # as many more where there are servo motors
MOTIONS = ("command", "position", "tool", "velocity", "acceleration")  # columns of an axis each
ERRORS = ("command_error", "drive_error", "tool_error")
MOTORS = tuple(item.name for item in fields(MotorSignals) if item.name != "joints")  # columns of a motor each


class Samples:
    """Every sample of one case, in a nameless file that vanishes with this value."""

    def __init__(
        self, axes: tuple[str, ...], sample_time: float, spool: Spool, motors: tuple[str, ...] = ()
    ) -> None:
        self._sample_time, self._spool = sample_time, spool
        self._columns = columns(len(axes), len(motors))

    def __len__(self) -> int:
        return len(self._spool)

    def pieces(self, name: str, axis: int = 0) -> Iterator[FloatArray]:
        """Yield a signal in consecutive pieces.

        Parameters
        ----------
        name
            Of `Signals` or its `motors`: ``time``, ``command``, ``tool_error``, ``line``, ``torque`` and so
            on, but for ``foot``.
        axis
            Which column, where the signal has one an axis or one a motor.
        """
        if name == "time":
            return self._times()
        return self._spool.pieces(self._columns[name].start + axis)

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
    motors: MotorSignals | None = None  # where any joint has a servo motor; as many rows as `time`

    def __post_init__(self) -> None:
        if self.command.shape != (self.time.size, len(self.axes)):
            raise ValueError(f"{self.command.shape=}")

    def __len__(self) -> int:
        return self.time.size

    @property
    def bucket(self) -> int:
        """How many samples those kept were chosen from at a time; 1: every sample is here."""
        return self.factor * picks(self.motors is not None) if self.factor > 1 else 1

    @property
    def source(self) -> Signals | Samples:
        """Where most samples are."""
        return self if self.samples is None else self.samples

    def pieces(self, name: str, axis: int = 0) -> Iterator[FloatArray]:
        """Yield a signal as `Samples.pieces` does, in one piece."""
        values: FloatArray = getattr(self.motors if name in MOTORS else self, name)
        yield values if values.ndim == 1 else values[:, axis]


def picks(has_motors: bool) -> int:
    """How many samples of a bucket are kept at most."""
    return PICKS + MOTOR_PICKS if has_motors else PICKS


def columns(axes: int, motors: int = 0) -> dict[str, slice]:
    """Where the signals lie in a row; all but ``foot``, the last, are spooled."""
    widths = {
        **dict.fromkeys(MOTIONS, axes), **dict.fromkeys(ERRORS, 1), "line": 1,
        **dict.fromkeys(MOTORS, motors), "foot": 3,
    }  # fmt: skip
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
