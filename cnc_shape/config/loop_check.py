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
from cnc_shape.joints import joints_of
from cnc_shape.kinematics.reach import CONDITION_LIMIT, condition
from cnc_shape.machine import FirstOrderLag
from cnc_shape.units import DEGREE


def check_loop(setup: Setup) -> dict[str, float | None]:
    """Refuse an unstable loop; return its margins at home, ready for JSON.

    Home is where all axes stand at 0. Null where there is no end, as without any drive that
    lags, or where the machine cannot stand there. The largest cross-coupling is that of the file's ratios of
    integral and derivative to proportional gain, or of a proportional one.

    Raises
    ------
    InfeasibleError
        As `check_stability`.
    """
    joints, control = joints_of(setup.machine, setup.kinematics), setup.control
    if joints.cartesian:
        check_stability(joints.drives, control)  # names the axes
        axes, control = cartesian_loop(joints.drives, control)
        home = np.eye(len(axes))[None]
    else:
        axes = joints.drives[: joints.coupled]
        origin = np.zeros((1, len(axes)))
        held = condition(joints.kinematics, origin)[0] <= CONDITION_LIMIT
        home = joints.inverse_jacobian(origin)[held]
        check_poses([axis.drive for axis in axes], control, home)
    drives = [axis.drive for axis in axes]
    if not len(home) or not any(isinstance(drive, FirstOrderLag) for drive in drives):
        return _summary(np.inf, np.inf, np.inf, np.inf)
    margins = worst_margins(drives, control, home[0], DIRECTIONS)
    largest = largest_stable_coupling(drives, control, home)
    return _summary(margins.gain, margins.phase / DEGREE, margins.sensitivity, largest)


def _summary(gain: float, phase: float, sensitivity: float, coupling: float) -> dict[str, float | None]:
    numbers = {
        "gain_margin": gain,
        "phase_margin_deg": phase,
        "max_sensitivity": sensitivity,
        "largest_stable_cross_coupling_per_s": coupling,
    }
    return {name: float(number) if isfinite(number) else None for name, number in numbers.items()}
