"""Margins of the methods at a motor's torque."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from cnc_shape.controllers import Control
from cnc_shape.controllers.margins import Margins, servo_margins
from cnc_shape.machine import ServoMotor


@cache
def margins_of(motor: ServoMotor, share: float, control: Control, ratio: float) -> Margins:
    """Margins with a share of the motor's inertia, which the controllers do not know of, at a gain ratio."""
    return servo_margins(replace(motor, inertia=share * motor.inertia), control, ratio)
