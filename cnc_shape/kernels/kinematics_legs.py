# pyright: basic
"""Platforms on six legs: legs of fixed length whose feet slide on rails, and legs that extend.

A pose is x, y, z of the tool centre point and the angles a, b, c of R = Rz(c) Ry(b) Rx(a). Leg i ends at the
platform's point p + R point_i, c_i from the origin of its rail. Its foot slides along the unit vector d_i,

    q_i = c_i.d_i - sqrt(L_i^2 - |c_i|^2 + (c_i.d_i)^2),    s_i = c_i - q_i d_i,

or, where d_i is zero, stays at the origin while the leg extends: q_i = |c_i|, s_i = c_i. A leg keeps its
length but for what it extends, so the rates of joint and pose obey

    (s_i.d_i) q_i' = s_i.v + ((R point_i) x s_i).omega        (|c_i| q_i' = ... where the leg extends).
"""

import math

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.linear import solve


@kernel
def turn_to(pose, rotation):
    """Rotation matrix Rz(c) Ry(b) Rx(a) of pose (6,), and beside it the axis that b turns about.

    Into `rotation` (3,4).
    """
    sa, ca = math.sin(pose[3]), math.cos(pose[3])
    sb, cb = math.sin(pose[4]), math.cos(pose[4])
    sc, cc = math.sin(pose[5]), math.cos(pose[5])
    rotation[0, 0] = cc * cb
    rotation[1, 0] = sc * cb
    rotation[2, 0] = -sb
    rotation[0, 1] = cc * sb * sa - sc * ca
    rotation[1, 1] = sc * sb * sa + cc * ca
    rotation[2, 1] = cb * sa
    rotation[0, 2] = cc * sb * ca + sc * sa
    rotation[1, 2] = sc * sb * ca - cc * sa
    rotation[2, 2] = cb * ca
    rotation[0, 3] = -sc
    rotation[1, 3] = cc
    rotation[2, 3] = 0.0


@kernel
def move_to(axes, pose, rotation):
    """Move `pose` (6,) to axes (6,), and its `rotation` (3,4): most programs keep their angles for long."""
    turns = pose[3] != axes[3] or pose[4] != axes[4] or pose[5] != axes[5]
    for i in range(6):
        pose[i] = axes[i]
    if turns:
        turn_to(pose, rotation)


@kernel
def leg_of(i, pose, rotation, direction, origin, point, length):
    """Leg i at a pose: its joint, the arm R point_i, the vector s_i along the leg, and s_i.d_i.

    direction, origin, point (6,3); length (6,). A leg that cannot reach has a joint of nan; one that
    extends has its length instead of s_i.d_i.
    """
    ax = rotation[0, 0] * point[i, 0] + rotation[0, 1] * point[i, 1] + rotation[0, 2] * point[i, 2]
    ay = rotation[1, 0] * point[i, 0] + rotation[1, 1] * point[i, 1] + rotation[1, 2] * point[i, 2]
    az = rotation[2, 0] * point[i, 0] + rotation[2, 1] * point[i, 1] + rotation[2, 2] * point[i, 2]
    x = pose[0] + ax - origin[i, 0]
    y = pose[1] + ay - origin[i, 1]
    z = pose[2] + az - origin[i, 2]
    dx, dy, dz = direction[i, 0], direction[i, 1], direction[i, 2]
    square = x * x + y * y + z * z
    if dx == 0.0 and dy == 0.0 and dz == 0.0:
        extent = math.sqrt(square) if square > 0.0 else np.nan
        return extent, ax, ay, az, x, y, z, extent
    along = x * dx + y * dy + z * dz
    radicand = length[i] * length[i] - square + along * along
    reach = math.sqrt(radicand) if radicand > 0.0 else np.nan
    joint = along - reach
    return joint, ax, ay, az, x - joint * dx, y - joint * dy, z - joint * dz, reach


