# pyright: basic
"""Estimators of the contour error: from where the tool is to the nearest point of the path, as a vector.

All take the tracking error e = commanded minus actual point, and what the path looks like where the
command is. The tangent estimator leaves out what lies along the path, ``eps = e - <e, t> t`` (paper 004,
eqs 6-13). That is the projection which the paper writes as n <n, e>, without its 0/0 where e lies along the
path. It is off by lag^2 / (2 rho): good if the tool follows closely. The circle estimator takes the path to
be its circle of curvature. The foot point is sought on the programmed path itself.
"""

from __future__ import annotations

from math import hypot, sqrt

from cnc_shape.kernels import inlined
from cnc_shape.kernels.foot_point import point_at, seek_feet

SMALLEST_CURVATURE = 1e-6  # 1/mm, below which a circle is a line
SMALLEST_ARM = 1e-9  # mm, from the centre of curvature: nearer to it every direction is as good


@inlined
def look_ahead(velocity, acceleration, k, curved, frame):
    """Set the unit tangent of a command at sample k, and its curvature if `curved`; at rest both stay.

    velocity, acceleration (n,d) mm/s, mm/s^2; frame (2,3): unit tangent, curvature in 1/mm.
    """
    linear = min(3, velocity.shape[1])
    speed_v2 = 0.0
    for i in range(linear):
        speed_v2 += velocity[k, i] ** 2
    if speed_v2 <= 0.0:
        return
    scale = 1.0 / sqrt(speed_v2)
    for i in range(linear):
        frame[0, i] = velocity[k, i] * scale
    if curved:
        along = 0.0
        for i in range(linear):
            along += acceleration[k, i] * frame[0, i]
        for i in range(linear):
            frame[1, i] = (acceleration[k, i] - along * frame[0, i]) / speed_v2


@inlined
def tangent_error(tracking, frame, error):
    """Contour error by the tangent: tracking (>=3,) mm; frame (2,3): tangent, curvature; error (3,)."""
    along = tracking[0] * frame[0, 0] + tracking[1] * frame[0, 1] + tracking[2] * frame[0, 2]
    for i in range(3):
        error[i] = tracking[i] - along * frame[0, i]


@inlined
def circle_error(tracking, frame, error):
    """Contour error by the circle of curvature, and by the distance from its plane; as `tangent_error`."""
    bend_v2 = frame[1, 0] ** 2 + frame[1, 1] ** 2 + frame[1, 2] ** 2
    if bend_v2 < SMALLEST_CURVATURE**2:
        tangent_error(tracking, frame, error)
        return
    radius = 1.0 / sqrt(bend_v2)
    along, inward = 0.0, 0.0
    for i in range(3):
        along += tracking[i] * frame[0, i]
        inward += tracking[i] * frame[1, i] * radius
    # the tool as seen from the centre: -along on the tangent, -(inward + radius) on the normal
    arm = hypot(along, inward + radius)
    share = 1.0 - radius / max(arm, SMALLEST_ARM)
    for i in range(3):
        normal = frame[1, i] * radius
        in_plane = along * frame[0, i] + inward * normal
        error[i] = share * (in_plane + radius * normal) + tracking[i] - in_plane


@inlined
def foot_error(
    position, tracking, k, path, lower, upper, cursor, tools, feet, distance, place, segment, error
):
    """Contour error to the path itself, for tick k.

    position (n,d) mm, of the command; tracking (d,) mm; path, lower, upper, cursor, distance, place,
    segment: as in `seek_feet`; tools, feet (n,3) mm: row k becomes the tool and its foot point.
    """
    for i in range(3):
        tools[k, i] = position[k, i] - tracking[i]
    seek_feet(tools, lower, upper, k, k + 1, path, cursor, distance, place, segment)
    point_at(path.table, path.arcs, place[k], segment[k], feet, k)
    for i in range(3):
        error[i] = feet[k, i] - tools[k, i]
