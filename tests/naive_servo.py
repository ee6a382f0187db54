"""Slow twin of the servo drive: motors, their loops and what compensates loads, as the equations stand.

Written from the equations alone (spec: inertia compensation, sections 2 and 3), axis by axis and tick by
tick, in plain Python. Everything is in rad, N m and s; only lengths on the path are in mm. At every tick the
order is: encoder, then (once a sample) position loop and adaptation, then velocity PI, observer, and the
motor under the torque that was computed a tick before.
"""

from __future__ import annotations

from collections.abc import Callable
from math import exp, floor, pi, sqrt
from typing import Any, NamedTuple

import numpy as np

EFFECTIVE_INERTIA, LITERAL, LITERAL_INVERSE, FIXED, TRIGGERED = range(5)
EXACT_AGREEMENT = 1e-7  # mm^2, sum of squares of the displacement from which the agreement is fitted
LEAST_GAIN = 0.1  # -, of the nominal velocity gain, that a literal reading may leave
LEAST_PULL = 1e-9  # rad/s, below which the literal inverse has nothing to divide by
STANDSTILL = 1e-3  # rad/s, below which friction has no direction
SCALE = 200.0  # rad/s^2, of the acceleration among the regressors
COVARIANCE_START, COVARIANCE_CAP = 100.0, 1e4  # of the least squares


class Settings(NamedTuple):
    """One drive and its control; arrays hold one value an axis."""

    inertia: Any  # (d,) kg m^2
    nominal: float  # kg m^2
    viscous: float  # N m s
    coulomb: Any  # (d,) N m, of the plant
    torque_limit: float  # N m
    current_lag: float  # s
    lead: float  # mm per revolution
    counts: float  # per revolution, 0: exact
    bandwidth: float = 400.0  # rad/s
    integral_time: float = 0.01  # s
    tick: float = 2.5e-4  # s
    ticks: int = 4  # a position sample
    position_gain: float = 44.67  # 1/s
    velocity_share: float = 0.0
    acceleration_share: float = 0.0
    observer: float = 300.0  # rad/s
    observer_share: float = 0.0  # of the estimate, fed forward
    compensated: int = 0
    law: int = EFFECTIVE_INERTIA
    largest: float = 2.5  # gain ratio
    deadband: float = 0.12  # N m
    regularisation: float = 261.0  # rad/s^2
    window: float = 0.02  # s
    attack: float = 0.01  # s
    release: float = 1.0  # s
    forgetting: float = 0.995  # per ms
    scale_integral: int = 0
    threshold: float = 5e-3  # mm
    slope: float = 3.32  # rad/s per N m
    friction_coulomb: float = 0.0  # N m, fed forward
    friction_viscous: float = 0.0  # N m s, fed forward
    friction_lag: float = 1.0 / 44.67  # s, by which the motor is later than its command
    identified: int = 0
    identification_time: float = 1.0  # s
    excitation: float = 200.0  # rad/s^2
    substeps: int = 1


class Signals(NamedTuple):
    """(n,d) each, at the position samples, before the motor moves on."""

    position: Any  # mm
    torque: Any  # N m, in force at the sample
    estimate: Any  # N m
    gain_ratio: Any  # -
    effective: Any  # kg m^2
    agreement: Any  # -
    displacement: Any  # mm
    inertia: Any  # kg m^2


