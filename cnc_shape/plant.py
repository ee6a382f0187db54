"""Plant: one axis's drive and structure as one linear system, discretised together and exactly.

State of an axis: ``[q, q', d_1, d_1', d_2, d_2', ...]``, drive position and the deflection of each mode,

    d_k'' + 2 zeta_k omega_k d_k' + omega_k^2 d_k = -g_k q''

A lag drive, ``q'' = (gain u - q') / time_constant``, holds its input u over the sample: zero-order hold.
An ideal drive is where it is told to be. Between samples it follows the cubic through commanded position
and velocity, whose acceleration is linear over the sample; the modes answer that acceleration exactly.

A servo motor moves by itself (`controllers.servo_drive`); its acceleration is constant over every tick of its
velocity loop, and here stand the modes alone, which answer that acceleration.

A drive without modes is written down. With x = -T / time_constant (0 for an ideal drive) and the functions
phi_0 = exp x, phi_k = (phi_{k-1} - 1/(k-1)!) / x,

    q+  = q + T phi_1 q' + b T (phi_2 u + phi_3 (u_end - u))         b = gain T / time_constant, or T
    q'+ =     phi_0 q' + b   (phi_1 u + phi_2 (u_end - u))

A mode with a table leaves these matrices aside: its frequency and damping are those of where the table's
axis stands when the sample begins, and `kernels.structure.advance` moves it. The drive's acceleration, which
pushes it, is known within the sample: linear for an ideal drive, and for one with a lag
``(gain u - q') / time_constant e^{-t / time_constant}``.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, factorial
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm  # pyright: ignore[reportUnknownVariableType]  # scipy ships no types

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.kernels.structure import Varying
from cnc_shape.machine import Axis, Drive, FirstOrderLag, IdealDrive, ServoMotor
from cnc_shape.units import TWO_PI

PHI_TERMS = 18  # of the series of phi_3, whose rest at |x| <= 1 is below 1/21!


class Plant(NamedTuple):
    """Discrete dynamics of all axes: ``x+ = transition x + held u + rising (u_end - u_start)``."""

    transition: FloatArray  # (d,s,s)
    held: FloatArray  # (d,s) answer to an input held over the sample
    rising: FloatArray  # (d,s) answer to an input that grows linearly by 1 over the sample
    states: IntArray  # (d,) states in use
    ideal: IntArray  # (d,) 1: the drive is where it is told to be
    varying: Varying


def continuous(axis: Axis) -> tuple[FloatArray, FloatArray]:
    """State matrix (s,s) and input vector (s,) of an axis; the input of an ideal drive is q''."""
    states = 2 + 2 * len(axis.modes)
    A, B = np.zeros((states, states)), np.zeros(states)
    A[0, 1] = 1.0
    if isinstance(axis.drive, FirstOrderLag):
        A[1, 1] = -1.0 / axis.drive.time_constant
        B[1] = axis.drive.gain / axis.drive.time_constant
    else:
        B[1] = 1.0
    for k, mode in enumerate(axis.modes):
        row = 2 + 2 * k
        A[row, row + 1] = 1.0
        A[row + 1, row] = -(mode.omega**2)
        A[row + 1, row + 1] = -2.0 * mode.damping_ratio * mode.omega
        A[row + 1] -= mode.participation * A[1]
        B[row + 1] = -mode.participation * B[1]
    return A, B


def discretise(axes: Sequence[Axis], sample_time: float, velocity_tick: float | None = None) -> Plant:
    """Discretise every axis at `sample_time` (s), exactly; a servo motor's at its `velocity_tick` (s)."""
    most = max(2 + 2 * len(axis.modes) for axis in axes)
    transition = np.zeros((len(axes), most, most))
    held, rising = np.zeros((len(axes), most)), np.zeros((len(axes), most))
    for row, axis in enumerate(axes):
        s = 2 + 2 * len(axis.modes)
        period = sample_time
        if isinstance(axis.drive, ServoMotor) and velocity_tick is not None:
            period = velocity_tick
        answer = _exponential(axis, period) if axis.modes else _written_down(axis.drive, period)
        transition[row, :s, :s], held[row, :s], rising[row, :s] = answer
    return Plant(
        frozen(transition),
        frozen(held),
        frozen(rising),
        frozen_integers([2 + 2 * len(axis.modes) for axis in axes]),
        frozen_integers([isinstance(axis.drive, IdealDrive) for axis in axes]),
        vary(axes),
    )


def vary(axes: Sequence[Axis]) -> Varying:
    """Lay the tables of all modes out; an axis that is not one of `axes` stands at 0."""
    names = [axis.name for axis in axes]
    most = max(len(axis.modes) for axis in axes)
    rows, watched = np.zeros((len(axes), most, 2), np.int64), np.full((len(axes), most), -1)
    participation, tables = np.zeros((len(axes), most)), [np.zeros((0, 3))]
    laid = 0
    for j, axis in enumerate(axes):
        for k, mode in enumerate(axis.modes):
            participation[j, k] = mode.participation
            if (table := mode.table) is None:
                continue
            omega = TWO_PI * np.array(table.natural_frequency)
            tables.append(np.column_stack([table.position, omega, table.damping_ratio]))
            rows[j, k] = laid, laid + len(table.position)
            laid += len(table.position)
            if table.axis in names:
                watched[j, k] = names.index(table.axis)
    lags = [axis.drive if isinstance(axis.drive, FirstOrderLag) else None for axis in axes]
    return Varying(
        frozen(np.vstack(tables)),
        frozen_integers(rows),
        frozen_integers(watched),
        frozen(participation),
        frozen([0.0 if lag is None else 1.0 / lag.time_constant for lag in lags]),
        frozen([0.0 if lag is None else lag.gain for lag in lags]),
    )


def _exponential(axis: Axis, sample_time: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Transition (s,s) and answers (s,) to a step and to a ramp of the input, by one matrix exponential."""
    A, B = continuous(axis)
    s = B.size
    augmented = np.zeros((s + 2, s + 2))
    augmented[:s, :s], augmented[:s, s], augmented[s, s + 1] = A, B, 1.0 / sample_time
    answer = np.asarray(expm(augmented * sample_time), dtype=np.float64)
    return answer[:s, :s], answer[:s, s], answer[:s, s + 1]


def _written_down(drive: Drive, sample_time: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Transition (2,2) and answers (2,) of a drive alone; see the head of this file."""
    T, x, b = sample_time, 0.0, sample_time
    if isinstance(drive, FirstOrderLag):
        x = -T / drive.time_constant
        b = -x * drive.gain
    phi = _phi(x)
    return (
        np.array([[1.0, T * phi[1]], [0.0, phi[0]]]),
        b * np.array([T * phi[2], phi[1]]),
        b * np.array([T * phi[3], phi[2]]),
    )


def _phi(x: float) -> tuple[float, float, float, float]:
    """phi_0 to phi_3 at x <= 0: from the last down by its series near 0, where the quotients cancel."""
    if x < -1.0:
        zero = exp(x)
        one = (zero - 1.0) / x
        two = (one - 1.0) / x
        return zero, one, two, (two - 0.5) / x
    three = sum(x**k / factorial(k + 3) for k in range(PHI_TERMS))
    two = 0.5 + x * three
    one = 1.0 + x * two
    return 1.0 + x * one, one, two, three
