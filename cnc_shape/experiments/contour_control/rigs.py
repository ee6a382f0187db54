"""The machines of the experiment, and contours run on them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.contour import ContourError, contour_error
from cnc_shape.controllers import Control
from cnc_shape.errors import InfeasibleError
from cnc_shape.experiments.contour_control.contours import Contour, contours
from cnc_shape.experiments.contour_control.time_law import TimeLaw, command
from cnc_shape.kinematics import Kinematics, cartesian, cubic_parallel, cubic_rails
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, FirstOrderLag, Machine
from cnc_shape.program import XYZ
from cnc_shape.response import Response
from cnc_shape.simulation import simulate
from cnc_shape.toolpath import Toolpath
from cnc_shape.trajectory import Trajectory
from cnc_shape.units import MICROMETRE
from cnc_shape.windows import LOOPS_AHEAD, LOOPS_BACK, MARGIN, foot_windows

PLANTS: Final = tuple(  # Table 1 of the paper
    FirstOrderLag(time_constant, gain)
    for time_constant, gain in (
        (0.0153, 0.9930), (0.0142, 0.9982), (0.0160, 0.9755), (0.0126, 1.0029), (0.0138, 1.0004),
        (0.0151, 0.9901),
    )
)  # fmt: skip
HALF_WIDTH, LINK_LENGTH, TOOL_OFFSET = 60.0, 300.0, (0.0, 0.0, -60.0)  # mm
RAILS: Final = cubic_rails(HALF_WIDTH, LINK_LENGTH, frozen(TOOL_OFFSET))
NO_LIMIT: Final = Limits(velocity=np.inf, acceleration=np.inf)
SHOWN: Final = 0.005  # half the last digit shown of numbers that the paper does not print


@dataclass(frozen=True, slots=True)
class Rig:
    """A machine with its kinematics."""

    name: str
    machine: Machine
    kinematics: Kinematics


@dataclass(frozen=True, eq=False, slots=True)
class Motion:
    """A contour, its command, and where every sample may find its nearest point."""

    contour: Contour
    command: Trajectory
    toolpath: Toolpath
    lower: FloatArray  # (n,) mm of path
    upper: FloatArray  # (n,) mm of path


@dataclass(frozen=True, eq=False, slots=True)
class Result:
    """A contour run."""

    motion: Motion
    response: Response
    error: ContourError

    @property
    def rms(self) -> float:
        """Contour error over all samples, rests included, µm."""
        return self.error.rms / MICROMETRE

    @property
    def max(self) -> float:
        """Largest contour error, µm."""
        return self.error.max / MICROMETRE


CARTESIAN: Final = Rig(
    "cartesian",
    Machine(
        "cartesian", tuple(Axis(name, NO_LIMIT, plant) for name, plant in zip(XYZ, PLANTS[:3], strict=True))
    ),
    cartesian(),
)
CUBIC: Final = Rig(
    "cubic",
    Machine("cubic", tuple(Axis(name, NO_LIMIT) for name in XYZ), PLANTS),
    cubic_parallel(RAILS),
)


@cache
def motion(name: str, law: TimeLaw, gain: float) -> Motion:
    """A contour's motion, to be measured under a position gain (1/s)."""
    contour = contours()[name]
    told = command(contour, law)
    lag = 1.0 / (gain * law.sample_time)  # samples
    lower, upper = foot_windows(told.arc_length, round(LOOPS_BACK * lag), round(LOOPS_AHEAD * lag), MARGIN)
    return Motion(contour, told, contour.toolpath(), frozen(lower), frozen(upper))


SMOOTH: Final = TimeLaw(interpolation_period=8e-3)  # at which the paper's h means something on the fan
FINE: Final = TimeLaw()
TRIALS: Final[Mapping[str, tuple[str, TimeLaw]]] = {
    "fan": ("fan", SMOOTH),
    "circle20": ("circle20", FINE),
    "circle5": ("circle5", FINE),
    "diamond, through": ("diamond", FINE),
    "diamond, stops": ("diamond", TimeLaw(stops=True)),
    "corner, through": ("corner", FINE),
    "lemniscate": ("lemniscate", FINE),
    "helix": ("helix", FINE),
    "line": ("line", TimeLaw(dwell=20.0)),
}


@cache
def errors(rig: Rig, name: str, control: Control, law: TimeLaw | None = None) -> tuple[float, float]:
    """Contour error of a trial, µm: RMS and largest; nan where the loop diverges."""
    try:
        result = run(rig, name, control, law)
    except InfeasibleError:
        return np.nan, np.nan
    return result.rms, result.max


def run(rig: Rig, name: str, control: Control, law: TimeLaw | None = None) -> Result:
    """Run a trial, by its own time law unless another one is given."""
    contour, usual = TRIALS[name]
    told = motion(contour, law or usual, control.position_gain)
    response = simulate(told.command, rig.machine, control, rig.kinematics, told.toolpath)
    error = contour_error(response.position, told.toolpath, told.lower, told.upper)
    return Result(told, response, error)
