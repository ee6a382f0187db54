# pyright: basic
"""A table that tilts about x (a) and turns about its own z (c), both through the pivot.

The point w of the workpiece is at m = Rx(a) Rz(c) (w - g) + g in the machine, g the pivot.
"""

import math

from cnc_shape.kernels import kernel


@kernel
def machine_positions(axes, pivot, joints):
    """From workpiece to machine, axes (n,5), pivot (3,): into joints (n,5)."""
    for row in range(axes.shape[0]):
        sa, ca = math.sin(axes[row, 3]), math.cos(axes[row, 3])
        sc, cc = math.sin(axes[row, 4]), math.cos(axes[row, 4])
        x, y, z = axes[row, 0] - pivot[0], axes[row, 1] - pivot[1], axes[row, 2] - pivot[2]
        x, y = cc * x - sc * y, sc * x + cc * y
        joints[row, 0] = x + pivot[0]
        joints[row, 1] = ca * y - sa * z + pivot[1]
        joints[row, 2] = sa * y + ca * z + pivot[2]
        joints[row, 3] = axes[row, 3]
        joints[row, 4] = axes[row, 4]


@kernel
def workpiece_positions(joints, pivot, axes):
    """From machine to workpiece, joints (n,5), pivot (3,): into axes (n,5)."""
    for row in range(joints.shape[0]):
        sa, ca = math.sin(joints[row, 3]), math.cos(joints[row, 3])
        sc, cc = math.sin(joints[row, 4]), math.cos(joints[row, 4])
        x, y, z = joints[row, 0] - pivot[0], joints[row, 1] - pivot[1], joints[row, 2] - pivot[2]
        y, z = ca * y + sa * z, ca * z - sa * y
        axes[row, 0] = cc * x + sc * y + pivot[0]
        axes[row, 1] = cc * y - sc * x + pivot[1]
        axes[row, 2] = z + pivot[2]
        axes[row, 3] = joints[row, 3]
        axes[row, 4] = joints[row, 4]


@kernel
def machine_rates(axes, pivot, rates):
    """Joint rates per axis rates, axes (n,5), pivot (3,): into rates (n,5,5)."""
    for row in range(axes.shape[0]):
        sa, ca = math.sin(axes[row, 3]), math.cos(axes[row, 3])
        sc, cc = math.sin(axes[row, 4]), math.cos(axes[row, 4])
        x, y, z = axes[row, 0] - pivot[0], axes[row, 1] - pivot[1], axes[row, 2] - pivot[2]
        x, y = cc * x - sc * y, sc * x + cc * y  # on the turned table, before it tilts
        rates[row] = 0.0
        rates[row, 0, 0], rates[row, 0, 1] = cc, -sc
        rates[row, 1, 0], rates[row, 1, 1], rates[row, 1, 2] = ca * sc, ca * cc, -sa
        rates[row, 2, 0], rates[row, 2, 1], rates[row, 2, 2] = sa * sc, sa * cc, ca
        rates[row, 1, 3], rates[row, 2, 3] = -sa * y - ca * z, ca * y - sa * z
        rates[row, 0, 4], rates[row, 1, 4], rates[row, 2, 4] = -y, ca * x, sa * x
        rates[row, 3, 3] = rates[row, 4, 4] = 1.0
