# pyright: basic
"""Inertia compensation: the velocity gain follows the load (paper 003, read consistently).

The paper takes load torque over acceleration for a varying inertia (eq 7), asks how much of the contour error
the load's displacement explains (eqs 8-14), and sets the velocity gain by both (eqs 15-17). As printed its
signs, units and inverses contradict one another; here (spec: inertia compensation, sections 1 and 3)

    J_hat = max(|I_T| - deadband, 0) / (|I_a| + a0)     I: leaky windows of the observed load and acceleration
    dP    = what the closed loop yields to the observed load, a model of it run beside it
    A     = -<dP, P - foot> / <dP, dP>                  -1 where the model explains the contour error
    ratio = 1 + clip(-A, 0, 1) J_hat / J                up to the largest, up fast and down slowly

The gain is 1 without load, to the bit. What is raised is stiffness: the true inertia hardly matters.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.controllers import disturbance_observer as observing
from cnc_shape.controllers.compensation import GainLaw, InertiaCompensation
from cnc_shape.controllers.lag import remaining
from cnc_shape.kernels import inlined
from cnc_shape.machine import Axis, ServoMotor

ANGLE, SPEED, INTEGRAL = 0, 1, 2  # columns of the memory: model of the loop under load, rad, rad/s, N m
RATIO = 3  # of the velocity gain to its nominal one
LOAD, ACCELERATION = 4, 5  # leaky windows, N m, rad/s^2
CROSS, SQUARE = 6, 7  # sums of displacement times contour error, and squared, mm^2
AGREEMENT = 8  # -A
INERTIA = 9  # effective, above the believed one, kg m^2
COLUMNS = 10
DEADBAND, REGULARISATION, POSITION_GAIN = 0, 1, 2  # columns of the numbers
ENOUGH = 1e-7  # mm^2, sum of squared displacements from which on agreement is told
SMALLEST_RATIO = 0.1  # of the literal readings
ABOVE_FRICTION = 1.5  # deadband over Coulomb friction
MILLISECOND = 1e-3  # s, for which forgetting is told
LITERAL, LITERAL_INVERSE = GainLaw.LITERAL.value, GainLaw.LITERAL_INVERSE.value
FIXED, TRIGGERED = GainLaw.FIXED.value, GainLaw.TRIGGERED.value


class CompensationGains(NamedTuple):
    """The compensation of every motor."""

    acts: int
    models: int  # 1: the displacement under load is modelled
    law: int  # value of a `GainLaw`
    largest: float  # -
    numbers: FloatArray  # (j,3) deadband in N m, regularisation in rad/s^2, position gain in 1/s
    window: float  # -, share of what is new in a leaky window, a sample
    attack: float  # -, a sample
    release: float  # -, a sample
    forgetting: float  # -, a sample
    scales_integral: int
    threshold: float  # mm
    slope: float  # rad/s per N m


def gains(
    term: InertiaCompensation | None,
    joints: Sequence[Axis],
    position_gain: Sequence[float],
    sample_time: float,
) -> CompensationGains:
    """Gains for the motors of a machine's joints."""
    given = term or InertiaCompensation()
    rows: list[tuple[float, float, float]] = []
    for joint, gain in zip(joints, position_gain, strict=True):
        deadband = _deadband(given, joint)
        rows.append((deadband, _regularisation(given, joint, deadband), gain))
    return CompensationGains(
        int(term is not None),
        int(term is not None and given.law is not GainLaw.FIXED),
        given.law.value,
        given.max_gain_ratio,
        frozen(rows),
        1.0 - remaining(given.window, sample_time),
        1.0 - remaining(given.attack, sample_time),
        1.0 - remaining(given.release, sample_time),
        given.forgetting ** (sample_time / MILLISECOND),
        int(given.scale_integral_time),
        given.threshold,
        given.torque_speed_slope,
    )


def start(term: InertiaCompensation | None, joints: int) -> FloatArray:
    """Memory at rest, (j,10)."""
    memory = np.zeros((joints, COLUMNS))
    memory[:, RATIO] = 1.0 if term is None else term.starting_ratio
    memory[:, AGREEMENT] = 1.0
    return memory


def _deadband(term: InertiaCompensation, joint: Axis) -> float:
    if term.deadband is not None:
        return term.deadband
    return ABOVE_FRICTION * joint.drive.coulomb if isinstance(joint.drive, ServoMotor) else 0.0


def _regularisation(term: InertiaCompensation, joint: Axis, deadband: float) -> float:
    if term.regularisation is not None:
        return term.regularisation
    return deadband / joint.drive.believed_inertia if isinstance(joint.drive, ServoMotor) else 0.0


@inlined
def displaced(period, per_torque, position_gain, gain, integral_rate, load, angle, speed, integral):
    """Angle, speed and integral a tick later of a loop that a load (N m) displaces, as the model has it.

    per_torque: speed per torque held for a tick of the believed inertia, rad/s per N m; gain N m s and
    integral_rate are those of the velocity loop.
    """
    error = -position_gain * angle - speed
    integral += gain * integral_rate * error
    speed += per_torque * (gain * error + integral - load)
    return angle + period * speed, speed, integral


@inlined
def step(gains, j, believed, pitch, bandwidth, deviation, known, displacement, observed, memory):
    """Set the gain ratio of motor j for the coming sample.

    believed kg m^2; pitch mm/rad; bandwidth 1/s: of the velocity loop; deviation mm: where the joint is
    minus where the nearest point of the path would have it; known: 1 where there is a path; displacement mm:
    under load, as modelled, of all joints together; observed (j,6) of the observer; memory (j,10).
    """
    load, acceleration = observed[j, observing.LOAD], observing.acceleration(believed, j, observed)
    memory[j, LOAD] += gains.window * (load - memory[j, LOAD])
    memory[j, ACCELERATION] += gains.window * (acceleration - memory[j, ACCELERATION])
    moved = pitch * memory[j, ANGLE]
    if known:
        memory[j, CROSS] = gains.forgetting * memory[j, CROSS] + moved * deviation
        memory[j, SQUARE] = gains.forgetting * memory[j, SQUARE] + moved * moved
        if memory[j, SQUARE] > ENOUGH:
            memory[j, AGREEMENT] = memory[j, CROSS] / memory[j, SQUARE]
        else:
            memory[j, AGREEMENT] = 1.0
    share = min(max(memory[j, AGREEMENT], 0.0), 1.0)
    excess = max(abs(memory[j, LOAD]) - gains.numbers[j, DEADBAND], 0.0)
    divisor = abs(memory[j, ACCELERATION]) + gains.numbers[j, REGULARISATION]
    inertia = excess / divisor if excess > 0.0 else 0.0
    memory[j, INERTIA] = inertia
    smallest = 1.0
    if gains.law == FIXED:
        wanted = gains.largest
    elif gains.law == TRIGGERED:
        wanted = 1.0 + (gains.largest - 1.0) * min(displacement / gains.threshold, 1.0)
    elif gains.law == LITERAL:
        smallest = SMALLEST_RATIO
        wanted = 0.5 * gains.slope * share * (believed + inertia) / bandwidth
    elif gains.law == LITERAL_INVERSE:
        smallest = SMALLEST_RATIO
        time_constant = gains.slope * share * (believed + inertia)
        wanted = 2.0 / time_constant / bandwidth if time_constant > 0.0 else gains.largest
    else:
        wanted = 1.0 + share * inertia / believed
    wanted = min(max(wanted, smallest), gains.largest)
    ratio = memory[j, RATIO]
    memory[j, RATIO] = ratio + (wanted - ratio) * (gains.attack if wanted > ratio else gains.release)
