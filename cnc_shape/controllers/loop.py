# pyright: basic
"""The servo loop: one kernel that calls every term.

One tick, in this order: the drives are measured; the loop's terms add up to a velocity command; the
plant runs to the next sample with that command held. Every term stands behind a flag of its own,
so that leaving one out is a line of configuration and costs nothing. A new term is its file and one
line here.
"""

import numpy as np

from cnc_shape.controllers import cross_coupling, feedforward, position_loop
from cnc_shape.kernels import kernel


@kernel
def servo_loop(
    position, velocity, sample_time, transition, held, rising, states, ideal,
    position_gains, feed, feed_gains, couple, couple_gains, plant, late, tangent,
):  # fmt: skip
    """Run n ticks of the loop, Cartesian machine: joints are axes.

    position, velocity (n+1,d) of the command; transition (d,s,s), held, rising (d,s), states, ideal (d,)
    of the plant; feed, couple: 1 where that term acts. plant (d,s), late (k,d) and tangent (3,) are
    changed in place. Returns drive position, tool and velocity command, (n,d) each.
    """
    n, axes = position.shape[0] - 1, position.shape[1]
    joint, tool, drive = np.empty((n, axes)), np.empty((n, axes)), np.empty((n, axes))
    following, mean_velocity, mean_acceleration = np.empty(axes), np.empty(axes), np.empty(axes)
    command = np.empty(axes)
    for k in range(n):
        speed_v2 = 0.0
        for a in range(axes):
            joint[k, a] = plant[a, 0]
            tool[k, a] = plant[a, 0]
            for i in range(2, states[a], 2):
                tool[k, a] += plant[a, i]
            following[a] = position[k, a] - plant[a, 0]
            command[a] = 0.0
            mean_velocity[a] = (position[k + 1, a] - position[k, a]) / sample_time
            mean_acceleration[a] = (velocity[k + 1, a] - velocity[k, a]) / sample_time
            if a < 3:
                speed_v2 += velocity[k, a] ** 2
        if speed_v2 > 0.0:
            for a in range(3):
                tangent[a] = velocity[k, a] / np.sqrt(speed_v2)
        position_loop.step(position_gains, following, command)
        if feed:
            feedforward.step(feed_gains, mean_velocity, mean_acceleration, command)
        if couple:
            cross_coupling.step(couple_gains, following, tangent, command)
        for a in range(axes):
            drive[k, a] = command[a]
            s = states[a]
            if ideal[a]:
                # acceleration of the cubic through both samples: c0 at its start, c1 more at its end
                step = position[k + 1, a] - position[k, a]
                v0, v1 = velocity[k, a], velocity[k + 1, a]
                c0 = (6.0 * step / sample_time - 4.0 * v0 - 2.0 * v1) / sample_time
                c1 = (6.0 * v0 + 6.0 * v1 - 12.0 * step / sample_time) / sample_time
            else:
                c0, c1 = command[a], 0.0
                if late.shape[0] > 0:
                    c0 = late[0, a]
                    for i in range(late.shape[0] - 1):
                        late[i, a] = late[i + 1, a]
                    late[late.shape[0] - 1, a] = command[a]
            # the drive answers itself alone, a mode the drive and itself: all else in `transition` is zero
            q, v = plant[a, 0], plant[a, 1]
            for i in range(2, s, 2):
                d, w = plant[a, i], plant[a, i + 1]
                for j in range(i, i + 2):
                    free = transition[a, j, 0] * q + transition[a, j, 1] * v
                    free += transition[a, j, i] * d + transition[a, j, i + 1] * w
                    plant[a, j] = held[a, j] * c0 + rising[a, j] * c1 + free
            for j in range(2):
                free = transition[a, j, 0] * q + transition[a, j, 1] * v
                plant[a, j] = held[a, j] * c0 + rising[a, j] * c1 + free
            if ideal[a]:
                plant[a, 0] = position[k + 1, a]
                plant[a, 1] = velocity[k + 1, a]
    return joint, tool, drive
