"""What `design` is asked for: modes and a corner, from options or from a machine file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

from cnc_shape.errors import OptionError
from cnc_shape.modes import Mode
from cnc_shape.program import ROTARY, XYZ
from cnc_shape.report.shaper_sheet import Corner

AXES = (*XYZ, *ROTARY)
CORNER_TOLERANCE = 0.05  # mm, where no machine says how exact its corners are


@dataclass(frozen=True, slots=True)
class Subject:
    """An axis, or nothing but modes, that wants a shaper."""

    axis: str | None
    modes: tuple[Mode, ...]


def subjects_of(
    frequencies: Sequence[float],
    dampings: Sequence[float],
    frequency_uncertainties: Sequence[float],
    damping_uncertainties: Sequence[float],
    machine: str | None,
    corner_speed: float,
    corner_tolerance: float | None,
    axis: str | None = None,
) -> tuple[tuple[Subject, ...], Corner]:
    """The modes to design for, and the corner to tell about: as given, else those of the machine file.

    With `axis` just that one of the machine, or the given modes as its own.

    Raises
    ------
    OptionError
        Lists of unlike length, no mode, no such axis, or a corner that is none.
    ConfigError
        A machine file that cannot be read.
    """
    tolerance = CORNER_TOLERANCE
    if frequencies:
        share = 1.0 / len(frequencies)
        columns = [
            _per_mode(values, len(frequencies), option)
            for values, option in (
                (dampings, "--damping-ratio"),
                (frequency_uncertainties, "--frequency-uncertainty"),
                (damping_uncertainties, "--damping-uncertainty"),
            )
        ]
        modes = tuple(Mode(f, z, share, u, w) for f, z, u, w in zip(frequencies, *columns, strict=True))
        if axis is not None:
            check_axis(axis, AXES)
        subjects: tuple[Subject, ...] = (Subject(axis, modes),)
    else:
        if dampings or frequency_uncertainties or damping_uncertainties:
            raise OptionError(
                "damping and uncertainty belong to a frequency", hint="give --frequency-hz, too"
            )
        subjects, tolerance = _machine_subjects(machine, axis)
    corner = Corner(corner_speed, tolerance if corner_tolerance is None else corner_tolerance)
    for option, value in (("speed", corner.speed), ("tolerance", corner.tolerance)):
        if not (isfinite(value) and value > 0.0):
            raise OptionError(
                f"the corner's {option} must be positive and finite, not {value:g}", hint="leave it out"
            )
    return subjects, corner


def _per_mode(values: Sequence[float], count: int, option: str) -> Sequence[float]:
    """A value for each mode: as given, nothing, or one uncertainty for all."""
    if not values:
        return [0.0] * count
    if len(values) == 1 and "uncertainty" in option:
        return list(values) * count
    if len(values) != count:
        raise OptionError(
            f"{count} frequencies but {len(values)} times {option}",
            hint=f"repeat {option} once for each --frequency-hz, or leave it out for 0",
        )
    return values


def check_axis(axis: str, known: Sequence[str]) -> None:
    """Refuse an axis that is none of `known`.

    Raises
    ------
    OptionError
        It is none of them.
    """
    if axis not in known:
        raise OptionError(f"--axis is {', '.join(known)}, not {axis!r}", hint="name one of them")


def _machine_subjects(machine: str | None, axis: str | None) -> tuple[tuple[Subject, ...], float]:
    from cnc_shape.config.machine_file import load_machine

    setup = load_machine(machine)
    subjects = tuple(Subject(axis.name, axis.modes) for axis in setup.machine.axes if axis.modes)
    if not subjects:
        raise OptionError(
            f"{setup.source} has no modes",
            hint="give an axis modes: [{frequency_hz: 30, damping_ratio: 0.02}]",
        )
    if axis is not None:
        check_axis(axis, [subject.axis for subject in subjects if subject.axis is not None])
        subjects = tuple(subject for subject in subjects if subject.axis == axis)
    return subjects, setup.planning.path_tolerance
