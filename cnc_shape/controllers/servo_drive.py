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
from cnc_shape.kernels.structure import swung
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
def measure(motors, j, tick, memory):
    """Read the encoder of joint j; tick: number of the reading, for its noise. memory (j,8)."""
    angle = memory[j, ANGLE]
    count = motors.count[j]
    memory[j, BEFORE] = memory[j, READ]
    if count > 0.0:
        reading = angle / count
        if motors.noise > 0.0:
            reading += motors.noise * normal(motors.seed, j, tick)
        angle = np.floor(reading + 0.5) * count
    memory[j, READ] = angle


@kernel
def velocity_step(motors, j, command, ratio, stiffening, fed, memory):
    """Torque that the velocity loop of joint j asks for, N m.

    command rad/s; ratio: of the gain to its nominal one; stiffening: factor of the integral; fed N m: torque
    fed forward; memory (j,8).
    """
    error = command - (memory[j, READ] - memory[j, BEFORE]) / motors.period
    gain = motors.proportional[j] * ratio
    step = gain * motors.integral[j] * stiffening * error
    asked = gain * error + (memory[j, INTEGRAL] + step) + fed
    limit = motors.limit[j]
    if abs(asked) <= limit or asked * error < 0.0:  # else the integral would wind up
        memory[j, INTEGRAL] += step
    return min(max(asked, -limit), limit)


@kernel
def motor_step(motors, j, load, memory):
    """Move the motor of joint j on by a tick under the torque of the tick before; load N m, memory (j,8)."""
    asked, torque, speed = memory[j, ASKED], memory[j, TORQUE], memory[j, SPEED]
    period, inertia = motors.period, motors.inertia[j]
    mean = asked + (torque - asked) * motors.lag[j]
    memory[j, TORQUE] = asked + (torque - asked) * motors.decay[j]
    free = (speed + period * (mean - load) / inertia) / (1.0 + period * motors.viscous[j] / inertia)
    slowed = abs(free) - period * motors.coulomb[j] / inertia
    after = copysign(slowed, free) if slowed > 0.0 else 0.0
    memory[j, ANGLE] += 0.5 * period * (speed + after)
    memory[j, SPEED] = after


@kernel
def sample_step(
    motors, j, tick, command, fed, friction_gains, observer, compensate, identify, load, k, state, states,
    transition, held, varying, position, memory,
):  # fmt: skip
    """Run the ticks of joint j until the next sample.

    tick: number of the first of them; command rad/s and fed N m are held; load (n,ticks,joints) N m, or
    without rows, of which row k is meant; state (j,s): position, velocity and modes of the joints; transition
    (j,s,s), held (j,s): of the modes over a tick; varying: a `Varying`, position (j,): of all joints at the
    sample, for modes with tables; memory: a `MotorMemory`.
    """
    pitch = motors.pitch[j]
    motor, watched, compensated = memory.motor, memory.observer, memory.compensation
    rubbing = friction.torque(friction_gains, j, memory.friction)
    for i in range(motors.ticks):
        if i > 0:
            measure(motors, j, tick + i, motor)
        estimate = watched[j, watching.LOAD]
        ratio = compensated[j, compensation.RATIO]
        stiffening = ratio if compensate.scales_integral else 1.0
        asked = velocity_step(
            motors, j, command, ratio, stiffening, fed + rubbing + observer.feedforward * estimate, motor
        )
        if observer.watches:
            applied = motor[j, ASKED] - motor[j, FRICTION]
            if compensate.models:
                compensation.displace(compensate, motors, observer, j, estimate, compensated)
            if identify.acts:
                identification.follow(observer, j, watched[j, watching.SPEED], memory.identification)
            watching.step(observer, motors, j, applied, motor[j, READ], watched)
        before = motor[j, SPEED]
        motor_step(motors, j, load[k, i, j] if load.shape[0] > 0 else 0.0, motor)
        motor[j, ASKED], motor[j, FRICTION] = asked, rubbing
        acceleration = pitch * (motor[j, SPEED] - before) / motors.period
        for m in range(2, states, 2):
            d, w = state[j, m], state[j, m + 1]
            if varying.rows[j, m // 2 - 1, 1] > 0:
                state[j, m], state[j, m + 1] = swung(
                    varying, j, m // 2 - 1, position, d, w, acceleration, 0.0, 0.0, motors.period
                )
                continue
            for r in range(m, m + 2):
                free = transition[j, r, m] * d + transition[j, r, m + 1] * w
                state[j, r] = held[j, r] * acceleration + free
    state[j, 0], state[j, 1] = pitch * motor[j, ANGLE], pitch * motor[j, SPEED]
