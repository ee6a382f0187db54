"""Section 5: a container under a trolley, and a step of 10 cm (Fig. 8).

The trolley is the package's machine with one mode, the command a step of 100 mm that goes through the
shaper, and the response the package's simulation. The paper's trolley is moved by a servo motor, whose
dynamics it names as the reason that the swing is gone later than designed, without telling them; so the step
is also run through a position loop whose gain is such that the unshaped swing is the 96.94 mm of the paper.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, cast

import numpy as np
from scipy.optimize import brentq  # pyright: ignore[reportUnknownVariableType]  # scipy ships no types

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.controllers.control import Control
from cnc_shape.experiments.specified_duration.equations import CONTAINER
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, FirstOrderLag, IdealDrive, Machine
from cnc_shape.shapers.analysis import vibration
from cnc_shape.shapers.shaper import NONE, Shaper
from cnc_shape.shapers.shaping import shape
from cnc_shape.simulation import simulate
from cnc_shape.trajectory import Trajectory

STEP: Final = 100.0  # mm
SAMPLE_TIME: Final = 1e-3  # s
RISE: Final = 0.02  # s, of the step: short against the swing, long against a sample
SETTLING: Final = 0.5 * CONTAINER.damped_period  # s, after the last impulse: the first swing is over
WATCHED: Final = 3.0 * CONTAINER.damped_period  # s
MOTOR_LAG: Final = 0.01  # s, assumed: short against the container's swing
CALM: Final = 0.1  # mm, from the target
MEASURED_UNSHAPED: Final = 96.94  # mm, section 5


@dataclass(frozen=True, eq=False, slots=True)
class Run:
    """A step of the trolley."""

    time: FloatArray  # (n,) s
    container: FloatArray  # (n,) mm
    amplitude: float  # mm, of the swing that is left
    calm_at: float  # s, from when on the container is within `CALM` of its target


def run(shaper: Shaper, position_gain: float | None = None) -> Run:
    """Step by 100 mm through `shaper`; `position_gain` (1/s) is the motor's, None for an ideal trolley."""
    drive = IdealDrive() if position_gain is None else FirstOrderLag(MOTOR_LAG)
    machine = Machine("trolley", (Axis("x", Limits(300.0, 500.0), drive, (CONTAINER,)),))
    control = Control(sample_time=SAMPLE_TIME, position_gain=position_gain or 20.0)
    command = shape(_step(shaper.duration + SETTLING + WATCHED), {"x": shaper})
    tool = simulate(command, machine, control).tool[:, 0]
    time = SAMPLE_TIME * np.arange(tool.size, dtype=np.float64)
    off = np.abs(tool - STEP)
    left = off[time >= shaper.duration + SETTLING]
    return Run(time, tool, float(left.max()), float(time[np.flatnonzero(off > CALM)[-1]]))


def _step(length: float) -> Trajectory:
    """A step that takes `RISE`, with continuous acceleration, and `length` s of rest."""
    time = SAMPLE_TIME * np.arange(round((RISE + length) / SAMPLE_TIME))
    u = np.clip(time / RISE, 0.0, 1.0)
    position = STEP * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    velocity = STEP / RISE * 30.0 * u**2 * (1.0 - u) ** 2
    acceleration = STEP / RISE**2 * 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u)
    column = [frozen(signal[:, None]) for signal in (position, velocity, acceleration)]
    return Trajectory(("x",), SAMPLE_TIME, frozen(position), *column)


def motor_gain() -> float:
    """Position gain, 1/s, at which a step leaves the measured swing unshaped."""

    def excess(gain: float) -> float:
        return run(NONE, gain).amplitude - MEASURED_UNSHAPED

    return cast("float", brentq(excess, 2.0 * CONTAINER.omega, 20.0 * CONTAINER.omega, xtol=1e-6))


def frequency_error(shaper: Shaper, left: float) -> float:
    """Smallest relative error of the frequency, upwards, with which V is `left`."""

    def excess(error: float) -> float:
        return float(vibration(shaper, CONTAINER.omega * (1.0 + error), CONTAINER.damping_ratio)) - left

    return cast("float", brentq(excess, 0.0, 0.05))
