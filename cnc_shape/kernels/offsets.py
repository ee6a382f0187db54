# pyright: basic
"""What a curve's acceleration does sideways, and its smoothing by a symmetric window."""

import numpy as np

from cnc_shape.kernels import kernel

STANDSTILL = 1e-18  # mm^2/s^2, squared speed below which the direction is that of the acceleration


@kernel
def normal_offsets(velocity, acceleration, gain):
    """The part of ``gain * acceleration`` (axis by axis) that is normal to the motion, row by row.

    The motion goes along the velocity; at rest, along the acceleration.

    velocity, acceleration (n,d); gain (d,) s^2. Returns (n,d) mm.
    """
    rows, axes = velocity.shape
    offset = np.empty((rows, axes))
    for j in range(rows):
        speed2 = push2 = along_velocity = along_acceleration = 0.0
        for a in range(axes):
            pushed = gain[a] * acceleration[j, a]
            offset[j, a] = pushed
            speed2 += velocity[j, a] * velocity[j, a]
            push2 += acceleration[j, a] * acceleration[j, a]
            along_velocity += pushed * velocity[j, a]
            along_acceleration += pushed * acceleration[j, a]
        if speed2 > STANDSTILL:
            share = along_velocity / speed2
            for a in range(axes):
                offset[j, a] -= share * velocity[j, a]
        elif push2 > 0.0:
            share = along_acceleration / push2
            for a in range(axes):
                offset[j, a] -= share * acceleration[j, a]
    return offset


@kernel
def weighted_means(signal, first, count, weights):
    """Weighted sums of a signal: output j of weight set m is ``sum_k w[m, k] s[first + j - k]``.

    signal (n,d); weights (m,k). Returns (m,count,d).
    """
    sets, taps = weights.shape
    axes = signal.shape[1]
    out = np.zeros((sets, count, axes))
    for j in range(count):
        for k in range(taps):
            row = first + j - k
            for a in range(axes):
                value = signal[row, a]
                if value == 0.0:
                    continue
                for m in range(sets):
                    out[m, j, a] += weights[m, k] * value
    return out
