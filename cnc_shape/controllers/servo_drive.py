# pyright: basic
"""Servo drive: encoder, velocity loop and motor, at a tick of their own within every sample of the loop.

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
from math import copysign, exp
from typing import NamedTuple

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.controllers import disturbance_observer as watching
from cnc_shape.controllers import friction_feedforward as friction
from cnc_shape.controllers import inertia_compensation as compensation
from cnc_shape.controllers import inertia_identification as identification
from cnc_shape.kernels import kernel
from cnc_shape.kernels.noise import normal
from cnc_shape.machine import Axis, ServoMotor
from cnc_shape.units import TWO_PI

ANGLE, SPEED, TORQUE = 0, 1, 2  # columns of a motor's memory: what it does, rad, rad/s, N m behind the lag
ASKED, FRICTION = 3, 4  # torque of the tick before and what of it is modelled friction, N m
INTEGRAL = 5  # of the velocity loop, N m
READ, BEFORE = 6, 7  # the encoder now and the tick before, rad
COLUMNS = 8


class Motors(NamedTuple):
    """Servo motors and their velocity loops: a row for every joint, also those that have none."""

    servo: IntArray  # (j,) 1: the joint has a servo motor
    ticks: int  # of the velocity loop in a sample
    period: float  # s, of a tick
    pitch: FloatArray  # (j,) mm or rad of the joint per rad of the motor
    count: FloatArray  # (j,) rad, of the encoder; 0: it is exact
    inertia: FloatArray  # (j,) kg m^2
    viscous: FloatArray  # (j,) N m s
    coulomb: FloatArray  # (j,) N m
    limit: FloatArray  # (j,) N m
    lag: FloatArray  # (j,) mean over a tick of what is left of a torque error
    decay: FloatArray  # (j,) what is left of it at the end
    believed: FloatArray  # (j,) kg m^2
    proportional: FloatArray  # (j,) N m s, velocity gain at a gain ratio of 1
    integral: FloatArray  # (j,) tick over integral time
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
    pitch, count, inertia, viscous, coulomb, limit, lag, decay, believed, gain, integral = map(frozen, rows.T)
    return Motors(
        servo, ticks, period, pitch, count, inertia, viscous, coulomb, limit, lag, decay, believed, gain,
        integral, noise, seed,
    )  # fmt: skip


def velocity_ticks(joints: Sequence[Axis], sample_time: float) -> tuple[float, int]:
    """Tick of the velocity loops, s, and how many make a sample.

    Raises
    ------
    ValueError
        As `motors`.
    """
    own = {joint.drive.velocity_loop.sample_time for joint in joints if isinstance(joint.drive, ServoMotor)}
    if len(own) > 1:
        raise ValueError(f"velocity loops tick differently: {sorted(own)}")
    period = own.pop() if own else sample_time
    ticks = round(sample_time / period)
    if ticks < 1 or abs(ticks * period - sample_time) > 1e-9 * sample_time:
        raise ValueError(f"{sample_time=} is no multiple of {period=}")
    return sample_time / ticks, ticks


def _row(joint: Axis, period: float) -> tuple[float, ...]:
    """Pitch and what follows it in `Motors`, up to the integral; a joint without motor turns as it moves."""
    drive = joint.drive
    if not isinstance(drive, ServoMotor):
        return (1.0, *(0.0,) * 10)
    loop, lag = drive.velocity_loop, drive.current_time_constant
    decay = exp(-period / lag) if lag > 0.0 else 0.0
    count = TWO_PI / drive.encoder_counts if drive.encoder_counts else 0.0
    believed = drive.believed_inertia
    return (
        drive.pitch, count, drive.inertia, drive.viscous, drive.coulomb, drive.torque_limit,
        lag / period * (1.0 - decay), decay, believed, believed * loop.bandwidth, period / loop.integral_time,
    )  # fmt: skip


def start(motors: Motors, reference: FloatArray) -> FloatArray:
    """Memory of motors at rest where their joints are at `reference` (j,) mm or rad, (j,8)."""
    memory = np.zeros((reference.size, COLUMNS))
    memory[:, ANGLE] = memory[:, READ] = reference / motors.pitch
    fine = motors.count > 0.0
    counts = np.floor(memory[fine, ANGLE] / motors.count[fine] + 0.5)
    memory[fine, READ] = counts * motors.count[fine]
    memory[:, BEFORE] = memory[:, READ]
    return memory


@kernel
def reading(motors, j, tick, angle):
    """What the encoder of joint j reads at an angle (rad), rad; tick: number of the reading, for its noise."""
    count = motors.count[j]
    if count <= 0.0:
        return angle
    counts = angle / count
    if motors.noise > 0.0:
        counts += motors.noise * normal(motors.seed, j, tick)
    return np.floor(counts + 0.5) * count


@kernel
def measure(motors, j, tick, memory):
    """Read the encoder of joint j at a sample. memory (j,8)."""
    memory[j, BEFORE] = memory[j, READ]
    memory[j, READ] = reading(motors, j, tick, memory[j, ANGLE])


@kernel
def velocity_step(error, gain, growth, fed, limit, integral):
    """Torque that a velocity loop asks for, and its integral, N m.

    error rad/s; gain N m s; growth: of the integral in a tick, by gain and error; fed N m: torque fed forward;
    limit N m.
    """
    step = gain * growth * error
    asked = gain * error + (integral + step) + fed
    if abs(asked) <= limit or asked * error < 0.0:  # else the integral would wind up
        integral += step
    return min(max(asked, -limit), limit), integral


@kernel
def motor_step(period, push, drag, rub, lag, decay, asked, load, angle, speed, torque):
    """Angle, speed and torque of a motor a tick later, under the torque asked for the tick before.

    push: speed per torque held for a tick, rad/s per N m; drag: factor by which viscous friction slows;
    rub rad/s: what Coulomb friction takes of the speed; lag, decay: of the current; load N m.
    """
    mean = asked + (torque - asked) * lag
    free = (speed + push * (mean - load)) * drag
    slowed = abs(free) - rub
    after = copysign(slowed, free) if slowed > 0.0 else 0.0
    return angle + 0.5 * period * (speed + after), after, asked + (torque - asked) * decay


@kernel
def sample_step(
    motors, j, tick, command, fed, friction_gains, observer, compensate, identify, load, k, state, states,
    transition, held, memory,
):  # fmt: skip
    """Run the ticks of joint j until the next sample.

    tick: number of the first of them; command rad/s and fed N m are held; load (n,ticks,joints) N m, or
    without rows, of which row k is meant; state (j,s): position, velocity and modes of the joints; transition
    (j,s,s), held (j,s): of the modes over a tick; memory: a `MotorMemory`.

    What changes from tick to tick is kept in plain variables meanwhile: the arrays could be one and the same
    for all that the compiler knows, and every step would wait for its writes.
    """
    motor, watched, compensated = memory.motor[j], memory.observer[j], memory.compensation[j]
    angle, speed, torque = motor[ANGLE], motor[SPEED], motor[TORQUE]
    applied, rubbed, integral = motor[ASKED], motor[FRICTION], motor[INTEGRAL]
    read, before = motor[READ], motor[BEFORE]
    seen, seen_speed, estimate = watched[watching.ANGLE], watched[watching.SPEED], watched[watching.LOAD]
    once, twice, thrice = watched[watching.ONCE], watched[watching.TWICE], watched[watching.THRICE]
    yielding, pace = compensated[compensation.ANGLE], compensated[compensation.SPEED]
    holding, ratio = compensated[compensation.HOLDING], compensated[compensation.RATIO]
    period, pitch, limit, believed = motors.period, motors.pitch[j], motors.limit[j], motors.believed[j]
    lag, decay, inertia = motors.lag[j], motors.decay[j], motors.inertia[j]
    push, drag = period / inertia, 1.0 / (1.0 + period * motors.viscous[j] / inertia)
    rub = period * motors.coulomb[j] / inertia
    per_period, believed_push = 1.0 / period, period / believed
    gain = motors.proportional[j] * ratio
    growth = motors.integral[j] * (ratio if compensate.scales_integral else 1.0)
    correction, stiffness = observer.load[j], compensate.position_gain[j]
    passed = 1.0 - observer.pole
    rubbing = friction.torque(friction_gains, j, memory.friction)
    loaded = load.shape[0] > 0
    for i in range(motors.ticks):
        if i > 0:
            before, read = read, reading(motors, j, tick + i, angle)
        error = command - (read - before) * per_period
        helped = fed + rubbing + observer.feedforward * estimate
        asked, integral = velocity_step(error, gain, growth, helped, limit, integral)
        if observer.watches:
            if compensate.models:
                left = (1.0 - observer.feedforward) * estimate
                yielding, pace, holding = compensation.yielded(
                    period, believed_push, stiffness, gain, growth, left, yielding, pace, holding
                )
            if identify.acts:
                identification.follow(observer, j, seen_speed, memory.identification)
            given = applied - rubbed
            seen, seen_speed, estimate = watching.predicted(
                observer, period, believed_push, correction, given, read, seen, seen_speed, estimate
            )
            once += passed * (given - once)
            twice += passed * (once - twice)
            thrice += passed * (twice - thrice)
        slower = speed
        angle, speed, torque = motor_step(
            period,
            push,
            drag,
            rub,
            lag,
            decay,
            applied,
            load[k, i, j] if loaded else 0.0,
            angle,
            speed,
            torque,
        )
        applied, rubbed = asked, rubbing
        acceleration = pitch * (speed - slower) * per_period
        for m in range(2, states, 2):
            d, w = state[j, m], state[j, m + 1]
            for r in range(m, m + 2):
                free = transition[j, r, m] * d + transition[j, r, m + 1] * w
                state[j, r] = held[j, r] * acceleration + free
    state[j, 0], state[j, 1] = pitch * angle, pitch * speed
    motor[ANGLE], motor[SPEED], motor[TORQUE] = angle, speed, torque
    motor[ASKED], motor[FRICTION], motor[INTEGRAL] = applied, rubbed, integral
    motor[READ], motor[BEFORE] = read, before
    watched[watching.ANGLE], watched[watching.SPEED], watched[watching.LOAD] = seen, seen_speed, estimate
    watched[watching.ONCE], watched[watching.TWICE], watched[watching.THRICE] = once, twice, thrice
    compensated[compensation.ANGLE], compensated[compensation.SPEED] = yielding, pace
    compensated[compensation.HOLDING] = holding
