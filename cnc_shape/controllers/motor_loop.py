# pyright: basic
"""Motor loop: what happens in the servo drives of a machine from one sample of the loop to the next.

Once a sample the gain of a drive and the inertia it takes its motor for are thought over. Then, several
times, the velocity loop asks for a torque, the observer takes what the encoder reads, and the motor moves on
under the torque of the tick before.
"""

from math import sqrt
from typing import NamedTuple

from cnc_shape.arrays import FloatArray, IntArray
from cnc_shape.controllers import disturbance_observer as watching
from cnc_shape.controllers import friction_feedforward as rubbing
from cnc_shape.controllers import inertia_compensation as compensation
from cnc_shape.controllers import inertia_identification as identification
from cnc_shape.controllers import servo_drive as drive
from cnc_shape.kernels import kernel

TORQUE, LOAD, ESTIMATE, RATIO, EFFECTIVE, AGREEMENT, INERTIA = range(7)  # columns of the motors' signals
SIGNALS = 7


class MotorMemory(NamedTuple):
    """What servo motors and their controllers remember: a row for every joint."""

    motor: FloatArray  # (j,8), columns of `servo_drive`
    observer: FloatArray  # (j,6), columns of `disturbance_observer`
    compensation: FloatArray  # (j,10), columns of `inertia_compensation`
    identification: FloatArray  # (j,16), columns of `inertia_identification`
    friction: FloatArray  # (j,) rad/s, lagged speed of the reference
    late: FloatArray  # (delay,j) N m, torque fed forward that the drives have yet to hear, oldest first
    clock: IntArray  # (1,) readings of the encoders so far


@kernel
def step(
    k, speeds, torques, references, deviation, known, load, motors, friction, observer, compensate, identify,
    memory, push, signals,
):  # fmt: skip
    """Run sample k of all servo motors.

    speeds mm/s and torques N m: what the drives hear, held for the sample; references mm/s: commanded speeds,
    which friction feedforward follows; deviation mm: of the joints from the nearest point of the path, where
    it is known; (j,) each. load (n,ticks,j) N m, or without rows; memory: a `MotorMemory`; push (ticks,j)
    mm/s^2: becomes the acceleration of every tick; signals (n,j,7): row k is set.
    """
    motor, watched, compensated = memory.motor, memory.observer, memory.compensation
    tick, ticks = memory.clock[0], motors.ticks
    memory.clock[0] += ticks
    yielding = 0.0
    if compensate.acts:
        for j in range(speeds.size):
            yielding += (motors.numbers[j, drive.PITCH] * compensated[j, compensation.ANGLE]) ** 2
        yielding = sqrt(yielding)
    for j in range(speeds.size):
        if not motors.servo[j]:
            continue
        pitch, believed = motors.numbers[j, drive.PITCH], motors.numbers[j, drive.BELIEVED]
        if compensate.acts:
            bandwidth = motors.numbers[j, drive.GAIN] / believed
            compensation.step(
                compensate, j, believed, pitch, bandwidth, deviation[j], known, yielding, watched, compensated
            )
        if identify.acts:
            identification.step(identify, j, believed, watched, memory.identification)
        fed, rubbed = torques[j], 0.0
        if friction.acts:
            rubbing.follow(friction, j, references[j] / pitch, memory.friction)
            rubbed = rubbing.torque(friction, j, memory.friction)
        signals[k, j, TORQUE] = motor[j, drive.ASKED]
        signals[k, j, LOAD] = load[k, 0, j] if load.shape[0] > 0 else 0.0
        signals[k, j, ESTIMATE] = watched[j, watching.LOAD]
        signals[k, j, RATIO] = compensated[j, compensation.RATIO]
        signals[k, j, EFFECTIVE] = compensated[j, compensation.INERTIA]
        signals[k, j, AGREEMENT] = compensated[j, compensation.AGREEMENT]
        signals[k, j, INERTIA] = identification.inertia(identify, j, believed, memory.identification)
        _ticks(
            k, j, tick, speeds[j] / pitch, fed, rubbed, load, motors, observer, compensate, identify, motor,
            watched, compensated, memory.identification, push,
        )  # fmt: skip


