"""``--fail-on "max_contour_um>20"``: a run that is a gate."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import Final

from cnc_shape.errors import OptionError
from cnc_shape.pipeline import CaseSummary, Summary
from cnc_shape.units import MICROMETRE

MEASURES: Final[dict[str, Callable[[CaseSummary], float]]] = {
    "max_contour_um": lambda case: case.drives.max / MICROMETRE,
    "rms_contour_um": lambda case: case.drives.rms / MICROMETRE,
    "max_tool_contour_um": lambda case: case.tool.max / MICROMETRE,
    "rms_tool_contour_um": lambda case: case.tool.rms / MICROMETRE,
    "max_command_contour_um": lambda case: case.command.max / MICROMETRE,
    "rms_command_contour_um": lambda case: case.command.rms / MICROMETRE,
    "residual_vibration_um": lambda case: max(case.residual_vibration.values(), default=0.0) / MICROMETRE,
    "cycle_time_s": lambda case: case.cycle_time,
}
COMPARISONS: Final[dict[str, Callable[[float, float], bool]]] = {
    ">": operator.gt,
    ">=": operator.ge,
    "<": operator.lt,
    "<=": operator.le,
}
PATTERN: Final = re.compile(r"\s*([a-z_]+)\s*(>=|<=|>|<)\s*([0-9]+(?:\.[0-9]*)?(?:[eE][-+]?[0-9]+)?)\s*")


@dataclass(frozen=True, slots=True)
class Gate:
    """A condition on the table's last row under which the run counts as failed."""

    text: str
    measure: str
    comparison: str
    bound: float

    def failure(self, summary: Summary) -> str | None:
        """What failed, in one line, or None."""
        case = summary.cases[-1]
        value = MEASURES[self.measure](case)
        if not COMPARISONS[self.comparison](value, self.bound):
            return None
        return f"gate failed: {self.measure} of {case.name} is {value:.4g}, and {self.text.strip()} fails"


def parse_gate(text: str) -> Gate:
    """Read a condition.

    Raises
    ------
    OptionError
        Not of the form ``measure > number``, or an unknown measure.
    """
    found = PATTERN.fullmatch(text)
    if found is None:
        raise OptionError(f"--fail-on {text!r} is no condition", hint='write --fail-on "max_contour_um>20"')
    measure, comparison, number = found.groups()
    if measure not in MEASURES:
        raise OptionError(f"--fail-on knows no measure {measure!r}", hint="it knows " + ", ".join(MEASURES))
    if not isfinite(float(number)):
        raise OptionError(f"--fail-on needs a finite number, not {number}")
    return Gate(text, measure, comparison, float(number))
