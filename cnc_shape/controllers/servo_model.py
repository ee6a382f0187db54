"""A servo motor with its velocity loop, linear: from tick to tick, from sample to sample, and over frequency.

Left out is what is not linear: Coulomb friction, the torque limit, the encoder's counts, and that the gain
moves; it is held at one ratio to its nominal value. The motor answers the torque of the tick before.

One tick of `h` with command c, angle th and reading y, which is th (spec: inertia compensation, 3.1 to 3.3):

    e = c - (y - y_before) / h,  x+ = x + K h / Ti e,  u = K e + x+ + g T^
    motor, observer: exact over the tick under the torque asked for in the tick before, u_before

The motor is answered for exactly, torque behind the lag and viscous friction together. The loop's kernel
splits them within a tick, because of Coulomb friction, and so bears some hundredths more gain than told here.

The controllers believe in the nominal inertia, the motor has its own. The angle itself moves nothing but
itself: all else is told by what it moved by, so that a velocity loop has no pole that stands at z = 1.

The loop over frequency is broken at the motor's torque: the observer hears what the controller asks for. The
position loop speaks once in several ticks. Its sample and hold is taken by the part that does not depend on
when within the sample one looks, the mean over the ticks for which a command is held.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm  # pyright: ignore[reportUnknownVariableType]  # scipy ships no types

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.controllers import disturbance_observer
from cnc_shape.controllers.compensation import (
    WATCHING,
    DisturbanceObserver,
    GainLaw,
    InertiaCompensation,
)
from cnc_shape.controllers.control import Control
from cnc_shape.controllers.inertia_compensation import SMALLEST_RATIO
from cnc_shape.machine import Drive, ServoMotor

BETWEEN = 8  # steps from the lowest ratio to the highest at which a loop is looked at
NO_LAG = 1e-6  # -, share of a tick below which a current lag is none

Complex = NDArray[np.complex128]


class LinearDrive(NamedTuple):
    """A drive under a held command: ``x+ = transition x + held u``; x begins with the position."""

    transition: FloatArray  # (s,s), of whose first column all but the first is zero
    held: FloatArray  # (s,)


def at_ratio(control: Control, ratio: float) -> Control:
    """Return the loop with its velocity gain held at a ratio to the nominal one."""
    term = control.inertia_compensation
    if term is None:
        if ratio == 1.0:
            return control
        term = InertiaCompensation()
    return replace(control, inertia_compensation=replace(term, law=GainLaw.FIXED, max_gain_ratio=ratio))


def gain_ratios(drives: Sequence[Drive], control: Control) -> tuple[float, ...]:
    """Ratios of the velocity gains at which a loop is looked at: first 1 where it starts there."""
    low, high = ratio_bounds(control)
    if low == high or not _any_motor(drives):
        return (low if _any_motor(drives) else 1.0,)
    steps = [float(ratio) for ratio in np.geomspace(low, high, BETWEEN + 1)]
    down = sorted((ratio for ratio in steps if ratio < 1.0), reverse=True)
    return (1.0, *down, *(ratio for ratio in steps if ratio > 1.0))


def held_apart(drives: Sequence[Drive], control: Control) -> list[Control]:
    """Hold the velocity gains where they start, and where they may come to at least and at most."""
    if not _any_motor(drives):
        return [control]
    ratios = dict.fromkeys((gain_ratios(drives, control)[0], *ratio_bounds(control)))
    return [at_ratio(control, ratio) for ratio in ratios]


def velocity_tick(motor: ServoMotor, control: Control) -> LinearDrive:
    """One tick of a motor under its velocity command: angle in rad, command in rad/s.

    States: angle; what it moved by in the last tick; speed; torque behind the current lag; torque asked for;
    where it acts, the integral; where it is fed forward, the observer: how far it is ahead of the angle, its
    speed and its load.
    """
    h = control.sample_time / motor.velocity_loop.ticks(control.sample_time)
    believed, loop, observer = motor.believed_inertia, motor.velocity_loop, _observer(control)
    gain, rate = _gains(motor, control)
    row = np.eye(10)
    angle, gap, speed, torque, asked, holding, ahead, seen, load, command = row
    error = command - gap / h
    held = holding + gain * rate * h * error
    told = gain * error + held + observer.feedforward * load
    moving = _motion(motor, h)
    moved, sped, risen = moving @ np.stack([speed, torque, asked])
    correction = disturbance_observer.gains(observer, h)
    driven = h / believed * (asked - load)
    after = np.stack([
        angle + moved,
        moved,
        speed + sped,
        torque + risen,
        told,
        held,
        ahead + h * seen + 0.5 * h * driven - correction.angle * ahead - moved,
        seen + driven - correction.speed * ahead,
        load - believed * correction.load * ahead,
    ])  # fmt: skip
    used = np.array([True] * 5 + [loop.integral_time < inf] + [observer.feedforward != 0.0] * 3)
    return LinearDrive(after[used, :-1][:, used], after[used, -1])


@lru_cache(maxsize=256)
def lifted(motor: ServoMotor, control: Control) -> LinearDrive:
    """All ticks of a sample under one velocity command: position in mm or rad of the axis, command per s."""
    tick = velocity_tick(motor, control)
    s = tick.held.size
    augmented = np.eye(s + 1)  # the command is a state that stays
    augmented[:s, :s], augmented[:s, s] = tick
    sample = np.linalg.matrix_power(augmented, motor.velocity_loop.ticks(control.sample_time))
    sample[0, 1:s] *= motor.pitch
    sample[1:s, s] /= motor.pitch
    return LinearDrive(frozen(sample[:s, :s]), frozen(sample[:s, s]))


def torque_transfer(motor: ServoMotor, control: Control, z: Complex) -> Complex:
    """Loop transfer L(z) at the motor's torque, (f,): velocity and position loop; z (f,) is of a tick."""
    ticks = motor.velocity_loop.ticks(control.sample_time)
    h = control.sample_time / ticks
    observer, believed = _observer(control), motor.believed_inertia
    gain, rate = _gains(motor, control)
    late = float(control.delay_samples * ticks)
    heard = (1.0 - z**-ticks) / (1.0 - 1.0 / z) / ticks * z**-late
    answer = gain * (1.0 + rate * h * z / (z - 1.0))
    answer = answer * (control.position_gain * heard + (1.0 - 1.0 / z) / h)
    pole = disturbance_observer.gains(observer, h).pole
    filtered = observer.feedforward * (1.0 - pole) ** 3 / (z - pole) ** 3
    answer = answer + filtered * believed * (z - 1.0) ** 2 / h**2
    answer = answer / (1.0 - 0.5 * filtered * (z + 1.0) / z)
    moving = _motion(motor, h)
    torque = moving[2, 2] / (z - 1.0 - moving[2, 1])
    speed = (moving[1, 1] * torque + moving[1, 2]) / (z - 1.0 - moving[1, 0])
    angle = (moving[0, 0] * speed + moving[0, 1] * torque + moving[0, 2]) / (z - 1.0)
    return np.asarray(answer * angle / z, dtype=np.complex128)