@kernel
def _ticks(
    k, j, tick, command, fed, rubbed, load, motors, observer, compensate, identify, motor, watched,
    compensated, identified, push,
):  # fmt: skip
    """Run the ticks of joint j, under a command (rad/s), a torque fed forward and one against friction (N m).

    What changes from tick to tick is kept in plain variables meanwhile: the arrays could be one and the same
    for all that the compiler knows, and every step would wait for its writes.
    """
    period, noise, seed = motors.period, motors.noise, motors.seed
    pitch, count = motors.numbers[j, drive.PITCH], motors.numbers[j, drive.COUNT]
    inertia, believed = motors.numbers[j, drive.TRUE_INERTIA], motors.numbers[j, drive.BELIEVED]
    lag, decay = motors.numbers[j, drive.LAG], motors.numbers[j, drive.DECAY]
    limit, rub = motors.numbers[j, drive.LIMIT], period * motors.numbers[j, drive.COULOMB] / inertia
    turned, drag = period / inertia, 1.0 / (1.0 + period * motors.numbers[j, drive.VISCOUS] / inertia)
    per_period, believed_turned = 1.0 / period, period / believed
    angle, speed, torque = motor[j, drive.ANGLE], motor[j, drive.SPEED], motor[j, drive.TORQUE]
    applied, rubbed_before = motor[j, drive.ASKED], motor[j, drive.FRICTION]
    integral, read, before = motor[j, drive.INTEGRAL], motor[j, drive.READ], motor[j, drive.BEFORE]
    seen, seen_speed = watched[j, watching.ANGLE], watched[j, watching.SPEED]
    estimate, passed = watched[j, watching.LOAD], 1.0 - observer.pole
    once, twice, thrice = watched[j, watching.ONCE], watched[j, watching.TWICE], watched[j, watching.THRICE]
    yielding, pace = compensated[j, compensation.ANGLE], compensated[j, compensation.SPEED]
    holding, ratio = compensated[j, compensation.HOLDING], compensated[j, compensation.RATIO]
    gain, growth = motors.numbers[j, drive.GAIN] * ratio, motors.numbers[j, drive.GROWTH]
    position_gain = compensate.numbers[j, compensation.POSITION_GAIN]
    if compensate.scales_integral:
        growth *= ratio
    loaded = load.shape[0] > 0
    for i in range(motors.ticks):
        if i > 0:
            before, read = read, drive.reading(angle, count, noise, seed, j, tick + i)
        error = command - (read - before) * per_period
        helped = fed + rubbed + observer.feedforward * estimate
        asked, integral = drive.velocity_step(error, gain, growth, helped, limit, integral)
        if observer.watches:
            if compensate.models:
                left = (1.0 - observer.feedforward) * estimate
                yielding, pace, holding = compensation.yielded(
                    period, believed_turned, position_gain, gain, growth, left, yielding, pace, holding
                )
            if identify.acts:
                identification.follow(observer, j, seen_speed, identified)
            given = applied - rubbed_before
            seen, seen_speed, estimate = watching.predicted(
                observer, period, believed, believed_turned, given, read, seen, seen_speed, estimate
            )
            once += passed * (given - once)
            twice += passed * (once - twice)
            thrice += passed * (twice - thrice)
        slower, pushed = speed, load[k, i, j] if loaded else 0.0
        angle, speed, torque = drive.motor_step(
            period, turned, drag, rub, lag, decay, applied, pushed, angle, speed, torque
        )
        applied, rubbed_before = asked, rubbed
        push[i, j] = pitch * (speed - slower) * per_period
    motor[j, drive.ANGLE], motor[j, drive.SPEED], motor[j, drive.TORQUE] = angle, speed, torque
    motor[j, drive.ASKED], motor[j, drive.FRICTION] = applied, rubbed_before
    motor[j, drive.INTEGRAL], motor[j, drive.READ], motor[j, drive.BEFORE] = integral, read, before
    watched[j, watching.ANGLE], watched[j, watching.SPEED] = seen, seen_speed
    watched[j, watching.LOAD] = estimate
    watched[j, watching.ONCE], watched[j, watching.TWICE], watched[j, watching.THRICE] = once, twice, thrice
    compensated[j, compensation.ANGLE], compensated[j, compensation.SPEED] = yielding, pace
    compensated[j, compensation.HOLDING] = holding