@kernel
def joints_of(axes, direction, origin, point, length, joints):
    """Joints of poses axes (n,6): into joints (n,6)."""
    rotation, pose = np.empty((3, 4)), np.full(6, np.nan)
    for row in range(axes.shape[0]):
        move_to(axes[row], pose, rotation)
        for i in range(6):
            leg = leg_of(i, pose, rotation, direction, origin, point, length)
            joints[row, i] = leg[0]


@kernel
def rates_at(pose, rotation, direction, origin, point, length, joint, rates):
    """Joints of one pose and their rates per rate of its axes: into joint (6,) and rates (6,6).

    rotation (3,4) as `turn_to` leaves it. The angular velocity of angle rates is
    omega = a' R ex + b' (-sin c, cos c, 0) + c' ez.
    """
    for i in range(6):
        joint[i], ax, ay, az, sx, sy, sz, reach = leg_of(i, pose, rotation, direction, origin, point, length)
        scale = 1.0 / reach
        mx = (ay * sz - az * sy) * scale
        my = (az * sx - ax * sz) * scale
        mz = (ax * sy - ay * sx) * scale
        rates[i, 0] = sx * scale
        rates[i, 1] = sy * scale
        rates[i, 2] = sz * scale
        rates[i, 3] = mx * rotation[0, 0] + my * rotation[1, 0] + mz * rotation[2, 0]
        rates[i, 4] = mx * rotation[0, 3] + my * rotation[1, 3]
        rates[i, 5] = mz


@kernel
def jacobians_of(axes, direction, origin, point, length, rates):
    """Joint rates per axis rates at poses axes (n,6): into rates (n,6,6)."""
    rotation, pose, joint = np.empty((3, 4)), np.full(6, np.nan), np.empty(6)
    for row in range(axes.shape[0]):
        move_to(axes[row], pose, rotation)
        rates_at(pose, rotation, direction, origin, point, length, joint, rates[row])


@kernel
def poses_of(joints, near, direction, origin, point, length, tolerance, rounds, axes):
    """Poses of joints (n,6), each by Newton's method from its own row of near (n,6): into axes (n,6).

    A step that does not bring the joints nearer is halved. Ends where the largest difference of a joint is
    below `tolerance` (mm); a row that is not there after `rounds` steps is nan.
    """
    rotation, work = np.empty((3, 4)), np.empty((6, 6))
    rates = np.empty((6, 6))
    joint, lacking, step, pose = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    for row in range(joints.shape[0]):
        pose[:] = near[row]
        step[:] = 0.0
        last = np.inf
        found = False
        for _ in range(rounds):
            turn_to(pose, rotation)
            rates_at(pose, rotation, direction, origin, point, length, joint, rates)
            worst = 0.0
            for i in range(6):
                lacking[i] = joints[row, i] - joint[i]
                if not abs(lacking[i]) <= worst:
                    worst = abs(lacking[i])
            if worst < tolerance:
                found = True
                break
            if worst < last:
                last = worst
                solve(rates, lacking, step, work)
                for i in range(6):
                    pose[i] += step[i]
            else:
                for i in range(6):
                    step[i] *= 0.5
                    pose[i] -= step[i]
        for i in range(6):
            axes[row, i] = pose[i] if found else np.nan


@kernel
def turns_of(first, second, angle):
    """Angle of the rotation between the orientations of two poses (n,6) each: into angle (n,), rad."""
    pose, other = np.full(6, np.nan), np.full(6, np.nan)
    before, after, between = np.empty((3, 4)), np.empty((3, 4)), np.empty((3, 3))
    for row in range(first.shape[0]):
        move_to(first[row], pose, before)
        move_to(second[row], other, after)
        for i in range(3):
            for j in range(3):
                between[i, j] = 0.0
                for k in range(3):
                    between[i, j] += before[k, i] * after[k, j]
        x = between[2, 1] - between[1, 2]
        y = between[0, 2] - between[2, 0]
        z = between[1, 0] - between[0, 1]
        trace = between[0, 0] + between[1, 1] + between[2, 2]
        angle[row] = math.atan2(math.sqrt(x * x + y * y + z * z), trace - 1.0)
