"""Check of the loop that a machine file describes: stable at home in all directions, and by how much."""

from __future__ import annotations

from math import isfinite

import numpy as np

from cnc_shape.config.setup import Setup
from cnc_shape.controllers.margins import worst_margins
from cnc_shape.controllers.stability import (
    DIRECTIONS,
    cartesian_loop,
    check_poses,
    check_stability,
    largest_stable_coupling,
)
from cnc_shape.machine import FirstOrderLag, IdealDrive
from cnc_shape.units import DEGREE


def check_loop(setup: Setup) -> dict[str, float | None]:
    """Refuse an unstable loop; return its margins at home, ready for JSON.

    Home is where all axes stand at 0. Null where there is no end: no drive that lags, or no such pose.

    Raises
    ------
    InfeasibleError
        As `check_stability`.
    """
    machine, control, kinematics = setup.machine, setup.control, setup.kinematics
    if kinematics.name == "cartesian":
        check_stability(machine.axes, control)
        axes, control = cartesian_loop(machine.axes, control)
        drives = tuple(axis.drive for axis in axes)
        inverse_jacobian = np.eye(len(drives))
    else:
        others = [axis.drive for axis in machine.axes if axis.name not in kinematics.axes]
        drives = (*(machine.joints or (IdealDrive(),) * len(kinematics.joints)), *others)
        inverse_jacobian = kinematics.inverse_jacobian(np.zeros((1, len(kinematics.axes))))[0]
        reachable = bool(np.isfinite(inverse_jacobian).all())
        check_poses(drives, control, inverse_jacobian[None] if reachable else np.zeros((0, 1, 1)))
        if not reachable:
            drives = ()
    if not any(isinstance(drive, FirstOrderLag) for drive in drives):
        return _summary(np.inf, np.inf, np.inf, np.inf)
    margins = worst_margins(drives, control, inverse_jacobian, DIRECTIONS)
    largest = largest_stable_coupling(drives, control, inverse_jacobian[None])
    return _summary(margins.gain, margins.phase / DEGREE, margins.sensitivity, largest)


def _summary(gain: float, phase: float, sensitivity: float, coupling: float) -> dict[str, float | None]:
    numbers = {
        "gain_margin": gain,
        "phase_margin_deg": phase,
        "max_sensitivity": sensitivity,
        "largest_stable_cross_coupling_per_s": coupling,
    }
    return {name: float(number) if isfinite(number) else None for name, number in numbers.items()}
