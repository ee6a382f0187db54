"""Setup: everything a machine file says, as plain frozen values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from cnc_shape.controllers import Control
from cnc_shape.disturbances import UNDISTURBED, Disturbances
from cnc_shape.kinematics import Kinematics, cartesian
from cnc_shape.limits import NO_PATH_LIMITS, PathLimits
from cnc_shape.machine import Machine
from cnc_shape.shapers import Shaper
from cnc_shape.shapers.command_shaping import CommandShaping
from cnc_shape.shapers.path_shaping import common_shaper
from cnc_shape.timing import PLAIN, Timing
from cnc_shape.tools import Tool


class Shaping(Enum):
    """What the shapers of a machine act on."""

    CONTOUR = "contour"  # axis commands, curves compensated so that the tool keeps the path
    AXIS = "axis"  # axis commands, each through its own shaper
    PATH = "path"  # the time law along the path
    NONE = "none"  # nothing is shaped, whatever shapers the axes have


CASE_NAMES: Final = {  # of the row that shows a kind of shaping by itself
    Shaping.NONE: "unshaped",
    Shaping.AXIS: "axis_shaped",
    Shaping.PATH: "path_shaped",
    Shaping.CONTOUR: "contour_shaped",
}


@dataclass(frozen=True, slots=True)
class Planning:
    """How motion is planned, and what the shapers act on."""

    path_tolerance: float = 0.01  # mm
    shaping: Shaping = Shaping.CONTOUR
    stop_dwell: float = 0.5  # -, of the longest shaper: rest at every stop on the way
    aligned: bool = True  # axis shaping: all axes late alike
    tool_tolerance: float | None = None  # mm, contour error of the tool above which the motion slows down
    path_limits: PathLimits = NO_PATH_LIMITS


@dataclass(frozen=True, slots=True)
class ShaperChoice:
    """How the file asks for a shaper: its name in `SHAPERS` and the options given, keyed as in the file."""

    type: str
    options: Mapping[str, object]


@dataclass(frozen=True, slots=True)
class KinematicsChoice:
    """How the file asks for a kinematics: its name in `KINEMATICS`, and its parameters by their keys."""

    type: str = "cartesian"
    options: Mapping[str, object] = field(default_factory=dict[str, object])


@dataclass(frozen=True, slots=True)
class Setup:
    """A machine, its loop, its shapers and its tools.

    Two setups are equal when they describe the same machine, whatever files they were read from.
    """

    machine: Machine
    planning: Planning = Planning()
    control: Control = field(default_factory=Control)
    tools: tuple[Tool, ...] = ()
    choices: Mapping[str, ShaperChoice] = field(default_factory=dict[str, ShaperChoice])  # axis: choice
    shapers: Mapping[str, Shaper] = field(default_factory=dict[str, Shaper], compare=False)  # axis: designed
    disturbances: Disturbances = UNDISTURBED
    kinematics_choice: KinematicsChoice = KinematicsChoice()
    kinematics: Kinematics = field(default_factory=cartesian, compare=False)
    warnings: tuple[str, ...] = field(default=(), compare=False)
    source: str = field(default="", compare=False)
    loop_place: tuple[int, int] | None = field(default=None, compare=False)  # line, column of control

    @property
    def acting_shapers(self) -> Mapping[str, Shaper]:
        """Shapers that `planning.shaping` lets act: those of the axes, or none."""
        return dict[str, Shaper]() if self.planning.shaping is Shaping.NONE else self.shapers

    def command_shaping(self, shaping: Shaping) -> CommandShaping:
        """What happens to the axis commands under one kind of shaping."""
        if not self.shapers or shaping in (Shaping.NONE, Shaping.PATH):
            return CommandShaping()
        if shaping is Shaping.AXIS:
            return CommandShaping(self.shapers, self.planning.aligned)
        return CommandShaping(
            self.shapers, structure={axis.name: axis.modes for axis in self.machine.axes if axis.modes}
        )

    def timing(self, shaping: Shaping) -> Timing:
        """How the motion is timed under one kind of shaping.

        Raises
        ------
        OptionError
            Shapers that cannot act on the path together.
        """
        if not self.shapers or shaping is Shaping.NONE:
            return PLAIN
        longest = max(shaper.duration for shaper in self.shapers.values())
        path_shaper = common_shaper(self.shapers) if shaping is Shaping.PATH else None
        return Timing(self.planning.stop_dwell * longest, path_shaper)
