"""Klipper: the section ``[input_shaper]`` of ``printer.cfg``, by type or, in forks, impulse by impulse."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import frozen
from cnc_shape.errors import InfeasibleError
from cnc_shape.modes import Mode
from cnc_shape.shapers import (
    Shaper,
    duet_ei2,
    duet_ei3,
    fitted_ei,
    klipper_2hump_ei,
    klipper_3hump_ei,
    klipper_ei,
    mzv,
    zv,
    zvd,
)
from cnc_shape.shapers.insensitivity import DEFAULT_VIBRATION_TOLERANCE
from cnc_shape.writers.firmware.handover import (
    MOST_IMPULSES,
    Family,
    Handover,
    check_apart,
    check_axis,
    check_impulses,
    decimal,
    family_of,
    left,
    mzv_options,
    percent,
    place,
    remark,
    subject,
)

KLIPPER, CUSTOM = "Klipper", "a Klipper with custom shapers"
DIGITS = 9
LEAST_AMPLITUDE = 1e-3  # of a custom shaper
SHORTEST, LONGEST = 1e-3, 0.2  # s, of a custom shaper
LEAST_NEGATIVE = -1e-5  # -, that an mzv may have
MARGIN = 1e-7  # impulses, by which an mzv of n must exceed 2 t + 1

# rising powers of the damping ratio: last amplitudes of the published fits, which Klipper takes as they are
# and divides all by their sum
_LAST_OF_TWO = (0.15997, -0.60246, 1.00280, -0.93145)
_LAST_OF_THREE = (0.11244, -0.45439, 0.96382, -1.46000)
_LAST_TIME = 2.0 * 0.61536  # periods per damping^2, by which Klipper's last time is later than the fit's


@dataclass(frozen=True, slots=True)
class Type:
    """A shaper that Klipper computes by itself."""

    word: str
    most_damping: float
    own: Callable[[Mode], Shaper]
    older: Callable[[Mode], Shaper] | None = None  # where older ones have another


def _two_humps(mode: Mode) -> Shaper:
    fit = duet_ei2(mode)
    return _normalised(fit, _LAST_OF_TWO, mode, 0.0)


def _three_humps(mode: Mode) -> Shaper:
    return _normalised(duet_ei3(mode), _LAST_OF_THREE, mode, _LAST_TIME * mode.damping_ratio**2)


def _normalised(fit: Shaper, last: Sequence[float], mode: Mode, later: float) -> Shaper:
    amplitudes = np.append(fit.amplitudes[:-1], np.array(last) @ mode.damping_ratio ** np.arange(4))
    times = np.append(fit.times[:-1], fit.times[-1] + later / mode.natural_frequency)
    return Shaper(times=frozen(times), amplitudes=frozen(amplitudes / amplitudes.sum()))


TYPES: Mapping[Family, Type] = {
    Family.ZV: Type("zv", 0.99, zv),
    Family.ZVD: Type("zvd", 0.99, zvd),
    Family.MZV: Type("mzv", 0.99, mzv),
    Family.EI: Type("ei", 0.4, fitted_ei, klipper_ei),
    Family.TWO_HUMP_EI: Type("2hump_ei", 0.3, _two_humps, klipper_2hump_ei),
    Family.THREE_HUMP_EI: Type("3hump_ei", 0.2, _three_humps, klipper_3hump_ei),
}


def klipper(handovers: Sequence[Handover]) -> str:
    """``[input_shaper]`` with types, frequencies and damping ratios.

    Raises
    ------
    OptionError
        An axis that is not shaped, or nothing to shape.
    InfeasibleError
        A shaper that is none of Klipper's types, or whose damping or options the type does not take.
    """
    return _section(handovers, _typed)


def klipper_custom(handovers: Sequence[Handover]) -> str:
    """``[input_shaper]`` with impulses, for forks whose shaper_type may be custom.

    Raises
    ------
    OptionError
        An axis that is not shaped, or nothing to shape.
    InfeasibleError
        More than 5 impulses, one smaller than 0.001, two at one time, a duration outside 0.001 to 0.2 s.
    """
    return _section(handovers, _impulses)


def _section(
    handovers: Sequence[Handover], of_axis: Callable[[Handover, str], tuple[list[str], list[str]]]
) -> str:
    comments, keys = list[str](), list[str]()
    for handover in handovers:
        check_axis(handover, KLIPPER)
        comments.append(subject(handover))
        said = list[str]()
        for axis in handover.axes:
            said, lines = of_axis(handover, axis)
            keys += lines
        comments += said
    return "\n".join([*(f"# {line}" for line in comments), "[input_shaper]", *keys]) + "\n"


def _typed(handover: Handover, axis: str) -> tuple[list[str], list[str]]:
    kind, word = _type_of(handover)
    check_impulses(handover, KLIPPER)
    mode = handover.modes[0]
    if mode.damping_ratio > kind.most_damping:
        raise InfeasibleError(
            f"{place(handover)}the {kind.word} of Klipper takes damping ratios up to {kind.most_damping:g}, "
            f"not {mode.damping_ratio:g}",
            hint=f"use {_nearest_for(mode.damping_ratio)}, or --emit klipper-custom",
        )
    said = [remark(handover, kind.own(mode), "Klipper's own formula")]
    if kind.older is not None and mode.damping_ratio > 0.0:
        older = percent(left(kind.older(mode), handover.modes))
        said.append(f"older Klippers, which scale the undamped shaper, leave {older}")
    if word != kind.word:
        said.append("only newer Klippers take a type with parameters")
    return said, [
        f"shaper_type_{axis}: {word}",
        f"shaper_freq_{axis}: {decimal(mode.natural_frequency, DIGITS)}",
        f"damping_ratio_{axis}: {decimal(mode.damping_ratio, DIGITS)}",
    ]


def _type_of(handover: Handover) -> tuple[Type, str]:
    """The type, and the word for it with its parameters."""
    family = family_of(handover)
    if handover.name == "mzv" and family is None and handover.modes:
        return _mzv_of(handover)
    kind = None if family is None else TYPES.get(family)
    if kind is None:
        raise InfeasibleError(
            f"{place(handover)}{KLIPPER} takes no arbitrary impulses, and none of its types is "
            f"this {handover.name}",
            hint=_instead(handover),
        )
    tolerance = handover.vibration_tolerance
    if "vibration_tolerance" not in handover.options or tolerance == DEFAULT_VIBRATION_TOLERANCE:
        return kind, kind.word
    if family is not Family.EI:
        raise InfeasibleError(
            f"{place(handover)}the {kind.word} of Klipper leaves 5 %, not {percent(tolerance)}",
            hint="use ei, which takes a tolerance, or --emit klipper-custom",
        )
    own = Type(kind.word, kind.most_damping, lambda mode: fitted_ei(mode, vibration_tolerance=tolerance))
    return own, f"ei(v_tol={decimal(tolerance, DIGITS)})"


def _instead(handover: Handover) -> str:
    words = f"use {', '.join(kind.word for kind in TYPES.values())}"
    fits = 1 < handover.shaper.times.size <= MOST_IMPULSES
    return f"{words}; or --emit klipper-custom for a fork that takes impulses" if fits else words


def _mzv_of(handover: Handover) -> tuple[Type, str]:
    impulses, periods = mzv_options(handover)
    most = 0.5 * (impulses - 1)
    if impulses <= 2.0 * periods + 1.0 + MARGIN or (handover.shaper.amplitudes < LEAST_NEGATIVE).any():
        raise InfeasibleError(
            f"{place(handover)}the mzv of Klipper with {impulses} impulses lasts less than {most:g} periods "
            f"and has no negative ones, unlike {periods:g} periods",
            hint="use --duration-periods 0.75, or --emit klipper-custom",
        )

    def own(mode: Mode) -> Shaper:
        return mzv(mode, impulses=impulses, duration_periods=periods)

    kind = TYPES[Family.MZV]
    duration = decimal(periods, DIGITS)
    return (
        Type(kind.word, kind.most_damping, own),
        f"mzv(n={impulses},t={duration if '.' in duration else duration + '.0'})",
    )


def _nearest_for(damping_ratio: float) -> str:
    """The widest of Klipper's shapers that takes so much damping."""
    widest = (Family.THREE_HUMP_EI, Family.TWO_HUMP_EI, Family.EI, Family.ZVD)
    fitting = [TYPES[family] for family in widest if damping_ratio <= TYPES[family].most_damping]
    return fitting[0].word if fitting else f"a damping ratio up to {TYPES[Family.ZVD].most_damping:g}"


