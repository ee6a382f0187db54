"""What is handed to a controller: shapers, what they were designed for, what they leave of a vibration."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import TypeAlias

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.errors import InfeasibleError, OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers import Shaper
from cnc_shape.shapers.analysis import residual_vibration
from cnc_shape.shapers.insensitivity import DEFAULT_VIBRATION_TOLERANCE

NOTHING = 5e-12  # -, of V: what rounding leaves of an exact zero
MOST_IMPULSES = 5  # of every firmware that takes impulses at all
FIRMWARE_AXES = ("x", "y", "z")  # that printers shape
EVERY_AXIS = ("x", "y")  # whom a shaper of no axis in particular is for
MZV_IMPULSES, MZV_PERIODS = 3, 0.75  # of the usual mzv


@dataclass(frozen=True, eq=False, slots=True)
class Handover:
    """A shaper for a controller, and what it was designed for."""

    axis: str | None  # of the machine; None is for every axis
    name: str  # in the table of shapers
    options: Mapping[str, object]  # those given, by their keys in a machine file
    modes: tuple[Mode, ...]  # of the axis; none where impulses were given without
    shaper: Shaper

    @property
    def axes(self) -> tuple[str, ...]:
        """Axes to write it for."""
        return EVERY_AXIS if self.axis is None else (self.axis,)

    @property
    def vibration_tolerance(self) -> float:
        """What an EI shaper leaves on purpose."""
        value = self.options.get("vibration_tolerance", DEFAULT_VIBRATION_TOLERANCE)
        assert isinstance(value, float | int)
        return float(value)


Emit: TypeAlias = Callable[[Sequence[Handover]], str]


class Family(Enum):
    """Shapers that firmwares know by name: each computes them from frequency and damping in its own way."""

    ZV = auto()
    ZVD = auto()
    ZVDD = auto()
    ZVDDD = auto()
    MZV = auto()
    EI = auto()
    TWO_HUMP_EI = auto()
    THREE_HUMP_EI = auto()


_BY_DERIVATIVES = (Family.ZV, Family.ZVD, Family.ZVDD, Family.ZVDDD)
_BY_NAME: Mapping[str, Family] = {
    "zvd": Family.ZVD, "zvdd": Family.ZVDD, "zvddd": Family.ZVDDD,
    "ei": Family.EI, "klipper_ei": Family.EI, "fitted_ei": Family.EI,
    "2hump_ei": Family.TWO_HUMP_EI, "klipper_2hump_ei": Family.TWO_HUMP_EI, "duet_ei2": Family.TWO_HUMP_EI,
    "3hump_ei": Family.THREE_HUMP_EI, "klipper_3hump_ei": Family.THREE_HUMP_EI,
    "duet_ei3": Family.THREE_HUMP_EI,
}  # fmt: skip


def family_of(handover: Handover) -> Family | None:
    """The family that a shaper belongs to by its name and options, or None."""
    options = handover.options
    if not handover.modes:
        return None
    if handover.name == "zv":
        derivatives = options.get("derivatives", 0)
        return next((f for n, f in enumerate(_BY_DERIVATIVES) if n == derivatives), None)
    if handover.name == "mzv":
        return Family.MZV if mzv_options(handover) == (MZV_IMPULSES, MZV_PERIODS) else None
    return _BY_NAME.get(handover.name)


def mzv_options(handover: Handover) -> tuple[int, float]:
    """How many impulses an mzv has, and how many damped periods it lasts."""
    impulses = handover.options.get("impulses", MZV_IMPULSES)
    periods = handover.options.get("duration_periods", MZV_PERIODS)
    assert isinstance(impulses, int)
    assert isinstance(periods, float | int)
    return impulses, float(periods)


def left(shaper: Shaper, modes: Sequence[Mode]) -> float:
    """Largest residual vibration V of the modes."""
    return max((float(residual_vibration(shaper, mode)) for mode in modes), default=0.0)


def percent(vibration: float) -> str:
    """V in per cent, for a person."""
    return f"{100.0 * vibration:.4g} %" if vibration > NOTHING else "0 %"


def decimal(value: float, digits: int) -> str:
    """The number without exponent, which G-code does not know, and without zeros at its end."""
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def subject(handover: Handover) -> str:
    """Axis, shaper and modes in words."""
    where = "" if handover.axis is None else f"{handover.axis}: "
    modes = ", ".join(f"{m.natural_frequency:g} Hz (damping {m.damping_ratio:g})" for m in handover.modes)
    size = f"{handover.shaper.times.size} impulses over {1e3 * handover.shaper.duration:.4g} ms"
    return f"{where}{handover.name}{' for ' if modes else ''}{modes}, {size}"


def remark(handover: Handover, made: Shaper, because: str) -> str:
    """What is left of the vibration with the shaper as the controller makes it, and with the one designed."""
    if not handover.modes:
        return "there is no mode to tell what is left of"
    ours, theirs = left(handover.shaper, handover.modes), left(made, handover.modes)
    change = theirs - ours
    why = f": {because} changes it by {100.0 * change:+.2g} points" if abs(change) > NOTHING else ""
    return f"leaves {percent(theirs)} of the vibration, designed for {percent(ours)}{why}"


def check_impulses(handover: Handover, controller: str) -> None:
    """Refuse shapers that no list of impulses of a firmware holds.

    Raises
    ------
    OptionError
        A single impulse.
    InfeasibleError
        More than five.
    """
    count = handover.shaper.times.size
    if count == 1:
        raise OptionError("one impulse shapes nothing: there is nothing to hand over", hint="name a shaper")
    if count > MOST_IMPULSES:
        raise InfeasibleError(
            f"{place(handover)}{controller} takes at most {MOST_IMPULSES} impulses, "
            f"not the {count} of {handover.name}",
            hint=f"design it with at most {MOST_IMPULSES} impulses: zvddd, 3hump_ei, multi_mode or optimal",
        )


def check_apart(times: FloatArray, controller: str, resolution: str) -> None:
    """Refuse impulses that fall on one another where a controller rounds their times.

    Raises
    ------
    InfeasibleError
        `times`, rounded, do not increase.
    """
    if (np.diff(times) <= 0.0).any():
        raise InfeasibleError(
            f"two impulses are closer than {controller} can tell apart, {resolution}",
            hint="design a shaper with fewer impulses, or sd with --min-gap-s",
        )


def check_axis(handover: Handover, controller: str) -> None:
    """Refuse axes that the firmware does not shape.

    Raises
    ------
    OptionError
        Another axis than x, y and z.
    """
    for axis in handover.axes:
        if axis not in FIRMWARE_AXES:
            raise OptionError(
                f"{controller} shapes {', '.join(FIRMWARE_AXES)}, not {axis}", hint="pick one: --axis x"
            )


def place(handover: Handover) -> str:
    """The axis in front of what is said about it."""
    return "" if handover.axis is None else f"{handover.axis}: "
