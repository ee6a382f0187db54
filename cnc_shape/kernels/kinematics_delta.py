# pyright: basic
"""The linear delta: three carriages on vertical towers hold the tool by links of one length.

Carriage i stands r_i = sqrt(L^2 - (x-x_i)^2 - (y-y_i)^2) above the tool: q_i = z + r_i.
"""

import math

import numpy as np

from cnc_shape.kernels import kernel


@kernel
def carriages(axes, tower, link, joints):
    """Heights of the carriages, axes (n,3), tower (3,2): into joints (n,3). Out of reach is nan."""
    for row in range(axes.shape[0]):
        for i in range(3):
            x, y = axes[row, 0] - tower[i, 0], axes[row, 1] - tower[i, 1]
            radicand = link * link - x * x - y * y
            joints[row, i] = axes[row, 2] + math.sqrt(radicand) if radicand > 0.0 else np.nan


@kernel
def carriage_rates(axes, tower, link, rates):
    """Carriage rates per axis rates, axes (n,3), tower (3,2): into rates (n,3,3)."""
    for row in range(axes.shape[0]):
        for i in range(3):
            x, y = axes[row, 0] - tower[i, 0], axes[row, 1] - tower[i, 1]
            radicand = link * link - x * x - y * y
            height = math.sqrt(radicand) if radicand > 0.0 else np.nan
            rates[row, i, 0] = -x / height
            rates[row, i, 1] = -y / height
            rates[row, i, 2] = 1.0


@kernel
def hanging(joints, tower, link, axes):
    """Where the tool hangs: the lower meeting point of three spheres around the carriages.

    joints (n,3), tower (3,2): into axes (n,3). With the first carriage as origin, the meeting point lies on
    the line that has equal distance to all three: at the foot ``u`` of the origin, and from there down the
    normal of the plane through the carriages.
    """
    bx, by = tower[1, 0] - tower[0, 0], tower[1, 1] - tower[0, 1]
    cx, cy = tower[2, 0] - tower[0, 0], tower[2, 1] - tower[0, 1]
    nz = bx * cy - by * cx
    for row in range(joints.shape[0]):
        bz, cz = joints[row, 1] - joints[row, 0], joints[row, 2] - joints[row, 0]
        nx, ny = by * cz - bz * cy, bz * cx - bx * cz
        area = nx * nx + ny * ny + nz * nz
        b, c = 0.5 * (bx * bx + by * by + bz * bz), 0.5 * (cx * cx + cy * cy + cz * cz)
        # u = (b (C x n) + c (n x B)) / |n|^2: u.B = b, u.C = c, u.n = 0
        ux = (b * (cy * nz - cz * ny) + c * (ny * bz - nz * by)) / area
        uy = (b * (cz * nx - cx * nz) + c * (nz * bx - nx * bz)) / area
        uz = (b * (cx * ny - cy * nx) + c * (nx * by - ny * bx)) / area
        radicand = link * link - ux * ux - uy * uy - uz * uz
        drop = math.sqrt(radicand / area) if radicand >= 0.0 else np.nan
        if nz > 0.0:
            drop = -drop
        axes[row, 0] = tower[0, 0] + ux + drop * nx
        axes[row, 1] = tower[0, 1] + uy + drop * ny
        axes[row, 2] = joints[row, 0] + uz + drop * nz
