# pyright: basic
"""The moving frame of a path: tangent, normal and binormal at every sample of a command.

Curvature is what the change of the tangent says, and near rest or on a straight line that is rounding and
no more. There the normal is carried along without a twist about the tangent (parallel transport), so that
it turns with the path and never flickers. An analytic command knows its curvature at every sample: the part
of the acceleration across the velocity. One that was differenced from rounded positions has noise there;
its tangent is told sample by sample, but where it turns to is asked of a window of samples, and believed
where they agree.
"""

import numpy as np

from cnc_shape.kernels import kernel

STRAIGHT = 1e-6  # 1/mm, less curvature is none: a radius of a kilometre
ROUNDING = 1e-10  # -, of an acceleration: less of it across the velocity is rounding
COHERENT = 0.7  # -, of a window's mean square turning, in its mean; a single turn makes 0.65 of it at most
ALONG_Z = 1e-6  # -, sine of the angle to z below which a path runs along it

# What a frame keeps from one sample to the next
TANGENT, NORMAL, TURN, MEAN_TURN = 0, 3, 6, 9  # three numbers each
MEAN_SQUARE, MEAN_STEP, MOVING, CURVED = 12, 13, 14, 15
FRAME_SIZE = 16


@kernel
def transported(normal, before, after):
    """Turn `normal` (3,) in place by the smallest rotation from one tangent (3,) to another."""
    divisor = 1.0 + before[0] * after[0] + before[1] * after[1] + before[2] * after[2]
    if divisor > 1e-12:  # else the path turns back, and the normal may stay
        share = (normal[0] * after[0] + normal[1] * after[1] + normal[2] * after[2]) / divisor
        for a in range(3):
            normal[a] -= share * (before[a] + after[a])


@kernel
def upright(normal, tangent):
    """Make `normal` (3,) a unit vector across `tangent` (3,), in place."""
    along = normal[0] * tangent[0] + normal[1] * tangent[1] + normal[2] * tangent[2]
    for a in range(3):
        normal[a] -= along * tangent[a]
    size = np.sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2])
    for a in range(3):
        normal[a] /= size


@kernel
def path_frames(velocity, acceleration, period, still, share, frame, frames):
    """Frames at consecutive samples of a command.

    velocity, acceleration (n,3) mm/s and mm/s^2; period s; still mm/s, the speed up to which the command
    rests; share of the newest sample in the windows of a differenced command, or 0 for an analytic one;
    frame (FRAME_SIZE,) what the last sample left, zeros before the first, updated in place. frames (n,3,3),
    written: tangent, normal away from the centre of curvature, binormal = tangent x (towards the centre);
    zeros before the first motion.
    """
    tangent = frame[TANGENT : TANGENT + 3]
    normal = frame[NORMAL : NORMAL + 3]
    turn, mean_turn = frame[TURN : TURN + 3], frame[MEAN_TURN : MEAN_TURN + 3]
    now, across = np.zeros(3), np.zeros(3)
    for k in range(velocity.shape[0]):
        vx, vy, vz = velocity[k, 0], velocity[k, 1], velocity[k, 2]
        speed = np.sqrt(vx * vx + vy * vy + vz * vz)
        if speed > still:
            now[0], now[1], now[2] = vx / speed, vy / speed, vz / speed
            curved = False
            if share == 0.0:
                for a in range(3):
                    across[a] = acceleration[k, a]
                along = across[0] * now[0] + across[1] * now[1] + across[2] * now[2]
                whole = np.sqrt(across[0] ** 2 + across[1] ** 2 + across[2] ** 2)
                for a in range(3):
                    across[a] -= along * now[a]
                size = np.sqrt(across[0] ** 2 + across[1] ** 2 + across[2] ** 2)
                curved = size > STRAIGHT * speed * speed and size > ROUNDING * whole
            elif frame[MOVING] == 0.0:
                for a in range(3):
                    turn[a] = mean_turn[a] = 0.0
                frame[MEAN_SQUARE] = frame[MEAN_STEP] = 0.0
            else:
                square = 0.0
                for a in range(3):
                    turn[a] += share * (now[a] - tangent[a] - turn[a])
                    mean_turn[a] += share * (turn[a] - mean_turn[a])
                    across[a] = mean_turn[a]
                    square += turn[a] * turn[a]
                frame[MEAN_SQUARE] += share * (square - frame[MEAN_SQUARE])
                frame[MEAN_STEP] += share * (speed * period - frame[MEAN_STEP])
                along = across[0] * now[0] + across[1] * now[1] + across[2] * now[2]
                for a in range(3):
                    across[a] -= along * now[a]
                size = np.sqrt(across[0] ** 2 + across[1] ** 2 + across[2] ** 2)
                curved = size > STRAIGHT * frame[MEAN_STEP] and size * size > COHERENT * frame[MEAN_SQUARE]
            if curved:
                for a in range(3):
                    normal[a] = -across[a] / size
                frame[CURVED] = 1.0
            elif frame[CURVED] != 0.0:
                transported(normal, tangent, now)
            elif now[0] * now[0] + now[1] * now[1] > ALONG_Z * ALONG_Z:
                normal[0], normal[1], normal[2] = -now[1], now[0], 0.0
            else:
                normal[0], normal[1], normal[2] = 0.0, -now[2], now[1]
            upright(normal, now)
            for a in range(3):
                tangent[a] = now[a]
            frame[MOVING] = 1.0
        else:
            frame[MOVING] = 0.0
        for a in range(3):
            frames[k, 0, a], frames[k, 1, a] = tangent[a], normal[a]
        frames[k, 2, 0] = normal[1] * tangent[2] - normal[2] * tangent[1]
        frames[k, 2, 1] = normal[2] * tangent[0] - normal[0] * tangent[2]
        frames[k, 2, 2] = normal[0] * tangent[1] - normal[1] * tangent[0]
