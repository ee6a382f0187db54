"""RepRapFirmware (Duet): ``M593``, one shaper for all axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.errors import InfeasibleError, OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers import PLAIN, Shaper, duet_ei2, duet_ei3
from cnc_shape.writers.firmware.handover import (
    Family,
    Handover,
    check_apart,
    check_impulses,
    decimal,
    family_of,
    left,
    percent,
    remark,
    subject,
)

CLOCK = 750e3  # Hz, of the steps
LOWEST, LOWEST_3_4 = 4.0, CLOCK / (2 * 65535)  # Hz, of F; half a period of 3.4 has 16 bits
HIGHEST = 1000.0  # Hz
MOST_DAMPING = 0.9  # of S
AMPLITUDE_DIGITS, TIME_DIGITS, MODE_DIGITS = 7, 8, 6  # floats of the firmware have seven
ALIKE_CLOCKS, ALIKE_AMPLITUDES = 1.5, 1e-5  # how far the firmware's own shaper may be off to be named
RRF, RRF_3_4 = "RepRapFirmware", "RepRapFirmware 3.4"

_WORDS: Mapping[Family, str] = {
    Family.ZVD: "zvd", Family.ZVDD: "zvdd", Family.ZVDDD: "zvddd", Family.MZV: "mzv",
    Family.TWO_HUMP_EI: "ei2", Family.THREE_HUMP_EI: "ei3",
}  # fmt: skip
_LAST_OF_EI3 = (
    2.0 * 0.61536
)  # periods per damping^2, by which the firmware's last time is later than the fit's


def rrf(handovers: Sequence[Handover]) -> str:
    """M593 of RepRapFirmware 3.6 and later: single amplitudes, delays from the start.

    Raises
    ------
    OptionError
        Axes whose shapers differ, or nothing to shape.
    InfeasibleError
        More than 5 impulses, frequencies outside 4 to 1000 Hz, amplitudes that the firmware cannot
        complete to 1, impulses closer than its step clock.
    """
    handover = _the_one(handovers)
    _check(handover, RRF, LOWEST)
    amplitudes = _printed(handover.shaper.amplitudes[:-1], AMPLITUDE_DIGITS)
    if amplitudes.sum() >= 1.0:
        raise InfeasibleError(
            f"{RRF} needs all amplitudes but the last to add up to less than 1, not {amplitudes.sum():.6g}",
            hint="design a shaper that ends with a positive impulse: --positive",
        )
    times = np.rint(handover.shaper.times * CLOCK) / CLOCK
    check_apart(times, RRF, f"a step clock of {1e6 / CLOCK:.3g} us")
    rounding = f"rounding to {1e6 / CLOCK:.3g} us"
    return _text(
        handover, _completed(amplitudes, times), amplitudes, _printed(times[1:], TIME_DIGITS), rounding
    )


def rrf_3_4(handovers: Sequence[Handover]) -> str:
    """M593 of RepRapFirmware 3.4 and 3.5: amplitudes that add up, times from impulse to impulse.

    Raises
    ------
    OptionError
        Axes whose shapers differ, or nothing to shape.
    InfeasibleError
        More than 5 impulses, frequencies outside 5.8 to 1000 Hz, negative impulses, or two at one time.
    """
    handover = _the_one(handovers)
    _check(handover, RRF_3_4, LOWEST_3_4)
    sums = _printed(np.cumsum(handover.shaper.amplitudes)[:-1], AMPLITUDE_DIGITS)
    if (np.diff([0.0, *sums, 1.0]) <= 0.0).any():
        raise InfeasibleError(
            f"{RRF_3_4} takes no negative impulses: each sum of amplitudes must exceed the one before",
            hint="design a positive shaper: --positive, zvd or mzv; or --emit rrf for 3.6",
        )
    segments = _printed(np.diff(handover.shaper.times), TIME_DIGITS)
    made = _completed(np.diff([0.0, *sums]), np.append(0.0, np.cumsum(segments)))
    check_apart(made.times, RRF_3_4, f"{10 ** (6 - TIME_DIGITS):g} us")
    return _text(handover, made, sums, segments, "rounding to the digits printed")


def _the_one(handovers: Sequence[Handover]) -> Handover:
    """The shaper of all axes."""
    first = handovers[0]
    for other in handovers[1:]:
        a, b = first.shaper, other.shaper
        if a.times.shape != b.times.shape or not (
            np.allclose(a.times, b.times, rtol=0.0, atol=0.1 / CLOCK)
            and np.allclose(a.amplitudes, b.amplitudes, rtol=0.0, atol=10.0**-AMPLITUDE_DIGITS)
        ):
            raise OptionError(
                f"{RRF} shapes all axes alike, but the shapers of {first.axis} and {other.axis} differ",
                hint=f"pick one for all: --axis {first.axis} or --axis {other.axis}",
            )
    return first


def _check(handover: Handover, controller: str, lowest: float) -> None:
    check_impulses(handover, controller)
    for mode in handover.modes[:1]:
        if not lowest <= mode.natural_frequency <= HIGHEST:
            raise InfeasibleError(
                f"{controller} shapes frequencies from {lowest:.4g} to {HIGHEST:g} Hz, "
                f"not {mode.natural_frequency:g} Hz",
                hint="shape it in front of the controller: --emit c, or cnc-shape apply",
            )


def _printed(values: FloatArray, digits: int) -> FloatArray:
    """The values as they read when printed."""
    return np.round(values, digits)


def _completed(amplitudes: FloatArray, times: FloatArray) -> Shaper:
    """The shaper as the firmware completes it: the last amplitude is what lacks to 1."""
    return Shaper(times=frozen(times), amplitudes=frozen(np.append(amplitudes, 1.0 - amplitudes.sum())))


def _text(handover: Handover, made: Shaper, heights: FloatArray, times: FloatArray, rounding: str) -> str:
    """By name where the firmware's own shaper is the one designed, else impulse by impulse."""
    lines = [f"{subject(handover)}; for all axes"]
    family = family_of(handover)
    word = None if family is None else _WORDS.get(family)
    if family is not None and word is not None:
        mode = handover.modes[0]
        try:
            own = _own(family, mode)
        except InfeasibleError:  # so much damping that the firmware's fit puts its impulses out of order
            own = None
        if own is not None and mode.damping_ratio <= MOST_DAMPING and _alike(own, handover.shaper):
            lines.append(remark(handover, own, rounding))
            frequency = decimal(mode.natural_frequency, MODE_DIGITS)
            damping = decimal(mode.damping_ratio, MODE_DIGITS)
            return _with_comments(lines, f'M593 P"{word}" F{frequency} S{damping}')
        reverse = ", in releases that reverse it" if family is Family.MZV else ""
        leaves = "is out of order" if own is None else f"leaves {percent(left(own, handover.modes))}"
        lines.append(f'impulse by impulse: P"{word}" {leaves}{reverse}')
    lines.append(remark(handover, made, rounding))
    h = ":".join(decimal(height, AMPLITUDE_DIGITS) for height in heights.tolist())
    t = ":".join(decimal(time, TIME_DIGITS) for time in times.tolist())
    return _with_comments(lines, f'M593 P"custom" H{h} T{t}')


