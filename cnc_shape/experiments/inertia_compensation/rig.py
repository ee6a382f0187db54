"""The test bed: three axes, each a driving motor with a loading motor on its shaft; and laps of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Final

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.controllers import Control
from cnc_shape.disturbances import UNDISTURBED, Disturbances
from cnc_shape.experiments.inertia_compensation.loads import BURST_LOAD, PULSE_LOAD
from cnc_shape.experiments.inertia_compensation.time_law import TiltedCircle, command, off_circle, toolpath
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, Machine, ServoMotor, VelocityLoop
from cnc_shape.program import XYZ
from cnc_shape.response import MotorSignals, Response
from cnc_shape.simulation import simulate
from cnc_shape.units import MICROMETRE

NO_LIMIT: Final = Limits(velocity=np.inf, acceleration=np.inf)
INERTIA: Final = 4.6e-4  # kg m^2: two rotors of 750 W, 2.11e-4 each, and a coupling of 0.4e-4
COULOMB: Final = 0.0808  # N m, fitted
MOTOR: Final = ServoMotor(
    inertia=INERTIA,
    torque_limit=7.1,
    lead=10.0,
    viscous=5e-4,
    coulomb=COULOMB,
    current_time_constant=2e-4,
    encoder_counts=131072,
    velocity_loop=VelocityLoop(bandwidth=400.0, integral_time=0.01, sample_time=2.5e-4),
    nominal_inertia=INERTIA,
)
SHOWN: Final = 0.005  # half the last digit shown of numbers that the paper does not print
CIRCLE: Final = TiltedCircle()


@dataclass(frozen=True, slots=True)
class Trial:
    """A lap: the path, the motors of the axes, and what disturbs them."""

    circle: TiltedCircle = CIRCLE
    motors: tuple[ServoMotor, ...] = (MOTOR, MOTOR, MOTOR)
    disturbances: Disturbances = UNDISTURBED

    @property
    def machine(self) -> Machine:
        """The three axes."""
        axes = tuple(Axis(name, NO_LIMIT, motor) for name, motor in zip(XYZ, self.motors, strict=True))
        return Machine("three coupled motors", axes)

    def under(self, disturbances: Disturbances) -> Trial:
        """The same lap under other disturbances."""
        return replace(self, disturbances=disturbances)

    def of_inertia(self, *inertia: float) -> Trial:
        """The same lap with other true inertias, kg m^2: one for all, or one an axis."""
        every = inertia if len(inertia) > 1 else inertia * len(XYZ)
        motors = (replace(motor, inertia=one) for motor, one in zip(self.motors, every, strict=True))
        return replace(self, motors=tuple(motors))


@dataclass(frozen=True, eq=False, slots=True)
class Lap:
    """A trial run: the response, and how far it was from the circle."""

    response: Response
    distance: FloatArray = field(repr=False)  # (n,) mm, contour error, start and stop included

    @property
    def motors(self) -> MotorSignals:
        """What the motors of the axes did."""
        motors = self.response.motors
        assert motors is not None
        return motors

    @property
    def rms(self) -> float:
        """Contour error over all samples, µm."""
        return float(np.sqrt(np.mean(self.distance**2))) / MICROMETRE

    @property
    def max(self) -> float:
        """Largest contour error, µm."""
        return float(self.distance.max()) / MICROMETRE


def run(trial: Trial, control: Control) -> Lap:
    """Run a lap."""
    circle = trial.circle
    response = simulate(
        command(circle), trial.machine, control, toolpath=toolpath(circle), disturbances=trial.disturbances
    )
    return Lap(response, frozen(off_circle(circle, response.position)))


UNLOADED: Final = Trial()
LOADED: Final = UNLOADED.under(BURST_LOAD)
PULSED: Final = UNLOADED.under(PULSE_LOAD)
LOADS: Final[Mapping[str, Trial]] = {"the burst": LOADED, "three pulses": PULSED, "no load": UNLOADED}


@cache
def lap(trial: Trial, control: Control) -> Lap:
    """A lap that is looked at more than once."""
    return run(trial, control)


@cache
def errors(trial: Trial, control: Control) -> tuple[float, float]:
    """Contour error of a lap, µm: RMS and largest."""
    found = run(trial, control)
    return found.rms, found.max


def ripple(found: Lap) -> float:
    """Standard deviation of what the torque changes by from sample to sample, N m."""
    return float(np.diff(found.motors.torque, axis=0).std())
