"""What observer and identification make of a motor that is known."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from typing import Final

import numpy as np

from cnc_shape.arrays import frozen
from cnc_shape.controllers import InertiaIdentification
from cnc_shape.disturbances import UNDISTURBED, Disturbances, LoadTorque, ProfileTable, Steps
from cnc_shape.experiments.experiment import Row, Table
from cnc_shape.experiments.inertia_compensation.methods import NONE, observed
from cnc_shape.experiments.inertia_compensation.rig import (
    INERTIA,
    LOADED,
    MOTOR,
    NO_LIMIT,
    SHOWN,
    Trial,
    lap,
)
from cnc_shape.machine import Axis, Machine
from cnc_shape.simulation import simulate
from cnc_shape.trajectory import Trajectory

BANDWIDTHS: Final = (150.0, 300.0)  # rad/s
TRUE: Final = (0.5, 1.0, 2.0, 3.0)  # of the nominal inertia
AMPLITUDE, FREQUENCY, SECONDS = 10.0, 2.0, 5.0  # mm, Hz, s of the motion that excites
CONSTANT: Final = Disturbances((LoadTorque("x", 1.0, Steps((0.0,), (1.0,))),))  # 1 N m
IN_PHASE: Final = 0.3  # N m
IDENTIFYING: Final = replace(NONE, inertia_identification=InertiaIdentification())


def frictionless(trial: Trial) -> Trial:
    """The same lap on motors that do not rub."""
    smooth = (replace(motor, coulomb=0.0, viscous=0.0) for motor in trial.motors)
    return replace(trial, motors=tuple(smooth))


def estimate_error(trial: Trial, bandwidth: float, delay: float = 0.0) -> float:
    """RMS of what the observer's estimate is off by, over that of load and friction.

    delay s: by how much the estimate is taken later than the load.
    """
    found, period = lap(trial, observed(bandwidth)), trial.circle.sample_time
    motors = found.motors
    pitch, viscous, coulomb = (
        frozen(column)
        for column in zip(*((m.pitch, m.viscous, m.coulomb) for m in trial.motors), strict=True)
    )
    angle = found.response.joint / pitch
    speed = (np.vstack([angle[1:], angle[-1:]]) - np.vstack([angle[:1], angle[:-1]])) / (2.0 * period)
    borne = motors.load + viscous * speed + coulomb * np.sign(speed)
    late = round(delay / period)
    borne, seen = borne[: len(borne) - late], motors.estimate[late:]
    return float(np.sqrt(np.mean((seen - borne) ** 2) / np.mean(borne**2)))


def observer_table() -> Table:
    """The observed torque against the injected one."""
    rows: list[Row] = []
    for name, trial in (("no friction", frictionless(LOADED)), ("friction", LOADED)):
        for bandwidth in BANDWIDTHS:
            raw = estimate_error(trial, bandwidth)
            rows += [
                Row(f"{name}, {bandwidth:g} rad/s: as it comes", "%", None, 100.0 * raw, SHOWN,
                    "RMS over all axes, of that of load and friction"),
                Row(f"{name}, {bandwidth:g} rad/s: {3e3 / bandwidth:g} ms later", "%", None,
                    100.0 * estimate_error(trial, bandwidth, 3.0 / bandwidth), SHOWN,
                    "the delay 3/ω of three poles taken out"),
            ]  # fmt: skip
    return Table(
        "Eqs 1 to 5, Fig. 6: the observed disturbance torque under the burst",
        tuple(rows),
        "The observer sees all that the nominal inertia does not explain: friction is part of it.",
    )


def shuttle() -> Trajectory:
    """To and fro on one axis, from rest."""
    omega, period = 2.0 * pi * FREQUENCY, NONE.sample_time
    t = period * np.arange(round(SECONDS / period) + 1, dtype=np.float64)
    position = AMPLITUDE * (1.0 - np.cos(omega * t))
    velocity = AMPLITUDE * omega * np.sin(omega * t)
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(position)))])
    acceleration = AMPLITUDE * omega**2 * np.cos(omega * t)
    columns = (frozen(column[:, None]) for column in (position, velocity, acceleration))
    return Trajectory(("x",), period, frozen(travel), *columns)


def in_phase() -> Disturbances:
    """A load that goes with the acceleration of the shuttle."""
    command = shuttle()
    times = command.sample_time * np.arange(len(command))
    shape = command.acceleration[:, 0] / np.abs(command.acceleration).max()
    table = ProfileTable(tuple(times.tolist()), tuple(shape.tolist()))
    return Disturbances((LoadTorque("x", IN_PHASE, table),))


def identified(share: float, disturbances: Disturbances = UNDISTURBED) -> float:
    """Inertia that is identified over the nominal one, where the true one is `share` times that."""
    motor = replace(MOTOR, inertia=share * INERTIA)
    machine = Machine("one motor", (Axis("x", NO_LIMIT, motor),))
    motors = simulate(shuttle(), machine, IDENTIFYING, disturbances=disturbances).motors
    assert motors is not None
    return float(motors.inertia[-1, 0]) / INERTIA


def identification_table() -> Table:
    """The true inertia by recursive least squares."""
    rows = [
        Row(f"true inertia {share:g}, {word}", "-", None, identified(share, load), 5e-4,
            "of the nominal one, after 5 s")
        for word, load in (("no load", UNDISTURBED), ("1 N m all the time", CONSTANT))
        for share in TRUE
    ]  # fmt: skip
    peak = float(np.abs(shuttle().acceleration).max()) / MOTOR.pitch
    motors = lap(LOADED, IDENTIFYING).motors
    rows += [
        Row("true inertia 1, a load in phase with the acceleration", "-", None,
            identified(1.0, in_phase()), 5e-4,
            f"{IN_PHASE:g} N m at {peak:.0f} rad/s² are {IN_PHASE / peak / INERTIA:.2f} of the inertia: "
            "that cannot be told apart by anyone"),
        Row("on the circle of Table 1 under the burst", "-", None,
            float(motors.inertia.max()) / INERTIA, 5e-4,
            "largest: the acceleration is far below the 200 rad/s² from which on anything is learnt"),
    ]  # fmt: skip
    return Table(
        "Beyond the paper: the true inertia, identified",
        tuple(rows),
        f"One axis to and fro, {AMPLITUDE:g} mm at {FREQUENCY:g} Hz. Least squares with a constant load and "
        "Coulomb friction as unknowns besides. On the circle a load that turns with the path looks like "
        "inertia, so nothing is learnt there.",
    )
