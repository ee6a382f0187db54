# pyright: basic
"""The servo loop: one kernel that calls every term.

One tick, in this order: the drives are measured; the loop's terms add up to a velocity command; the
plant runs to the next sample with that command held. Every term stands behind a flag of its own,
so that leaving one out is a line of configuration and costs nothing. A new term is its file and one
line here.

A servo motor has a velocity loop of its own, which runs `ticks` times between two samples. Its position is
what its encoder reads; how stiff the velocity loop is to be is set once a sample.

The loop runs in the joints of the machine. What cross-coupling needs of the kinematics is an array: the
inverse Jacobian at the commanded poses. With it joint errors become Cartesian ones, and Cartesian velocities
joint velocities. Where the joints are the axes there is none.
"""

from typing import NamedTuple

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray
from cnc_shape.controllers import (
    cross_coupling,
    disturbance_observer,
    estimators,
    feedforward,
    friction_feedforward,
    inertia_compensation,
    inertia_identification,
    motor_loop,
    position_loop,
    servo_drive,
)
from cnc_shape.controllers.motor_loop import SIGNALS, MotorMemory
from cnc_shape.kernels import kernel, structure
from cnc_shape.kernels.linear import solve

FURTHEST = 1e4  # mm or rad, following error beyond which the loop has diverged
FOOT_POINT = cross_coupling.Estimator.FOOT_POINT.value
CIRCLE = cross_coupling.Estimator.CIRCLE.value


class Command(NamedTuple):
    """What the loop is told: one sample more than it runs ticks."""

    position: FloatArray  # (n+1,d) mm or rad, of the axes
    velocity: FloatArray  # (n+1,d)
    acceleration: FloatArray  # (n+1,d)
    reference: FloatArray  # (n+1,j) mm or rad, of the joints
    reference_velocity: FloatArray  # (n+1,j)


class Poses(NamedTuple):
    """Inverse Jacobians at commanded poses: `inverse[(phase + k) // every]` holds at tick k."""

    inverse: FloatArray  # (r,c,c) joint rates per axis rates of the first c joints; (0,0,0): joints are axes
    phase: int  # ticks
    every: int  # ticks


class Terms(NamedTuple):
    """The terms of the loop."""

    position: position_loop.PositionGains
    feed: int  # 1: there is feedforward
    feedforward: feedforward.FeedforwardGains
    couple: int  # 1: there is cross-coupling
    coupling: cross_coupling.CrossCouplingGains
    friction: friction_feedforward.FrictionGains
    observer: disturbance_observer.ObserverGains
    compensation: inertia_compensation.CompensationGains
    identification: inertia_identification.IdentificationGains


class Memory(NamedTuple):
    """What the loop remembers from tick to tick; changed in place."""

    plant: FloatArray  # (j,s)
    late: FloatArray  # (delay,j) commands the drives have yet to hear, oldest first
    frame: FloatArray  # (2,3) unit tangent of the command, its curvature in 1/mm
    coupling: FloatArray  # (3,3) of the cross-coupled controller
    cursor: IntArray  # (4,) of the search for foot points
    motors: MotorMemory


