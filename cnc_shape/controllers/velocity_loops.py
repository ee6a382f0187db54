"""Velocity loops of servo motors: whether they settle, and what to tell where they do not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from cnc_shape.controllers.control import Control
from cnc_shape.controllers.gain_limits import largest_factor, last_stable
from cnc_shape.controllers.servo_model import at_ratio, gain_ratios, velocity_tick
from cnc_shape.errors import InfeasibleError
from cnc_shape.machine import Drive, ServoMotor

RATIO_HINT = "lower inertia_compensation.max_gain_ratio, or sample the velocity loop faster"
BANDWIDTH_HINT = "lower velocity_loop.bandwidth_rad_s, or sample the velocity loop faster"
OBSERVER_HINT = "lower disturbance_observer.bandwidth_rad_s, or its feedforward"
LITERAL_HINT = "choose another inertia_compensation.law, or raise velocity_loop.bandwidth_rad_s"

Stable = Callable[[float], bool]  # whether a joint is, its velocity gain held at a ratio to the nominal one


def settles(motor: ServoMotor, control: Control) -> bool:
    """Whether a motor comes to follow a constant velocity command."""
    inner = velocity_tick(motor, control).transition[1:, 1:]
    return bool(np.abs(np.linalg.eigvals(inner)).max() < 1.0)


def largest_stable_bandwidth(motor: ServoMotor, control: Control) -> float:
    """Largest bandwidth of a velocity loop with which it settles, rad/s."""
    loop = motor.velocity_loop

    def stable(factor: float) -> bool:
        faster = replace(loop, bandwidth=factor * loop.bandwidth)
        return settles(replace(motor, velocity_loop=faster), control)

    return loop.bandwidth * largest_factor(stable)


def largest_stable_observer(motor: ServoMotor, control: Control) -> float:
    """Largest bandwidth of the observer that is fed forward with which the velocity loop settles, rad/s."""
    observer = control.disturbance_observer
    if observer is None or observer.feedforward == 0.0:
        return np.inf

    def stable(factor: float) -> bool:
        faster = replace(observer, bandwidth=factor * observer.bandwidth)
        return settles(motor, replace(control, disturbance_observer=faster))

    return observer.bandwidth * largest_factor(stable)


def unsettled(
    name: str, motor: ServoMotor, control: Control, ratio: float, stable: Stable
) -> InfeasibleError:
    """What to tell of a velocity loop that does not settle at a gain ratio.

    `stable` says of a ratio whether the whole joint is stable there.
    """
    if stable(1.0):
        return out_of_ratio(f"the velocity loop of {name}", motor, control, ratio, stable)
    nominal = at_ratio(control, 1.0)
    observer = nominal.disturbance_observer
    if observer is not None and settles(motor, replace(nominal, disturbance_observer=None)):
        largest = largest_stable_observer(motor, nominal)
        return InfeasibleError(
            f"the disturbance observer makes the velocity loop of {name} unstable: bandwidth "
            f"{observer.bandwidth:g} rad/s, stable below {largest:.4g} rad/s",
            hint=OBSERVER_HINT,
        )
    largest = largest_stable_bandwidth(motor, nominal)
    return InfeasibleError(
        f"the velocity loop of {name} is unstable: bandwidth {motor.velocity_loop.bandwidth:g} rad/s, "
        f"stable below {largest:.4g} rad/s",
        hint=BANDWIDTH_HINT,
    )


def out_of_ratio(loop: str, motor: Drive, control: Control, ratio: float, stable: Stable) -> InfeasibleError:
    """What to tell of a loop that is stable at the nominal velocity gain but not at a ratio to it."""
    if ratio < 1.0:
        lowest = last_stable(stable, 1.0, ratio)
        return InfeasibleError(
            f"{loop} is unstable at {ratio:.3g} times its velocity gain, which the compensation may come to: "
            f"stable above {lowest:.4g}",
            hint=LITERAL_HINT,
        )
    inside = max((r for r in gain_ratios((motor,), control) if r < ratio), default=1.0)
    largest = last_stable(stable, inside, ratio)
    term = control.inertia_compensation
    given = ratio if term is None else term.max_gain_ratio
    return InfeasibleError(
        f"{loop} is unstable at {ratio:.3g} times its velocity gain: max_gain_ratio {given:g}, "
        f"stable below {largest:.4g}",
        hint=RATIO_HINT,
    )
