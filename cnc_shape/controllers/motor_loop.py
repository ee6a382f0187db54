# pyright: basic
"""Motor loop: what happens in the servo drives of a machine from one sample of the loop to the next.

Once a sample the velocity gain and the identified inertia of every drive are set. Then, several
times, the velocity loop asks for a torque, the observer takes what the encoder reads, and the motor moves on
under the torque of the tick before.
"""

from math import sqrt
from typing import NamedTuple

from cnc_shape.arrays import FloatArray, IntArray
from cnc_shape.controllers import disturbance_observer as observing
from cnc_shape.controllers import friction_feedforward
from cnc_shape.controllers import inertia_compensation as compensation
from cnc_shape.controllers import inertia_identification as identification
from cnc_shape.controllers import servo_drive as drive
from cnc_shape.kernels import inlined

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


@inlined
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
    motor, observed, compensated = memory.motor, memory.observer, memory.compensation
    tick, ticks = memory.clock[0], motors.ticks
    memory.clock[0] += ticks
    displacement = 0.0
    if compensate.law == compensation.TRIGGERED:
        for j in range(speeds.size):
            displacement += (motors.numbers[j, drive.PITCH] * compensated[j, compensation.ANGLE]) ** 2
        displacement = sqrt(displacement)
    for j in range(speeds.size):
        if not motors.servo[j]:
            continue
        pitch, believed = motors.numbers[j, drive.PITCH], motors.numbers[j, drive.BELIEVED]
        if compensate.acts:
            bandwidth = motors.numbers[j, drive.GAIN] / believed
            compensation.step(
                compensate, j, believed, pitch, bandwidth, deviation[j], known, displacement, observed,
                compensated,
            )  # fmt: skip
        if identify.acts:
            identification.step(identify, j, believed, observed, memory.identification)
        fed, against_friction = torques[j], 0.0
        if friction.acts:
            friction_feedforward.follow(friction, j, references[j] / pitch, memory.friction)
            against_friction = friction_feedforward.torque(friction, j, memory.friction)
        signals[k, j, TORQUE] = motor[j, drive.ASKED]
        signals[k, j, LOAD] = load[k, 0, j] if load.shape[0] > 0 else 0.0
        signals[k, j, ESTIMATE] = observed[j, observing.LOAD]
        signals[k, j, RATIO] = compensated[j, compensation.RATIO]
        signals[k, j, EFFECTIVE] = compensated[j, compensation.INERTIA]
        signals[k, j, AGREEMENT] = compensated[j, compensation.AGREEMENT]
        signals[k, j, INERTIA] = identification.inertia(identify, j, believed, memory.identification)
        _ticks(
            k, j, tick, speeds[j] / pitch, fed, against_friction, load, motors, observer, compensate,
            identify, motor, observed, compensated, memory.identification, push,
        )  # fmt: skip


@inlined
def _ticks(
    k, j, tick, command, fed, against_friction, load, motors, observer, compensate, identify, motor,
    observed, compensated, identified, push,
):  # fmt: skip
    """Run the ticks of joint j, under a command (rad/s), a torque fed forward and one against friction (N m).

    What changes from tick to tick is kept in plain variables meanwhile: the arrays could be one and the same
    for all that the compiler knows, and every step would wait for its writes.
    """
    period, noise, seed = motors.period, motors.noise, motors.seed
    pitch, count = motors.numbers[j, drive.PITCH], motors.numbers[j, drive.COUNT]
    lag, decay = motors.numbers[j, drive.LAG], motors.numbers[j, drive.DECAY]
    limit, coulomb = motors.numbers[j, drive.LIMIT], motors.numbers[j, drive.COULOMB]
    per_torque, drag = motors.numbers[j, drive.PER_TORQUE], motors.numbers[j, drive.DRAG]
    believed = motors.numbers[j, drive.BELIEVED]
    per_period, believed_per_torque = 1.0 / period, period / believed
    angle, speed, torque = motor[j, drive.ANGLE], motor[j, drive.SPEED], motor[j, drive.TORQUE]
    applied, friction_before = motor[j, drive.ASKED], motor[j, drive.FRICTION]
    integral, read, before = motor[j, drive.INTEGRAL], motor[j, drive.READ], motor[j, drive.BEFORE]
    seen, seen_speed = observed[j, observing.ANGLE], observed[j, observing.SPEED]
    estimate, once = observed[j, observing.LOAD], observed[j, observing.ONCE]
    twice, thrice = observed[j, observing.TWICE], observed[j, observing.THRICE]
    share = 1.0 - observer.pole
    model_angle, model_speed = compensated[j, compensation.ANGLE], compensated[j, compensation.SPEED]
    model_integral, ratio = compensated[j, compensation.INTEGRAL], compensated[j, compensation.RATIO]
    gain, integral_rate = motors.numbers[j, drive.GAIN] * ratio, motors.numbers[j, drive.INTEGRAL_RATE]
    position_gain = compensate.numbers[j, compensation.POSITION_GAIN]
    if compensate.scales_integral:
        integral_rate *= ratio
    loaded = load.shape[0] > 0
    for i in range(motors.ticks):
        if i > 0:
            before, read = read, drive.reading(angle, count, noise, seed, j, tick + i)
        error = command - (read - before) * per_period
        fed_forward = fed + against_friction + observer.feedforward * estimate
        asked, integral = drive.velocity_step(error, gain, integral_rate, fed_forward, limit, integral)
        if observer.acts:
            if compensate.models:
                left = (1.0 - observer.feedforward) * estimate
                model_angle, model_speed, model_integral = compensation.displaced(
                    period, believed_per_torque, position_gain, gain, integral_rate, left,
                    model_angle, model_speed, model_integral,
                )  # fmt: skip
            if identify.acts:
                identification.follow(observer, j, seen_speed, identified)
            given = applied - friction_before
            seen, seen_speed, estimate = observing.predicted(
                observer, period, believed, believed_per_torque, given, read, seen, seen_speed, estimate
            )
            once += share * (given - once)
            twice += share * (once - twice)
            thrice += share * (twice - thrice)
        speed_before, load_torque = speed, load[k, i, j] if loaded else 0.0
        angle, speed, torque = drive.motor_step(
            period, per_torque, drag, coulomb, lag, decay, applied, load_torque, angle, speed, torque
        )
        applied, friction_before = asked, against_friction
        push[i, j] = pitch * (speed - speed_before) * per_period
    motor[j, drive.ANGLE], motor[j, drive.SPEED], motor[j, drive.TORQUE] = angle, speed, torque
    motor[j, drive.ASKED], motor[j, drive.FRICTION] = applied, friction_before
    motor[j, drive.INTEGRAL], motor[j, drive.READ], motor[j, drive.BEFORE] = integral, read, before
    observed[j, observing.ANGLE], observed[j, observing.SPEED] = seen, seen_speed
    observed[j, observing.LOAD], observed[j, observing.ONCE] = estimate, once
    observed[j, observing.TWICE], observed[j, observing.THRICE] = twice, thrice
    compensated[j, compensation.ANGLE], compensated[j, compensation.SPEED] = model_angle, model_speed
    compensated[j, compensation.INTEGRAL] = model_integral
