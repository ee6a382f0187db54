# pyright: basic
"""A mode whose frequency and damping depend on where an axis stands, one stretch of time at a time.

Frequency and damping are frozen over the stretch, so that its end is known in closed form for every push
that a drive exerts: a constant one (motor torque held over a tick), a linear one (the cubic of an ideal
drive), and one that dies away (a drive with a lag)::

    d'' + 2 zeta omega d' + omega^2 d = start + slope t + fading e^{-rate t}

The particular solutions are divided by omega^2 and the like, and cancel against the homogeneous one where the
stretch is a small part of a period. There the solution's power series is summed instead, which ends soon.
"""

from typing import NamedTuple

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray
from cnc_shape.kernels import kernel

SHORT = 0.5  # rad, omega T up to which the series is summed
TERMS = 19  # of the series; the rest is below 0.5^19 / 18!, that is 3e-22


class Varying(NamedTuple):
    """Modes with tables, of all axes; m modes an axis at most."""

    table: FloatArray  # (p,3) position in mm or rad, omega in rad/s, zeta: the rows of all tables
    rows: IntArray  # (d,m,2) first row of a mode's table and the one after its last; both 0: it has none
    watched: IntArray  # (d,m) axis on whose position it depends, -1: one that stands at 0
    participation: FloatArray  # (d,m)
    rate: FloatArray  # (d,) 1/s, of a lag drive; 0: another drive
    gain: FloatArray  # (d,) of a lag drive


@kernel
def mode_after(varying, j, mode, position, d, w, start, slope, fading, time):
    """Deflection and its rate, from `d` and `w`, of a mode with a table after its axis `j` has pushed it.

    varying: a `Varying`; position (d,): where all axes stand as the table sees them. The axis accelerates by
    ``start + slope t + fading e^{-rate t}`` over `time`, with the rate of its own lag.
    """
    watched, participation = varying.watched[j, mode], varying.participation[j, mode]
    place = position[watched] if watched >= 0 else 0.0
    omega, zeta = table_at(varying.table, varying.rows[j, mode, 0], varying.rows[j, mode, 1], place)
    return advance(
        d, w, omega, zeta, -participation * start, -participation * slope, -participation * fading,
        varying.rate[j], time,
    )  # fmt: skip


@kernel
def table_at(table, first, last, position):
    """Omega (rad/s) and zeta at `position`: linear between rows `first` to `last` - 1 of `table`.

    table (p,3): position, increasing within these rows, omega and zeta; as at its ends beyond them.
    """
    if not position > table[first, 0]:
        return table[first, 1], table[first, 2]
    if position >= table[last - 1, 0]:
        return table[last - 1, 1], table[last - 1, 2]
    low, high = first, last - 1
    while high - low > 1:
        middle = (low + high) // 2
        if table[middle, 0] <= position:
            low = middle
        else:
            high = middle
    share = (position - table[low, 0]) / (table[high, 0] - table[low, 0])
    omega = table[low, 1] + share * (table[high, 1] - table[low, 1])
    zeta = table[low, 2] + share * (table[high, 2] - table[low, 2])
    return omega, zeta


@kernel
def advance(d, w, omega, zeta, start, slope, fading, rate, time):
    """Deflection and its rate, from `d` and `w`, after `time` (s) of a push; see the head of this file.

    omega (rad/s) above 0, zeta in [0, 1), rate (1/s) at least 0.
    """
    decay, share = np.exp(-rate * time), 0.0
    if fading != 0.0 and (omega * time > SHORT or rate * time > SHORT):
        share = fading / ((rate - zeta * omega) ** 2 + (1.0 - zeta * zeta) * omega * omega)
        d, w, fading = d - share, w + rate * share, 0.0
    if omega * time <= SHORT:
        d, w = _series(d, w, omega, zeta, start, slope, fading, rate, time)
    else:
        d, w = _closed(d, w, omega, zeta, start, slope, time)
    return d + share * decay, w - rate * share * decay


@kernel
def _closed(d, w, omega, zeta, start, slope, time):
    """Particular solution of a linear push, and the homogeneous one of what it leaves."""
    growth = slope / (omega * omega)
    rest = start / (omega * omega) - 2.0 * zeta * growth / omega
    d, w = d - rest, w - growth
    sigma, omega_d = zeta * omega, omega * np.sqrt(1.0 - zeta * zeta)
    envelope = np.exp(-sigma * time)
    cosine, sine = envelope * np.cos(omega_d * time), envelope * np.sin(omega_d * time) / omega_d
    after = cosine * d + sine * (w + sigma * d)
    turned = cosine * w - sine * (sigma * w + omega * omega * d)
    return after + rest + growth * time, turned + growth


@kernel
def _series(d, w, omega, zeta, start, slope, fading, rate, time):
    """Power series in the share of `time` that is over: the equation gives each term from the two before."""
    damping, stiffness = 2.0 * zeta * omega * time, omega * time * omega * time
    before, term = d, w * time
    position, velocity = before + term, term
    push = fading
    for k in range(TERMS):
        acceleration = push
        if k == 0:
            acceleration += start
        elif k == 1:
            acceleration += slope * time
        following = acceleration * time * time - damping * (k + 1) * term - stiffness * before
        following /= (k + 1) * (k + 2)
        position += following
        velocity += (k + 2) * following
        before, term = term, following
        push *= -rate * time / (k + 1)
    return position, velocity / time
