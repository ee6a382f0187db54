"""Cubic parallel manipulator: six legs of fixed length, whose feet slide on rails (6-PUS).

The default geometry has two rails on each of three faces of a cube, along the normal of the face.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.errors import OptionError
from cnc_shape.kinematics.kinematics import Kinematics
from cnc_shape.kinematics.legs import Legs, offset_points, on_legs, triple_rows, twist_jacobian


@dataclass(frozen=True, eq=False, slots=True)
class Rails:
    """Geometry of a platform whose six legs slide on rails."""

    direction: FloatArray  # (6,3) unit vectors, against the foot's leg: q grows towards the platform
    platform_point: FloatArray  # (6,3) mm, where the legs end, from the platform's centre
    origin: FloatArray  # (6,3) mm, where the rails have q = 0, in the program's frame
    link_length: FloatArray  # (6,) mm
    tool_offset: FloatArray  # (3,) mm, the tool centre point from the platform's centre


def cubic_rails(half_width: float, link_length: float, tool_offset: FloatArray) -> Rails:
    """Rails on three faces of a cube, all joints 0 where the tool is at x = y = z = 0, not turned.

    Parameters
    ----------
    half_width
        Distance of the legs' ends from the platform's centre, mm.
    link_length
        Length of the legs, mm.
    tool_offset
        The tool centre point from the platform's centre, (3,) mm.
    """
    if not 0.0 < half_width < np.inf:
        raise OptionError(f"half_width must be above 0 mm, not {half_width:g}", argument="half_width")
    if not 0.0 < link_length < np.inf:
        raise OptionError(f"link_length must be above 0 mm, not {link_length:g}", argument="link_length")
    direction = np.repeat(np.eye(3), 2, axis=0)
    across = np.roll(direction, 1, axis=1) * np.tile([[1.0], [-1.0]], (3, 1))
    platform_point = half_width * across
    origin = offset_points(platform_point, tool_offset) - link_length * direction
    return Rails(
        frozen(direction),
        frozen(platform_point),
        frozen(origin),
        frozen(np.full(6, link_length)),
        frozen(tool_offset),
    )


def legs_on(rails: Rails) -> Legs:
    """Legs of `rails`, checked, with rails of unit direction.

    Raises
    ------
    ValueError
        If an array has another shape than `Rails` says, a number is not finite, a rail has no direction or a
        leg no length.
    """
    direction = triple_rows("direction", rails.direction)
    size = np.linalg.norm(direction, axis=1)
    if not (size > 0.0).all():
        raise ValueError(f"the rail of q{int(np.argmin(size)) + 1} has no direction")
    length = frozen(rails.link_length)
    if length.shape != (6,):
        raise ValueError(f"link_length has shape {length.shape}, not (6,)")
    if not ((length > 0.0) & (length < np.inf)).all():
        raise ValueError("link_length must be above 0 mm")
    point = offset_points(triple_rows("platform_point", rails.platform_point), rails.tool_offset)
    return Legs(frozen(direction / size[:, None]), triple_rows("origin", rails.origin), point, length)


def cubic_parallel(rails: Rails) -> Kinematics:
    """Return the kinematics of a platform on rails; raises ValueError as `legs_on` does."""
    legs = legs_on(rails)
    return on_legs("cubic_parallel", legs, float(np.linalg.norm(rails.platform_point, axis=1).mean()))


def reciprocal_jacobian(rails: Rails, position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Joint rates per twist (v of the tool centre point; omega), (6,6), by reciprocal screws.

    position (3,) mm; rotation (3,3). A leg that cannot reach has a row of nan.
    """
    return twist_jacobian(legs_on(rails), position, rotation)
