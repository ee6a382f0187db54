"""Marlin: ``M593`` of its stepper, which knows ZV, and ``M493`` of fixed-time motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import exp, pi, sqrt

import numpy as np

from cnc_shape.arrays import frozen
from cnc_shape.errors import InfeasibleError
from cnc_shape.modes import Mode
from cnc_shape.shapers import (
    Shaper,
    klipper_2hump_ei,
    klipper_3hump_ei,
    klipper_ei,
    zv,
    zvd,
    zvdd,
    zvddd,
)
from cnc_shape.writers.firmware.handover import (
    Family,
    Handover,
    check_axis,
    decimal,
    family_of,
    place,
    remark,
    subject,
)

MARLIN, FIXED_TIME = "Marlin", "Marlin's fixed-time motion"
DIGITS = 6
STEPS = 128  # in which the stepper counts the amplitudes
TICKS = 2e6 / 2 / 65534  # Hz, lowest F where the stepper's timer runs at 2 MHz and counts to 16 bits
SAMPLE_TIME = 1e-3  # s, of fixed-time motion
LOWEST, HIGHEST = 10.0, 500.0  # Hz, of A
LOWEST_NEWER = 20.0  # Hz, of A in the default configuration since 2025
LEAST_OLDER_DAMPING = 0.01  # of I, before 2026
MOST_DAMPING = 0.25  # of I


def marlin(handovers: Sequence[Handover]) -> str:
    """``M593`` with frequency and damping: a ZV shaper.

    The stepper's echo comes half a period of F later, however much damping: F is the damped frequency.

    Raises
    ------
    OptionError
        An axis that is not shaped.
    InfeasibleError
        Another shaper than ZV.
    """
    comments, commands = list[str](), list[str]()
    for handover in handovers:
        check_axis(handover, MARLIN)
        if family_of(handover) is not Family.ZV:
            raise InfeasibleError(
                f"{place(handover)}M593 of Marlin knows zv, not {handover.name}",
                hint="use zv; or --emit marlin-ft where fixed-time motion is compiled in",
            )
        mode = handover.modes[0]
        frequency, damping = 1.0 / mode.damped_period, mode.damping_ratio
        echo = round(STEPS * float(handover.shaper.amplitudes[1])) / STEPS
        made = Shaper(times=frozen([0.0, 0.5 / frequency]), amplitudes=frozen([1.0 - echo, echo]))
        comments.append(subject(handover))
        comments.append(remark(handover, made, f"counting amplitudes in {STEPS}ths"))
        if damping > 0.0:
            comments.append("F is the damped frequency, whose half period Marlin puts between the impulses")
        if frequency <= TICKS:
            comments.append(f"a stepper timer of 2 MHz and 16 bits takes F above {TICKS:.3g} Hz only")
        commands += [
            f"M593 {axis.upper()} F{decimal(frequency, DIGITS)} D{decimal(damping, DIGITS)}"
            for axis in handover.axes
        ]
    return _text(comments, commands)


@dataclass(frozen=True, slots=True)
class Compensator:
    """A shaper of fixed-time motion: its number, its amplitudes, and its steps in damped periods."""

    number: int
    step: float
    own: Callable[[Mode, float], Shaper]  # of mode and tolerance, before the rounding to samples
    takes_tolerance: bool = False


def _mzv(mode: Mode, _: float) -> Shaper:
    """Damped as if its steps were half periods."""
    decay = exp(-pi * mode.damping_ratio / sqrt(1.0 - mode.damping_ratio**2))
    weights = np.array([1.0, sqrt(2.0) * decay, decay**2])
    return Shaper(
        times=frozen(0.375 * mode.damped_period * np.arange(3)), amplitudes=frozen(weights / weights.sum())
    )


COMPENSATORS: Mapping[Family, Compensator] = {
    Family.ZV: Compensator(1, 0.5, lambda mode, _: zv(mode)),
    Family.ZVD: Compensator(2, 0.5, lambda mode, _: zvd(mode)),
    Family.ZVDD: Compensator(3, 0.5, lambda mode, _: zvdd(mode)),
    Family.ZVDDD: Compensator(4, 0.5, lambda mode, _: zvddd(mode)),
    Family.EI: Compensator(5, 0.5, lambda mode, v: klipper_ei(mode, vibration_tolerance=v), True),
    Family.TWO_HUMP_EI: Compensator(
        6, 0.5, lambda mode, v: klipper_2hump_ei(mode, vibration_tolerance=v), True
    ),
    Family.THREE_HUMP_EI: Compensator(
        7, 0.5, lambda mode, v: klipper_3hump_ei(mode, vibration_tolerance=v), True
    ),
    Family.MZV: Compensator(8, 0.375, _mzv),
}


def marlin_ft(handovers: Sequence[Handover]) -> str:
    """``M493`` with compensator, frequency, damping and tolerance.

    Raises
    ------
    OptionError
        An axis that is not shaped.
    InfeasibleError
        A shaper that fixed-time motion does not know, a frequency outside 10 to 500 Hz, a damping ratio
        above 0.25.
    """
    comments, commands = list[str](), ["M493 S1"]
    for handover in handovers:
        check_axis(handover, FIXED_TIME)
        family = family_of(handover)
        if family is None:
            raise InfeasibleError(
                f"{place(handover)}{FIXED_TIME} takes no arbitrary impulses, and none of its types is "
                f"this {handover.name}",
                hint="use zv, zvd, zvdd, zvddd, ei, 2hump_ei, 3hump_ei or the usual mzv",
            )
        kind, mode = COMPENSATORS[family], handover.modes[0]
        _check_mode(handover, mode)
        tolerance = handover.vibration_tolerance
        own = kind.own(mode, tolerance)
        step = round(kind.step * mode.damped_period / SAMPLE_TIME) * SAMPLE_TIME
        made = Shaper(times=frozen(step * np.arange(own.times.size)), amplitudes=own.amplitudes)
        comments.append(subject(handover))
        comments.append(remark(handover, made, f"Marlin's formula, rounded to {1e3 * SAMPLE_TIME:g} ms,"))
        if mode.natural_frequency < LOWEST_NEWER:
            comments.append(f"newer versions take A from {LOWEST_NEWER:g} Hz: lower FTM_MIN_SHAPE_FREQ")
        if mode.damping_ratio < LEAST_OLDER_DAMPING:
            comments.append(
                f"versions before 2026 take I from {LEAST_OLDER_DAMPING:g}, and keep the old one else"
            )
        words = [
            f"C{kind.number}",
            f"A{decimal(mode.natural_frequency, DIGITS)}",
            f"I{decimal(mode.damping_ratio, DIGITS)}",
            *([f"Q{decimal(tolerance, DIGITS)}"] if kind.takes_tolerance else []),
        ]
        commands += [" ".join(["M493", axis.upper(), *words]) for axis in handover.axes]
    return _text(comments, commands)


def _check_mode(handover: Handover, mode: Mode) -> None:
    if not LOWEST <= mode.natural_frequency <= HIGHEST:
        raise InfeasibleError(
            f"{place(handover)}{FIXED_TIME} shapes frequencies from {LOWEST:g} to {HIGHEST:g} Hz, "
            f"not {mode.natural_frequency:g} Hz",
            hint="shape it in front of the controller: --emit c, or cnc-shape apply",
        )
    if mode.damping_ratio > MOST_DAMPING:
        raise InfeasibleError(
            f"{place(handover)}{FIXED_TIME} takes damping ratios up to {MOST_DAMPING:g}, "
            f"not {mode.damping_ratio:g}",
            hint="use zv and --emit marlin, which takes any",
        )


def _text(comments: Sequence[str], commands: Sequence[str]) -> str:
    return "\n".join([*(f"; {line}" for line in comments), *commands]) + "\n"
