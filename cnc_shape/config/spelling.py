"""Numbers of a machine file in the units of its keys, as a person would write them."""

from __future__ import annotations

from math import inf, isfinite, nextafter

from cnc_shape.units import DEGREE, MICROMETRE


def to_degrees(angle: float) -> float:
    """Return the shortest number of degrees that is read back as exactly this `angle`, rad."""
    return _shortest(angle, DEGREE)


def to_micrometres(length: float) -> float:
    """Return the shortest number of µm that is read back as exactly this `length`, mm."""
    return _shortest(length, MICROMETRE)


def _shortest(value: float, unit: float) -> float:
    nearest = value / unit
    if not isfinite(nearest):
        return nearest
    below, above = nextafter(nearest, -inf), nextafter(nearest, inf)
    near = [nextafter(below, -inf), below, nearest, above, nextafter(above, inf)]
    same = [number for number in near if number * unit == value]
    return min(same, key=lambda number: len(repr(number)), default=nearest)
