"""Stewart platform: six legs that extend between a base and a platform (6-UPS)."""

from __future__ import annotations

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.kinematics.kinematics import Kinematics
from cnc_shape.kinematics.legs import Legs, offset_points, on_legs, triple_rows


def stewart(base: FloatArray, platform: FloatArray, tool_offset: FloatArray) -> Kinematics:
    """Return the kinematics of a Stewart platform; its joints are the lengths of the legs.

    Parameters
    ----------
    base
        Feet of the legs, (6,3) mm, in the program's frame.
    platform
        Ends of the legs, (6,3) mm, from the platform's centre.
    tool_offset
        The tool centre point from the platform's centre, (3,) mm.

    Raises
    ------
    ValueError
        If an array has another shape, or a number is not finite.
    """
    ends = triple_rows("platform", platform)
    nothing = frozen(np.zeros((6, 3)))
    legs = Legs(nothing, triple_rows("base", base), offset_points(ends, tool_offset), frozen(np.zeros(6)))
    return on_legs("stewart", legs, float(np.linalg.norm(ends, axis=1).mean()))
