"""Linear delta: three carriages on vertical towers hold the tool by links of one length."""

from __future__ import annotations

from math import pi

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.errors import OptionError
from cnc_shape.kernels.kinematics_delta import carriage_rates, carriages, hanging
from cnc_shape.kinematics.kinematics import Kinematics, rows
from cnc_shape.program import XYZ

TOWER_ANGLES = (pi / 2, 7 * pi / 6, 11 * pi / 6)  # rad: 90, 210 and 330 degrees
LEAST_SPREAD = 1e-6  # area of the towers' triangle over the square of their radius


def linear_delta(
    tower_radius: float, link_length: float, tower_angles: tuple[float, float, float] = TOWER_ANGLES
) -> Kinematics:
    """Return the kinematics of a linear delta: q_i = z + sqrt(L^2 - (x-x_i)^2 - (y-y_i)^2).

    Parameters
    ----------
    tower_radius
        Distance of the towers from the centre, less what platform and carriages bridge, mm.
    link_length
        Length L of the links, mm.
    tower_angles
        Where the towers stand around the centre, counterclockwise from x, rad.

    Raises
    ------
    OptionError
        If the links do not reach the centre, or the towers stand in one line.
    """
    if not tower_radius > 0.0:
        raise OptionError(
            f"the tower radius must be above 0 mm, not {tower_radius:g}", argument="tower_radius"
        )
    if not tower_radius < link_length < np.inf:
        raise OptionError(
            f"links of {link_length:g} mm do not reach the centre from towers {tower_radius:g} mm away",
            argument="link_length",
        )
    tower = frozen(tower_radius * np.stack([np.cos(tower_angles), np.sin(tower_angles)], axis=1))
    one, other = tower[1] - tower[0], tower[2] - tower[0]
    if not abs(one[0] * other[1] - one[1] * other[0]) > LEAST_SPREAD * tower_radius**2:
        raise OptionError(
            "three towers in one line do not hold the tool",
            hint="give three different tower angles",
            argument="tower_angles",
        )
    length = float(link_length)

    def forward(joints: FloatArray, near: FloatArray) -> FloatArray:
        axes = np.empty((len(joints), 3))
        hanging(rows(joints, 3), tower, length, axes)
        return axes

    def inverse(axes: FloatArray) -> FloatArray:
        joints = np.empty((len(axes), 3))
        carriages(rows(axes, 3), tower, length, joints)
        return joints

    def inverse_jacobian(axes: FloatArray) -> FloatArray:
        rates = np.empty((len(axes), 3, 3))
        carriage_rates(rows(axes, 3), tower, length, rates)
        return rates

    return Kinematics("linear_delta", XYZ, ("q1", "q2", "q3"), forward, inverse, inverse_jacobian)
