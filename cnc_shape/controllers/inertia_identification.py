# pyright: basic
"""Identification of the true inertia: recursive least squares on what the observer sees.

    estimate = (J - J_believed) acceleration + Tc sign(speed) + T0

learnt with exponential forgetting, and only while the motion excites it: on a slow circle a turning load
looks like inertia. A load in phase with the acceleration cannot be told from it at all (spec: section 3.6).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.controllers import disturbance_observer as observing
from cnc_shape.controllers.compensation import InertiaIdentification
from cnc_shape.controllers.lag import remaining
from cnc_shape.kernels import inlined

EXCITATION = 0  # column of the memory: mean squared acceleration, rad^2/s^4
SIGN = 1  # of the speed, behind the same poles as the estimate: after one, two and all three of them
PARAMETERS = 4  # inertia times the acceleration's scale, Coulomb friction, constant load, N m
COVARIANCE = 7  # 3 x 3
COLUMNS = 16
SCALE = 200.0  # rad/s^2, that brings the acceleration to the size of the other regressors
DOUBT = 100.0  # covariance at the start, of each parameter
MOST_DOUBT = 1e4  # trace at which the covariance no longer grows


class IdentificationGains(NamedTuple):
    """Identification, alike for all motors."""

    acts: int
    forgetting: float  # -, a sample
    share: float  # -, of what is new in the mean squared acceleration
    excitation_squared: float  # rad^2/s^4, mean square from which on it learns
    smallest: float  # -, of the believed inertia
    largest: float  # -


def gains(term: InertiaIdentification | None, sample_time: float) -> IdentificationGains:
    """Gains for samples of `sample_time` (s)."""
    given = term or InertiaIdentification()
    forgetting = remaining(given.forgetting_time, sample_time)
    return IdentificationGains(
        int(term is not None),
        forgetting,
        1.0 - forgetting,
        given.excitation**2,
        given.smallest,
        given.largest,
    )


def start(joints: int) -> FloatArray:
    """Memory at rest, (j,16)."""
    memory = np.zeros((joints, COLUMNS))
    memory[:, COVARIANCE::4] = DOUBT
    return memory


@inlined
def follow(observer, j, speed, memory):
    """Take the observed speed of a tick (rad/s). memory (j,16)."""
    passing = np.sign(speed)
    for i in range(SIGN, PARAMETERS):
        memory[j, i] += (1.0 - observer.pole) * (passing - memory[j, i])
        passing = memory[j, i]


@inlined
def step(gains, j, believed, observed, memory):
    """Learn from a sample. believed kg m^2; observed (j,6) of the observer; memory (j,16)."""
    acceleration = observing.acceleration(believed, j, observed)
    memory[j, EXCITATION] += gains.share * (acceleration * acceleration - memory[j, EXCITATION])
    if memory[j, EXCITATION] < gains.excitation_squared:
        return
    a, s = acceleration / SCALE, memory[j, PARAMETERS - 1]
    P, theta = memory[j, COVARIANCE:], memory[j, PARAMETERS:COVARIANCE]
    pa = P[0] * a + P[1] * s + P[2]
    ps = P[3] * a + P[4] * s + P[5]
    p1 = P[6] * a + P[7] * s + P[8]
    weight = 1.0 / (gains.forgetting + a * pa + s * ps + p1)
    innovation = observed[j, observing.LOAD] - (a * theta[0] + s * theta[1] + theta[2])
    gain = (pa * weight, ps * weight, p1 * weight)
    column = (pa, ps, p1)
    for row in range(3):
        theta[row] += gain[row] * innovation
        for i in range(3):
            P[3 * row + i] = (P[3 * row + i] - gain[row] * column[i]) / gains.forgetting
    trace = P[0] + P[4] + P[8]
    if trace > MOST_DOUBT:
        for i in range(9):
            P[i] *= MOST_DOUBT / trace


@inlined
def inertia(gains, j, believed, memory):
    """Identified inertia of motor j, kg m^2."""
    found = believed + memory[j, PARAMETERS] / SCALE
    return min(max(found, gains.smallest * believed), gains.largest * believed)