def ratio_bounds(control: Control) -> tuple[float, float]:
    """Lowest and highest ratio that the velocity gain may come to, 1 where nothing moves it."""
    term = control.inertia_compensation
    if term is None:
        return 1.0, 1.0
    largest = term.max_gain_ratio
    if term.law is GainLaw.FIXED:
        return largest, largest
    literal = term.law in (GainLaw.LITERAL, GainLaw.LITERAL_INVERSE)
    return min(SMALLEST_RATIO if literal else 1.0, largest), max(largest, 1.0)


def _any_motor(drives: Sequence[Drive]) -> bool:
    return any(isinstance(drive, ServoMotor) for drive in drives)


def _observer(control: Control) -> DisturbanceObserver:
    return control.disturbance_observer or WATCHING


def _gains(motor: ServoMotor, control: Control) -> tuple[float, float]:
    """Torque gain of the velocity loop, N m s, and the rate of its integral, 1/s."""
    term, loop = control.inertia_compensation, motor.velocity_loop
    ratio = 1.0 if term is None else term.starting_ratio
    stiffening = ratio if term is not None and term.scale_integral_time else 1.0
    return motor.velocity_gain * ratio, stiffening / loop.integral_time


def _motion(motor: ServoMotor, h: float) -> FloatArray:
    """What angle, speed and torque grow by over a tick, per speed, torque and torque asked for, (3,3)."""
    lag = motor.current_time_constant
    return _exact_motion(motor.inertia, motor.viscous, lag if lag > NO_LAG * h else 0.0, h)


@lru_cache(maxsize=256)
def _exact_motion(inertia: float, viscous: float, lag: float, h: float) -> FloatArray:
    """As `_motion`, exactly."""
    rates = np.zeros((4, 4))
    rates[0, 1] = 1.0
    rates[1, 1:3] = -viscous / inertia, 1.0 / inertia
    if lag > 0.0:
        rates[2, 2:] = -1.0 / lag, 1.0 / lag
    grown = np.asarray(expm(rates * h), dtype=np.float64)
    if lag == 0.0:  # the torque asked for is there at once, whatever there was before
        grown[:, 3] += grown[:, 2]
        grown[:, 2] = 0.0
    return frozen(grown[:3, 1:] - np.eye(3, 3, -1))
