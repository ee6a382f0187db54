"""Command shaping: everything that happens to the axis commands between planner and servo."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from cnc_shape.modes import Mode
from cnc_shape.shapers.contour_compensation import Step, compensating, curve_gains, half_width
from cnc_shape.shapers.shaper import Shaper
from cnc_shape.shapers.shaping import delays, shaping
from cnc_shape.trajectory import Trajectory


@dataclass(frozen=True, slots=True)
class CommandShaping:
    """How the axis commands are shaped: nothing, every axis by itself, or contour shaping."""

    shapers: Mapping[str, Shaper] = field(default_factory=dict[str, Shaper])  # axis: shaper
    aligned: bool = True  # all axes late alike
    structure: Mapping[str, Sequence[Mode]] | None = None  # axis: modes to compensate on curves; None: none

    @property
    def acts(self) -> bool:
        """Whether a command comes out other than it goes in."""
        return bool(self.shapers) or self.structure is not None

    def gains(self, axes: Sequence[str]) -> Mapping[str, float]:
        """What is compensated on curves, gamma of each axis, s^2; empty where nothing is."""
        if self.structure is None:
            return {}
        gains = curve_gains(self.shapers, self.structure, axes)
        return gains if half_width(gains) > 0.0 else {}

    def lag(self, axes: tuple[str, ...], sample_time: float) -> float:
        """How late the shaped command is on steady motion, s."""
        return delays(self.shapers, axes, sample_time, aligned=self.aligned).common + half_width(
            self.gains(axes)
        )

    def longer(self, axes: tuple[str, ...], sample_time: float) -> float:
        """How much longer the shaped command lasts, s."""
        longest = delays(self.shapers, axes, sample_time, aligned=self.aligned).longest
        return longest + 2.0 * half_width(self.gains(axes))


@dataclass(frozen=True, eq=False, slots=True)
class CommandState:
    """Where the two stages stand."""

    compensated: Trajectory | None
    shaped: Trajectory | None


def command_shaping(
    how: CommandShaping, axes: Sequence[str], sample_time: float
) -> Callable[[CommandState | None, Trajectory, bool], tuple[CommandState, Trajectory]]:
    """Return the resumable stage that shapes the commands of `axes` as `how` says.

    Raises
    ------
    InfeasibleError
        A compensation that looks too many samples ahead.
    """
    shape = shaping(how.shapers, sample_time, aligned=how.aligned)
    gains = how.gains(axes)
    compensate: Step | None = compensating(gains, sample_time) if gains else None

    def step(state: CommandState | None, command: Trajectory, last: bool) -> tuple[CommandState, Trajectory]:
        compensated = state.compensated if state else None
        shaped = state.shaped if state else None
        if compensate is not None:
            compensated, command = compensate(compensated, command, last)
        if how.shapers:
            shaped, command = shape(shaped, command, last)
        return CommandState(compensated, shaped), command

    return step


def shape_command(command: Trajectory, how: CommandShaping) -> Trajectory:
    """Shape a whole motion as `how` says."""
    return command_shaping(how, command.axes, command.sample_time)(None, command, True)[1]