def run(
    s: Settings, reference: Any, velocity: Any, acceleration: Any, load: Any, noise: Any,
    nearest: Callable[[Any], Any],
) -> Signals:  # fmt: skip
    """Run axes through a command.

    Parameters
    ----------
    s
        Drives and control.
    reference, velocity, acceleration
        (n,d) mm, mm/s, mm/s^2 at the position samples.
    load, noise
        (n * ticks, d) N m that opposes, and counts added to the encoder before it rounds; noise (0,d): none.
    nearest
        The path's point that is nearest to a position (d,) mm.
    """
    n, d = reference.shape
    h, pitch = s.tick, s.lead / (2.0 * pi)
    sample = h * s.ticks
    count = 2.0 * pi / s.counts if s.counts > 0 else 0.0
    z0 = exp(-s.observer * h)
    away = 1.0 - z0
    l1, l2 = 3.0 * away, (3.0 * away**2 - 0.5 * away**3) / h
    l3 = -s.nominal * away**3 / h**2
    gain0 = s.nominal * s.bandwidth  # N m s/rad
    forget_squares = s.forgetting ** (sample / 1e-3)
    in_window = 1.0 - exp(-sample / s.window)
    rise, fall = 1.0 - exp(-sample / s.attack), 1.0 - exp(-sample / s.release)
    lagging = 1.0 - exp(-sample / s.friction_lag) if s.friction_lag > 0.0 else 1.0
    sub = h / s.substeps
    left = exp(-sub / s.current_lag) if s.current_lag > 0.0 else 0.0

    theta = reference[0] / pitch
    omega, current, applied, friction_applied = np.zeros(d), np.zeros(d), np.zeros(d), np.zeros(d)
    before = theta.copy()  # of the encoder, a tick ago
    if count > 0.0:
        for i in range(d):
            before[i] = floor(theta[i] / count + 0.5) * count
    y = before.copy()
    command, integral = np.zeros(d), np.zeros(d)
    seen, seen_speed, seen_load = before.copy(), np.zeros(d), np.zeros(d)
    filtered, signs = np.zeros((d, 3)), np.zeros((d, 3))  # torque and direction behind the observer's Q
    ratio = np.full(d, s.largest if s.compensated and s.law == FIXED else 1.0)
    pushed_integral, pushed_speed, pushed = np.zeros(d), np.zeros(d), np.zeros(d)
    mean_load, mean_acceleration = np.zeros(d), np.zeros(d)
    xy, xx = np.zeros(d), np.zeros(d)
    effective, agreement = np.zeros(d), np.ones(d)
    lagged, friction, forward = np.zeros(d), np.zeros(d), np.zeros(d)
    excited = np.zeros(d)  # (rad/s^2)^2
    unknown = np.zeros((d, 3))  # N m: SCALE times what the inertia has above the nominal one; Coulomb; T0
    covariance = np.zeros((d, 3, 3))
    for i in range(d):
        for j in range(3):
            covariance[i, j, j] = COVARIANCE_START
    inertia = np.full(d, s.nominal)
    shape = (n, d)
    told = Signals(
        np.zeros(shape), np.zeros(shape), np.zeros(shape), np.zeros(shape), np.zeros(shape), np.zeros(shape),
        np.zeros(shape), np.zeros(shape),
    )  # fmt: skip

    for k in range(n * s.ticks):
        for i in range(d):
            y[i] = theta[i]
            if count > 0.0:
                raw = theta[i] / count + (noise[k, i] if noise.shape[0] else 0.0)
                y[i] = floor(raw + 0.5) * count

        if k % s.ticks == 0:
            row = k // s.ticks
            foot = nearest(y * pitch)
            yielding = pitch * sqrt((pushed * pushed).sum())  # mm, of all axes together
            for i in range(d):
                error = reference[row, i] / pitch - y[i]
                command[i] = s.position_gain * error + s.velocity_share * velocity[row, i] / pitch
                forward[i] = s.acceleration_share * s.nominal * acceleration[row, i] / pitch
                lagged[i] += lagging * (velocity[row, i] / pitch - lagged[i])
                direction = 1.0 if lagged[i] > STANDSTILL else -1.0 if lagged[i] < -STANDSTILL else 0.0
                friction[i] = s.friction_coulomb * direction + s.friction_viscous * lagged[i]

                accelerated = (filtered[i, 2] - seen_load[i]) / s.nominal
                mean_load[i] += in_window * (seen_load[i] - mean_load[i])
                mean_acceleration[i] += in_window * (accelerated - mean_acceleration[i])
                displaced = pitch * pushed[i]
                off = pitch * y[i] - foot[i]
                xy[i] = forget_squares * xy[i] + displaced * off
                xx[i] = forget_squares * xx[i] + displaced * displaced
                share = xy[i] / xx[i] if xx[i] > EXACT_AGREEMENT else 1.0  # -A
                agreement[i] = share
                share = min(max(share, 0.0), 1.0)
                felt = max(abs(mean_load[i]) - s.deadband, 0.0)
                effective[i] = felt / (abs(mean_acceleration[i]) + s.regularisation)
                if s.compensated:
                    if s.law == EFFECTIVE_INERTIA:
                        wanted = 1.0 + share * effective[i] / s.nominal
                        wanted = min(max(wanted, 1.0), s.largest)
                    elif s.law == TRIGGERED:
                        wanted = 1.0 + (s.largest - 1.0) * min(yielding / s.threshold, 1.0)
                    elif s.law == FIXED:
                        wanted = s.largest
                    else:
                        strength = s.slope * share * (s.nominal + effective[i])
                        if s.law == LITERAL:
                            wanted = 0.5 * strength / s.bandwidth
                        else:
                            wanted = 2.0 / (max(strength, LEAST_PULL) * s.bandwidth)
                        wanted = min(max(wanted, LEAST_GAIN), s.largest)
                    ratio[i] += (wanted - ratio[i]) * (rise if wanted > ratio[i] else fall)

                if s.identified:
                    keep = exp(-sample / s.identification_time)
                    excited[i] = keep * excited[i] + (1.0 - keep) * accelerated**2
                    if excited[i] > s.excitation**2:
                        regressor = np.array([accelerated / SCALE, signs[i, 2], 1.0])
                        spread = covariance[i] @ regressor
                        power = keep + regressor @ spread
                        unknown[i] += spread / power * (seen_load[i] - regressor @ unknown[i])
                        covariance[i] = (covariance[i] - np.outer(spread, spread) / power) / keep
                        trace = covariance[i, 0, 0] + covariance[i, 1, 1] + covariance[i, 2, 2]
                        if trace > COVARIANCE_CAP:
                            covariance[i] *= COVARIANCE_CAP / trace
                        found = 1.0 + unknown[i, 0] / SCALE / s.nominal
                        inertia[i] = s.nominal * min(max(found, 0.3), 5.0)

                told.position[row, i] = pitch * theta[i]
                told.torque[row, i] = applied[i]
                told.estimate[row, i] = seen_load[i]
                told.gain_ratio[row, i] = ratio[i]
                told.effective[row, i] = effective[i]
                told.agreement[row, i] = agreement[i]
                told.displacement[row, i] = displaced
                told.inertia[row, i] = inertia[i]

        for i in range(d):
            gain = gain0 * ratio[i]
            time = s.integral_time / ratio[i] if s.scale_integral else s.integral_time
            measured = (y[i] - before[i]) / h
            before[i] = y[i]
            lacking = command[i] - measured
            grown = integral[i] + gain * (h / time) * lacking
            torque = gain * lacking + grown + s.observer_share * seen_load[i] + friction[i] + forward[i]
            limited = min(max(torque, -s.torque_limit), s.torque_limit)
            if limited == torque or (torque - limited) * lacking < 0.0:
                integral[i] = grown

            push = applied[i] - friction_applied[i]  # in force until the next tick
            sign = 1.0 if seen_speed[i] > 0.0 else -1.0 if seen_speed[i] < 0.0 else 0.0
            new = y[i] - seen[i]
            seen[i] += h * seen_speed[i] + h**2 / (2.0 * s.nominal) * (push - seen_load[i]) + l1 * new
            lack = -s.position_gain * pushed[i] - pushed_speed[i]
            pushed_integral[i] += gain * (h / time) * lack
            pushed_speed[i] += (h / s.nominal) * (
                gain * lack + pushed_integral[i] - (1.0 - s.observer_share) * seen_load[i]
            )
            pushed[i] += h * pushed_speed[i]
            seen_speed[i] += (h / s.nominal) * (push - seen_load[i]) + l2 * new
            seen_load[i] += l3 * new
            through, turned = push, sign
            for j in range(3):
                filtered[i, j] += away * (through - filtered[i, j])
                signs[i, j] += away * (turned - signs[i, j])
                through, turned = filtered[i, j], signs[i, j]

            for _ in range(s.substeps):
                mean = applied[i]
                if s.current_lag > 0.0:
                    mean += (current[i] - applied[i]) * (s.current_lag / sub) * (1.0 - left)
                current[i] = applied[i] + (current[i] - applied[i]) * left
                free = (omega[i] + sub * (mean - load[k, i]) / s.inertia[i]) / (
                    1.0 + sub * s.viscous / s.inertia[i]
                )
                slowed = max(abs(free) - sub * s.coulomb[i] / s.inertia[i], 0.0)
                after = slowed if free > 0.0 else -slowed
                theta[i] += 0.5 * sub * (omega[i] + after)
                omega[i] = after
            applied[i], friction_applied[i] = limited, friction[i]
    return told