def _with_comments(comments: Sequence[str], command: str) -> str:
    return "\n".join([*(f"; {line}" for line in comments), command]) + "\n"


def _own(family: Family, mode: Mode) -> Shaper:
    """The shaper that the firmware makes of F and S.

    All times are fractions of the damped period in whole clocks, those of EI too, whose fits are for the
    undamped one. Some releases give the impulses of mzv in reverse: theirs is taken here.
    """
    period = float(np.rint(CLOCK * mode.damped_period))
    zeta = mode.damping_ratio
    if family is Family.MZV:
        step = period * 3.0 // 8.0
        return Shaper(
            times=frozen(np.arange(3) * step / CLOCK), amplitudes=frozen(PLAIN["mzv"](mode).amplitudes[::-1])
        )
    if family in (Family.TWO_HUMP_EI, Family.THREE_HUMP_EI):
        three = family is Family.THREE_HUMP_EI
        fit = duet_ei3(mode) if three else duet_ei2(mode)
        periods = fit.times * mode.natural_frequency
        if three:
            periods = np.append(periods[:-1], periods[-1] + _LAST_OF_EI3 * zeta**2)
        return Shaper(times=frozen(np.rint(periods * period) / CLOCK), amplitudes=fit.amplitudes)
    amplitudes = PLAIN[_WORDS[family]](mode).amplitudes
    return Shaper(
        times=frozen(np.arange(amplitudes.size) * period // 2.0 / CLOCK), amplitudes=frozen(amplitudes)
    )


def _alike(own: Shaper, designed: Shaper) -> bool:
    return bool(
        own.times.size == designed.times.size
        and np.abs(own.times - designed.times).max() <= ALIKE_CLOCKS / CLOCK
        and np.abs(own.amplitudes - designed.amplitudes).max() <= ALIKE_AMPLITUDES
    )