@kernel
def servo_loop(command, poses, path, lower, upper, load, sample_time, plant, motors, terms, memory):
    """Run n ticks of the loop.

    command: a `Command`; poses: `Poses`; path, lower (n,), upper (n,) mm: the path and every tick's window on
    it, where foot points are asked for; load (n,ticks,j) N m on the motors at every tick of theirs, or
    without rows; plant: a `Plant` of the joints; motors: `Motors`; terms: `Terms`; memory: a `Memory`.
    Returns joint, its rate, tool and velocity command, (n,j) each, the signals of the motors (n,j,7), without
    rows where there are none, and the ticks run: fewer than n where the loop diverged.
    """
    position, velocity, acceleration, reference, reference_velocity = command
    inverse, phase, every = poses
    transition, held, rising, states, ideal, varying = plant
    position_gains, feed, feed_gains, couple, couple_gains, friction, observer, compensate, identify = terms
    state, late, frame, coupling, cursor, turning = memory
    n, joints = reference.shape[0] - 1, reference.shape[1]
    linear = min(3, position.shape[1])
    cartesian = inverse.shape[0] == 0
    solved = inverse.shape[1]
    joint, rate = np.empty((n, joints)), np.empty((n, joints))
    tool, drive = np.empty((n, joints)), np.empty((n, joints))
    mean_velocity, mean_acceleration = np.empty(joints), np.empty(joints)
    following = np.zeros(max(joints, 3))
    told, fed, heard, heard_torque = np.empty(joints), np.zeros(joints), np.empty(joints), np.empty(joints)
    deviation, push = np.zeros(joints), np.zeros((motors.ticks, joints))
    servo = motors.servo.any()
    signals = np.zeros((n if servo else 0, joints, SIGNALS))
    tracking = following if cartesian else np.zeros(max(joints, 3))
    coupled, work = following[:solved], np.empty((solved, solved))
    error, speed = np.zeros(3), np.zeros(3)
    at_foot = couple and couple_gains.estimator == FOOT_POINT
    known = servo and compensate.models and lower.size > 0
    searched = n if at_foot or known else 0
    foot = np.zeros(3)
    tools, feet = np.empty((searched, 3)), np.empty((searched, 3))
    distance, place, segment = np.empty(searched), np.empty(searched), np.empty(searched, np.int64)
    for k in range(n):
        for j in range(joints):
            joint[k, j], rate[k, j] = state[j, 0], state[j, 1]
            tool[k, j] = state[j, 0]
            for i in range(2, states[j], 2):
                tool[k, j] += state[j, i]
            following[j] = reference[k, j] - state[j, 0]
            if not abs(following[j]) <= FURTHEST:
                return joint, rate, tool, drive, signals, k
            if motors.servo[j]:
                servo_drive.measure(motors, j, turning.clock[0], turning.motor)
                read = motors.numbers[j, servo_drive.PITCH] * turning.motor[j, servo_drive.READ]
                following[j] = reference[k, j] - read
            told[j] = 0.0
        position_loop.step(position_gains, following, told)
        if feed or servo:
            for j in range(joints):
                mean_velocity[j] = (reference[k + 1, j] - reference[k, j]) / sample_time
                mean_acceleration[j] = (reference_velocity[k + 1, j] - reference_velocity[k, j]) / sample_time
        if feed:
            feedforward.step(feed_gains, mean_velocity, mean_acceleration, told, fed)
        row = 0 if cartesian else (phase + k) // every
        if (couple or known) and not cartesian:
            solve(inverse[row], coupled, tracking, work)
        if searched:
            estimators.foot_error(
                position, tracking, k, path, lower, upper, cursor, tools, feet, distance, place, segment, foot
            )
        if couple:
            estimators.look_ahead(velocity, acceleration, k, couple_gains.estimator == CIRCLE, frame)
            if couple_gains.estimator == FOOT_POINT:
                for i in range(3):
                    error[i] = foot[i]
            elif couple_gains.estimator == CIRCLE:
                estimators.circle_error(tracking, frame, error)
            else:
                estimators.tangent_error(tracking, frame, error)
            cross_coupling.step(couple_gains, error, frame, sample_time, coupling, speed)
            if cartesian:
                for i in range(linear):
                    told[i] += speed[i]
                for j in range(3, joints):
                    told[j] += couple_gains.orientation * tracking[j]
            else:
                for j in range(solved):
                    for i in range(3):
                        told[j] += inverse[row, j, i] * speed[i]
                    for i in range(3, solved):
                        told[j] += inverse[row, j, i] * couple_gains.orientation * tracking[i]
        for j in range(joints):
            drive[k, j] = told[j]
            heard[j], heard_torque[j] = told[j], fed[j]
            if late.shape[0] > 0:
                heard[j], heard_torque[j] = late[0, j], turning.late[0, j]
                for i in range(late.shape[0] - 1):
                    late[i, j], turning.late[i, j] = late[i + 1, j], turning.late[i + 1, j]
                late[late.shape[0] - 1, j], turning.late[late.shape[0] - 1, j] = told[j], fed[j]
        if servo:
            for j in range(joints):
                deviation[j] = -foot[j] if cartesian and j < linear else 0.0
                if known and j < solved:
                    for i in range(3):
                        deviation[j] -= inverse[row, j, i] * foot[i]
            motor_loop.step(
                k, heard, heard_torque, mean_velocity, deviation, known, load, motors, friction,
                observer, compensate, identify, turning, push, signals,
            )  # fmt: skip
        for j in range(joints):
            s = states[j]
            if motors.servo[j]:
                pitch = motors.numbers[j, servo_drive.PITCH]
                state[j, 0] = pitch * turning.motor[j, servo_drive.ANGLE]
                state[j, 1] = pitch * turning.motor[j, servo_drive.SPEED]
                for t in range(motors.ticks):
                    for i in range(2, s, 2):
                        d, w = state[j, i], state[j, i + 1]
                        if varying.rows[j, i // 2 - 1, 1] > 0:
                            state[j, i], state[j, i + 1] = structure.mode_after(
                                varying, j, i // 2 - 1, joint[k], d, w, push[t, j], 0.0, 0.0, motors.period
                            )
                            continue
                        for r in range(i, i + 2):
                            free = transition[j, r, i] * d + transition[j, r, i + 1] * w
                            state[j, r] = held[j, r] * push[t, j] + free
                continue
            c0, c1 = heard[j], 0.0
            if ideal[j]:
                # acceleration of the cubic through both samples: c0 at its start, c1 more at its end
                step = reference[k + 1, j] - reference[k, j]
                v0, v1 = reference_velocity[k, j], reference_velocity[k + 1, j]
                c0 = (6.0 * step / sample_time - 4.0 * v0 - 2.0 * v1) / sample_time
                c1 = (6.0 * v0 + 6.0 * v1 - 12.0 * step / sample_time) / sample_time
            # the drive answers itself alone, a mode the drive and itself: all else in `transition` is zero
            q, v = state[j, 0], state[j, 1]
            for i in range(2, s, 2):
                d, w = state[j, i], state[j, i + 1]
                if varying.rows[j, i // 2 - 1, 1] > 0:
                    fading = 0.0 if ideal[j] else (varying.gain[j] * c0 - v) * varying.rate[j]
                    start = c0 if ideal[j] else 0.0
                    state[j, i], state[j, i + 1] = structure.mode_after(
                        varying, j, i // 2 - 1, joint[k], d, w, start, c1 / sample_time, fading, sample_time
                    )
                    continue
                for r in range(i, i + 2):
                    free = transition[j, r, 0] * q + transition[j, r, 1] * v
                    free += transition[j, r, i] * d + transition[j, r, i + 1] * w
                    state[j, r] = held[j, r] * c0 + rising[j, r] * c1 + free
            for r in range(2):
                free = transition[j, r, 0] * q + transition[j, r, 1] * v
                state[j, r] = held[j, r] * c0 + rising[j, r] * c1 + free
            if ideal[j]:
                state[j, 0] = reference[k + 1, j]
                state[j, 1] = reference_velocity[k + 1, j]
    return joint, rate, tool, drive, signals, n
