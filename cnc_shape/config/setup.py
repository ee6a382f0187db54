"""Setup: everything a machine file says, as plain frozen values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from cnc_shape.controllers import Control
from cnc_shape.machine import Machine
from cnc_shape.shapers import Shaper
from cnc_shape.tools import Tool


class Shaping(Enum):
    """What the shapers of a machine act on."""

    AXIS = "axis"  # every axis command goes through its own shaper
    NONE = "none"  # nothing is shaped, whatever shapers the axes have


@dataclass(frozen=True, slots=True)
class Planning:
    """How motion is planned."""

    path_tolerance: float = 0.01  # mm
    shaping: Shaping = Shaping.AXIS


@dataclass(frozen=True, slots=True)
class ShaperChoice:
    """How the file asks for a shaper: its name in `SHAPERS` and the options given, keyed as in the file."""

    type: str
    options: Mapping[str, object]


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
    warnings: tuple[str, ...] = field(default=(), compare=False)
    source: str = field(default="", compare=False)

    @property
    def acting_shapers(self) -> Mapping[str, Shaper]:
        """Shapers that `planning.shaping` lets act: those of the axes, or none."""
        return self.shapers if self.planning.shaping is Shaping.AXIS else dict[str, Shaper]()