def _impulses(handover: Handover, axis: str) -> tuple[list[str], list[str]]:
    check_impulses(handover, CUSTOM)
    shaper = handover.shaper
    smallest = float(np.abs(shaper.amplitudes).min())
    if smallest < LEAST_AMPLITUDE:
        raise InfeasibleError(
            f"{place(handover)}{CUSTOM} takes impulses of {LEAST_AMPLITUDE:g} and more, not {smallest:.3g}",
            hint="use a shaper with fewer impulses, such as zvd",
        )
    if not SHORTEST <= shaper.duration <= LONGEST:
        raise InfeasibleError(
            f"{place(handover)}{CUSTOM} takes durations of {SHORTEST:g} to {LONGEST:g} s, "
            f"not {shaper.duration:.4g} s",
            hint="use a shorter shaper: zv or umzv"
            if shaper.duration > LONGEST
            else "use a longer shaper: zvd",
        )
    made = Shaper(
        times=frozen(np.round(shaper.times, DIGITS)), amplitudes=frozen(np.round(shaper.amplitudes, DIGITS))
    )
    amplitudes = ",".join(decimal(a, DIGITS) for a in made.amplitudes.tolist())
    times = ",".join(decimal(t, DIGITS) for t in made.times.tolist())
    check_apart(made.times, CUSTOM, "1 ns")
    return [remark(handover, made, "rounding to the digits printed")], [
        f"shaper_type_{axis}: custom",
        f"shaper_a_{axis}: {amplitudes}",
        f"shaper_t_{axis}: {times}",
    ]
