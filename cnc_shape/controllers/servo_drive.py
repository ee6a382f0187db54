# pyright: basic
"""Servo drive: encoder, velocity loop and motor, a tick of the velocity loop at a time.

One tick: the encoder is read; the velocity loop asks for a torque; the observer takes the reading; the motor
moves on with the torque of the tick before: computing takes a tick (spec: inertia compensation, 3.1).

The torque rises behind a first-order current lag, exactly over the tick. Coulomb friction takes what
speed it can and holds the motor where it can take all: stick and slip, without a smoothed sign. The integral
of the velocity loop holds torque, with the gain inside it, so that a gain that changes under load does not
kick (spec: 3.2).

Everything here is in rad and N m; a screw turns the axis's mm or rad into those of the motor.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import copysign
from typing import NamedTuple

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.controllers.lag import remaining
from cnc_shape.kernels import inlined
from cnc_shape.kernels.noise import normal
from cnc_shape.machine import Axis, ServoMotor
from cnc_shape.units import TWO_PI

ANGLE, SPEED, TORQUE = 0, 1, 2  # columns of a motor's memory: what it does, rad, rad/s, N m behind the lag
ASKED, FRICTION = 3, 4  # torque of the tick before and what of it is modelled friction, N m
INTEGRAL = 5  # of the velocity loop, N m
READ, BEFORE = 6, 7  # the encoder now and the tick before, rad
COLUMNS = 8

PITCH = 0  # columns of the numbers of a motor: mm or rad of the joint per rad of the motor
COUNT = 1  # rad, of the encoder; 0: it is exact
PER_TORQUE = 2  # rad/s per N m, what a torque held for a tick adds to the speed
DRAG, COULOMB = 3, 4  # factor by which viscous friction slows in a tick, rad/s that Coulomb friction takes
LIMIT = 5  # N m
LAG, DECAY = 6, 7  # what is left of a torque error, in the mean over a tick, and at its end
BELIEVED = 8  # kg m^2, inertia that the controllers take it for
GAIN, INTEGRAL_RATE = 9, 10  # N m s, velocity gain at a gain ratio of 1; tick over integral time
NUMBERS = 11


class Motors(NamedTuple):
    """Servo motors and their velocity loops."""

    servo: IntArray  # (j,) 1: the joint has a servo motor
    ticks: int  # of the velocity loop in a sample
    period: float  # s, of a tick
    numbers: FloatArray  # (j,11), a row for every joint, also for one without a motor
    noise: float  # counts, standard deviation of a reading
    seed: int


def motors(joints: Sequence[Axis], sample_time: float, noise: float = 0.0, seed: int = 0) -> Motors:
    """Motors of a machine's joints, their velocity loops in step with samples of `sample_time` (s).

    Raises
    ------
    ValueError
        Velocity loops that tick differently, or whose ticks do not fill a sample.
    """
    period, ticks = velocity_ticks(joints, sample_time)
    rows = np.array([_row(joint, period) for joint in joints])
    servo = frozen_integers([isinstance(joint.drive, ServoMotor) for joint in joints])
    return Motors(servo, ticks, period, frozen(rows), noise, seed)


def velocity_ticks(joints: Sequence[Axis], sample_time: float) -> tuple[float, int]:
    """Tick of the velocity loops, s, and how many make a sample.

    Raises
    ------
    ValueError
        As `motors`.
    """
    loops = [joint.drive.velocity_loop for joint in joints if isinstance(joint.drive, ServoMotor)]
    own = {loop.sample_time for loop in loops}
    if len(own) > 1:
        raise ValueError(f"velocity loops tick differently: {sorted(own)}")
    if not loops:
        return sample_time, 1
    period, ticks = loops[0].sample_time, loops[0].ticks(sample_time)
    if abs(ticks * period - sample_time) > 1e-9 * sample_time:
        raise ValueError(f"{sample_time=} is no multiple of {period=}")
    return sample_time / ticks, ticks


def _row(joint: Axis, period: float) -> tuple[float, ...]:
    """The numbers of a motor; a joint without one turns as it moves."""
    drive = joint.drive
    if not isinstance(drive, ServoMotor):
        return (1.0, *(0.0,) * (NUMBERS - 1))
    loop, lag = drive.velocity_loop, drive.current_time_constant
    decay = remaining(lag, period)
    count = TWO_PI / drive.encoder_counts if drive.encoder_counts else 0.0
    return (
        drive.pitch, count, period / drive.inertia, 1.0 / (1.0 + period * drive.viscous / drive.inertia),
        period * drive.coulomb / drive.inertia, drive.torque_limit, lag / period * (1.0 - decay), decay,
        drive.believed_inertia, drive.velocity_gain, period / loop.integral_time,
    )  # fmt: skip


def start(motors: Motors, reference: FloatArray) -> FloatArray:
    """Memory of motors at rest where their joints are at `reference` (j,) mm or rad, (j,8)."""
    memory = np.zeros((reference.size, COLUMNS))
    memory[:, ANGLE] = memory[:, READ] = reference / motors.numbers[:, PITCH]
    count = motors.numbers[:, COUNT]
    fine = count > 0.0
    memory[fine, READ] = np.floor(memory[fine, ANGLE] / count[fine] + 0.5) * count[fine]
    memory[:, BEFORE] = memory[:, READ]
    return memory


@inlined
def reading(angle, count, noise, seed, joint, tick):
    """What an encoder reads at an angle (rad), rad.

    count rad; noise: standard deviation in counts; seed, joint, tick: of its place among all readings.
    """
    if count <= 0.0:
        return angle
    counts = angle / count
    if noise > 0.0:
        counts += noise * normal(seed, joint, tick)
    return np.floor(counts + 0.5) * count


@inlined
def measure(motors, j, tick, memory):
    """Read the encoder of joint j at a sample. memory (j,8)."""
    memory[j, BEFORE] = memory[j, READ]
    count = motors.numbers[j, COUNT]
    memory[j, READ] = reading(memory[j, ANGLE], count, motors.noise, motors.seed, j, tick)


@inlined
def velocity_step(error, gain, integral_rate, fed, limit, integral):
    """Torque that a velocity loop asks for, and its integral, N m.

    error rad/s; gain N m s; integral_rate: tick over integral time; fed N m: torque fed forward;
    limit N m.
    """
    step = gain * integral_rate * error
    asked = gain * error + (integral + step) + fed
    if abs(asked) <= limit or asked * error < 0.0:  # else the integral would wind up
        integral += step
    return min(max(asked, -limit), limit), integral


@inlined
def motor_step(period, per_torque, drag, coulomb, lag, decay, asked, load, angle, speed, torque):
    """Angle, speed and torque of a motor a tick later, under the torque asked for the tick before.

    per_torque: speed per torque held for a tick, rad/s per N m; drag: factor by which viscous friction slows;
    coulomb rad/s: what Coulomb friction takes of the speed; lag, decay: of the current; load N m.
    """
    mean = asked + (torque - asked) * lag
    free = (speed + per_torque * (mean - load)) * drag
    slowed = abs(free) - coulomb
    after = copysign(slowed, free) if slowed > 0.0 else 0.0
    return angle + 0.5 * period * (speed + after), after, asked + (torque - asked) * decay
