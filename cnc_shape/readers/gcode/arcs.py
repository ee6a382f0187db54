"""Arcs: from I J K or R to centre, sweep and radius.

In each plane the first and second axis are such that their cross product is the plane's normal: XY for
G17, ZX for G18 (so an arc drawn in XZ looks reversed), YZ for G19. G3 turns from the first axis to the
second.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, atan2, hypot, sqrt

from cnc_shape.readers.gcode.codes import PLANE_XY, PLANE_YZ, PLANE_ZX
from cnc_shape.readers.gcode.lexer import BlockError
from cnc_shape.units import MM_PER_INCH, TWO_PI

SPIRAL_TOLERANCE = 0.02828  # mm, end and start radius may differ by it; 0.002828 in under G20
SPIRAL_TOLERANCE_INCH = 0.002828 * MM_PER_INCH  # mm
SPIRAL_REFUSED = 100.0  # times the tolerance: refused, however large the arc
SPIRAL_SHARE = 1e-3  # of the radius: below it, the difference is taken
RADIUS_TOLERANCE = 1.27e-3  # mm, how much R may be smaller than half the chord
SAME_POINT = 1e-6  # mm, an arc's end this close to its start makes a full circle

PLANES = {PLANE_XY: (0, 1, 2), PLANE_ZX: (2, 0, 1), PLANE_YZ: (1, 2, 0)}  # first, second, normal
NORMALS = {PLANE_XY: (0.0, 0.0, 1.0), PLANE_ZX: (0.0, 1.0, 0.0), PLANE_YZ: (1.0, 0.0, 0.0)}
OFFSET_LETTERS = {PLANE_XY: ("I", "J", "K"), PLANE_ZX: ("K", "I", "J"), PLANE_YZ: ("J", "K", "I")}


@dataclass(frozen=True, slots=True)
class Arc:
    """An arc in its plane: centre on the first and second axis, and the signed sweep."""

    center: tuple[float, float]  # mm
    sweep: float  # rad, G3 positive


def arc_by_center(
    start: tuple[float, float],
    end: tuple[float, float],
    center: tuple[float, float],
    direction: float,
    turns: int,
    tolerance: float,
) -> Arc:
    """Arc about `center`; an end that is the start makes a full circle.

    Parameters
    ----------
    start, end, center
        On the first and second axis of the plane, mm.
    direction
        +1 for G3, -1 for G2.
    turns
        P: how many times the end is passed or reached, 1 for a plain arc.
    tolerance
        By how much the radii at start and end may differ, mm.
    """
    from_x, from_y = start[0] - center[0], start[1] - center[1]
    to_x, to_y = end[0] - center[0], end[1] - center[1]
    radius, end_radius = hypot(from_x, from_y), hypot(to_x, to_y)
    if min(radius, end_radius) <= SAME_POINT:
        raise BlockError("the arc's radius is zero", hint="check I, J and K")
    difference = abs(radius - end_radius)
    if difference > SPIRAL_REFUSED * tolerance or (
        difference > tolerance and difference > SPIRAL_SHARE * max(radius, end_radius)
    ):
        raise BlockError(
            f"the arc's radius is {radius:.6g} mm at its start and {end_radius:.6g} mm at its end",
            hint="check the centre: I, J, K count from the start of the arc unless G90.1 is active",
        )
    angle = atan2(from_x * to_y - from_y * to_x, from_x * to_x + from_y * to_y) * direction
    if hypot(end[0] - start[0], end[1] - start[1]) <= SAME_POINT or angle <= 0.0:
        angle += TWO_PI
    return Arc(center, direction * (angle + (turns - 1) * TWO_PI))


def arc_by_radius(
    start: tuple[float, float], end: tuple[float, float], radius: float, direction: float, turns: int
) -> Arc:
    """Arc of `radius` (negative: the longer one) from `start` to `end`; the rest as in `arc_by_center`."""
    chord_x, chord_y = end[0] - start[0], end[1] - start[1]
    chord = hypot(chord_x, chord_y)
    if chord == 0.0:
        raise BlockError(
            "an arc with R ends where it starts: any circle would do",
            hint="give the centre with I, J, K",
            letter="R",
        )
    half, size = 0.5 * chord, abs(radius)
    if half - size > RADIUS_TOLERANCE:
        raise BlockError(
            f"R {size:.6g} mm is too small: half the chord is {half:.6g} mm",
            hint="check R and the end",
            letter="R",
        )
    size = max(size, half)
    long = radius < 0.0
    to_center = sqrt((size - half) * (size + half)) * (-direction if long else direction)
    center = (
        0.5 * (start[0] + end[0]) - to_center * chord_y / chord,
        0.5 * (start[1] + end[1]) + to_center * chord_x / chord,
    )
    minor = 2.0 * asin(min(1.0, half / size))
    return Arc(center, direction * ((TWO_PI - minor if long else minor) + (turns - 1) * TWO_PI))
