"""The whole story: a program, a machine, and what the machine makes of the program.

Program -> Toolpath -> Path -> Profile -> Trajectory; then for each case: shaped -> simulated -> measured.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cnc_shape.arrays import FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class Deviation:
    """Contour error of one signal over all its samples."""

    rms: float  # mm
    max: float  # mm
    line: int | None  # source line of the worst place


@dataclass(frozen=True, slots=True)
class CaseSummary:
    """The scalars of one case: one row of the table."""

    name: str
    cycle_time: float  # s, of the case's (shaped) command
    command: Deviation  # of the command
    drives: Deviation  # of the drives' position through the kinematics
    tool: Deviation  # of drive plus structure
    following_rms: Mapping[str, float]  # axis: mm or rad
    residual_vibration: Mapping[str, float]  # axis: mm or rad


@dataclass(frozen=True, slots=True)
class Summary:
    """What one run says: one row a case."""

    program: str
    machine: str
    cycle_time: float  # s, of the unshaped command
    sample_time: float  # s
    samples: int
    cases: tuple[CaseSummary, ...]


@dataclass(frozen=True, eq=False, slots=True)
class Signals:
    """The samples of one case that were kept for the report; decimated by `factor` beyond its limit."""

    case: str
    axes: tuple[str, ...]
    factor: int  # 1: every sample
    time: FloatArray  # (n,) s
    command: FloatArray  # (n,d) mm or rad
    position: FloatArray  # (n,d) mm or rad, of the drives
    tool: FloatArray  # (n,d) mm or rad
    velocity: FloatArray  # (n,d) mm/s, of the command
    acceleration: FloatArray  # (n,d) mm/s^2, of the command
    command_error: FloatArray  # (n,) mm, contour error of the command
    drive_error: FloatArray  # (n,) mm
    tool_error: FloatArray  # (n,) mm
    line: IntArray  # (n,) source line of the foot point of the tool

    def __post_init__(self) -> None:
        if self.command.shape != (self.time.size, len(self.axes)):
            raise ValueError(f"{self.command.shape=}")


@dataclass(frozen=True, slots=True)
class Run:
    """A summary with the signals it was made from, and the programmed path as a polyline to draw."""

    summary: Summary
    signals: tuple[Signals, ...]  # one a case, in the summary's order
    path: FloatArray  # (p,3) mm, the programmed path, arcs chopped for drawing

    def signal(self, case: str) -> Signals:
        """Return the signals of the case called `case`."""
        return next(signals for signals in self.signals if signals.case == case)
