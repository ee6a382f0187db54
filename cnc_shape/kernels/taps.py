# pyright: basic
"""Delayed, weighted sums of a sampled command, between samples."""

import numpy as np

from cnc_shape.kernels import kernel


@kernel
def delayed_sum(
    position, velocity, acceleration, first, count, whole, share, amplitude, impulses, sample_time
):
    """Sum of delayed commands of every axis.

    The delay of impulse i of axis a is ``(whole[a, i] + share[a, i]) * sample_time`` with 0 <= share < 1.
    Between two samples the command is their cubic Hermite interpolant (position and velocity given, so
    velocity is its derivative); acceleration goes linearly, so that it never exceeds its samples.

    position, velocity, acceleration (n,d); output j belongs to input row first + j; count outputs;
    whole (d,k) int, share (d,k), amplitude (d,k); impulses (d,) how many of the k are used.
    """
    axes = position.shape[1]
    out_position = np.zeros((count, axes))
    out_velocity = np.zeros((count, axes))
    out_acceleration = np.zeros((count, axes))
    for j in range(count):
        for a in range(axes):
            p = v = acc = 0.0
            for i in range(impulses[a]):
                right = first + j - whole[a, i]
                weight = amplitude[a, i]
                back = share[a, i]
                if back == 0.0:
                    p += weight * position[right, a]
                    v += weight * velocity[right, a]
                    acc += weight * acceleration[right, a]
                    continue
                left = right - 1
                x = 1.0 - back
                p0, p1 = position[left, a], position[right, a]
                v0, v1 = velocity[left, a], velocity[right, a]
                step = p1 - p0
                # Hermite cubic relative to the left sample: exact for a command at rest
                s0, s1 = v0 * sample_time, v1 * sample_time
                c2 = 3.0 * step - 2.0 * s0 - s1
                c3 = s0 + s1 - 2.0 * step
                p += weight * (p0 + x * (s0 + x * (c2 + x * c3)))
                v += weight * (s0 + x * (2.0 * c2 + 3.0 * x * c3)) / sample_time
                acc += weight * (acceleration[left, a] * back + acceleration[right, a] * x)
            out_position[j, a] = p
            out_velocity[j, a] = v
            out_acceleration[j, a] = acc
    return out_position, out_velocity, out_acceleration
