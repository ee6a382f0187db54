"""Check of the loop that a machine file describes: stable at home in all directions, and by how much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf, isfinite, log10

import numpy as np

from cnc_shape.config.setup import Setup
from cnc_shape.controllers import Control
from cnc_shape.controllers.loop_model import lags
from cnc_shape.controllers.margins import Margins, servo_margins, worst, worst_margins
from cnc_shape.controllers.servo_model import gain_ratios, held_apart
from cnc_shape.controllers.stability import (
    DIRECTIONS,
    cartesian_loop,
    check_poses,
    check_stability,
    largest_stable_coupling,
)
from cnc_shape.joints import joints_of
from cnc_shape.kinematics.reach import CONDITION_LIMIT, condition
from cnc_shape.machine import Drive, ServoMotor
from cnc_shape.units import DEGREE

NO_MARGINS = Margins(inf, inf, inf, inf)  # where there is no loop: nothing to tell


def check_loop(setup: Setup) -> dict[str, float | None]:
    """Refuse an unstable loop; return its margins at home, ready for JSON.

    Home is where all axes stand at 0. Null where there is no end, as without any drive that
    lags, or where the machine cannot stand there. The largest cross-coupling is that of the file's ratios of
    integral and derivative to proportional gain, or of a proportional one. Margins of velocity loops are
    those of servo motors at their torque, the worst of all joints wherever a compensation may take the gain;
    null without such motors.

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
        others = replace(control, cross_coupling=None, joint_gains=control.joint_gains[joints.coupled :])
        check_stability(joints.drives[joints.coupled :], others)
    drives = [axis.drive for axis in axes]
    outer, coupling = NO_MARGINS, np.inf
    if len(home) and any(lags(drive) for drive in drives):
        outer = worst(
            worst_margins(drives, held, home[0], DIRECTIONS) for held in held_apart(drives, control)
        )
        coupling = largest_stable_coupling(drives, control, home)
    inner = _velocity_loops([axis.drive for axis in joints.drives], setup.control)
    numbers = {
        "gain_margin": outer.gain,
        "phase_margin_deg": outer.phase / DEGREE,
        "max_sensitivity": outer.sensitivity,
        "largest_stable_cross_coupling_per_s": coupling,
        "velocity_loop_gain_margin_db": 20.0 * log10(inner.gain),
        "velocity_loop_phase_margin_deg": inner.phase / DEGREE,
        "velocity_loop_max_sensitivity": inner.sensitivity,
    }
    return {name: float(number) if isfinite(number) else None for name, number in numbers.items()}


def _velocity_loops(drives: Sequence[Drive], control: Control) -> Margins:
    """Worst margins of the servo motors at their torque, over the ratios that their gains may come to."""
    gains = control.gains(len(drives))
    found = [
        servo_margins(drive, replace(control, position_gain=gain), ratio)
        for drive, gain in dict.fromkeys(zip(drives, gains, strict=True))
        if isinstance(drive, ServoMotor)
        for ratio in gain_ratios((drive,), control)
    ]
    return worst(found) if found else NO_MARGINS
