"""All shapers for the modes of an axis, side by side, and which two to take."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf

from cnc_shape.errors import InfeasibleError, OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers import (
    PLAIN,
    cascade,
    multi_mode,
    optimal,
    sd,
    virtual_mode,
)
from cnc_shape.shapers.measures import ASSUMED_FREQUENCY_ERROR, Assessment, assess
from cnc_shape.shapers.shaper import Shaper

EASY = 1.0 + 1e-9  # -, sum |A| of a shaper that never asks more of an axis than the command does
ALIKE = 0.01  # -, margins that differ by less are the same
SD_PERIODS = (0.9, 1.3, 1.8)  # durations just beyond the jumps of an SD shaper's insensitivity
SHORT_SD = 0.35  # damped periods, with a negative impulse
ACTUATOR = 1.0  # -, how high the impulses of that one may be
VIRTUAL_ACTUATOR = 1.5  # -, and those of a virtual mode (paper 001)
COMPARED = ("zv", "zvd", "zvdd", "zvddd", "umzv", "mzv", "ei", "2hump_ei", "3hump_ei")


@dataclass(frozen=True, eq=False, slots=True)
class Design:
    """A shaper, what it was asked for, and what it does."""

    axis: str | None  # of the machine, where it is for one
    name: str  # in the table of shapers
    options: Mapping[str, object]  # parameter: value, as given
    modes: tuple[Mode, ...]
    shaper: Shaper
    assessment: Assessment

    @property
    def is_easy(self) -> bool:
        """Whether it never asks more of an axis than the unshaped command."""
        return self.shaper.sum_abs_amplitude <= EASY


@dataclass(frozen=True, slots=True)
class Candidate:
    """A shaper that may be compared: its name, and its function with the options bound."""

    name: str
    make: partial[Shaper]  # of the modes it is for
    known: Mapping[str, object] = field(default_factory=dict[str, object])  # of the modes, beside the model

    @property
    def options(self) -> dict[str, object]:
        """What was asked for, as far as it is not the default."""
        return {name: value for name, value in self.make.keywords.items() if value is not False} | dict(
            self.known
        )


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A shaper that these modes have not."""

    name: str
    reason: str


@dataclass(frozen=True, slots=True)
class Recommendation:
    """A design to take, and why."""

    row: int  # among the designs
    reason: str


@dataclass(frozen=True, eq=False, slots=True)
class Comparison:
    """All designs for one axis, shortest first."""

    designs: tuple[Design, ...]
    fastest: Recommendation
    most_robust: Recommendation
    left_out: tuple[LeftOut, ...] = field(default=())


def candidates(modes: Sequence[Mode]) -> list[Candidate]:
    """What is worth comparing for these modes."""
    if len(modes) > 1:
        return _for_several(modes)
    (mode,) = modes
    found = [Candidate(name, partial(PLAIN[name], mode)) for name in COMPARED]
    found.append(Candidate("sd", partial(sd, mode, duration_periods=SHORT_SD, max_amplitude=ACTUATOR)))
    found += [Candidate("sd", partial(sd, mode, duration_periods=periods)) for periods in SD_PERIODS]
    if mode.damping_ratio == 0.0:
        found.append(Candidate("virtual_mode", partial(virtual_mode, mode, max_amplitude=VIRTUAL_ACTUATOR)))
    return [*found, *_optimal(modes)]


def _for_several(modes: Sequence[Mode]) -> list[Candidate]:
    parts: list[Callable[[Mode], Shaper]] = [PLAIN["zv"], PLAIN["zvd"], PLAIN["ei"]]
    return [
        *(Candidate("cascade", partial(cascade, modes, of=part)) for part in parts),
        Candidate("multi_mode", partial(multi_mode, modes)),
        Candidate("multi_mode", partial(multi_mode, modes, positive=True)),
        Candidate("multi_mode", partial(multi_mode, modes, derivatives=[1] * len(modes))),
        *_optimal(modes),
    ]


def _optimal(modes: Sequence[Mode]) -> list[Candidate]:
    """The shortest for the modes as they are, and for modes as uncertain as is assumed of them."""
    unsure = [
        mode if mode.is_uncertain else replace(mode, frequency_uncertainty=ASSUMED_FREQUENCY_ERROR)
        for mode in modes
    ]
    found = [Candidate("optimal", partial(optimal, modes, positive=positive)) for positive in (False, True)]
    if unsure != list(modes):
        known = {"frequency_uncertainty": [mode.frequency_uncertainty for mode in unsure]}
        found.append(Candidate("optimal", partial(optimal, unsure, positive=True), known))
    return found


def compare(
    modes: Sequence[Mode],
    tolerance: float,
    advance: Callable[[float], None] = lambda amount: None,
) -> Comparison:
    """Design every candidate for the modes of an axis, and recommend two.

    Fastest is the shortest, most robust the one with the widest margin of frequency, among those that leave
    at most `tolerance` over the whole range in which the modes may be and never ask more of the axis than
    the unshaped command (sum |A| = 1); where no shaper does, among all that cancel the modes.

    Raises
    ------
    OptionError
        Tolerance outside (0, 1).
    """
    designs, left_out = list[Design](), list[LeftOut]()
    offered = candidates(modes)
    for candidate in offered:
        try:
            shaper = candidate.make()
        except (InfeasibleError, OptionError) as error:
            left_out.append(LeftOut(candidate.name, error.reason))
        else:
            assessment = assess(shaper, modes, tolerance)
            designs.append(Design(None, candidate.name, candidate.options, tuple(modes), shaper, assessment))
        advance(1.0 / len(offered))
    designs.sort(key=lambda design: design.shaper.duration)
    fastest, most_robust = _recommend(designs, tolerance)
    return Comparison(tuple(designs), fastest, most_robust, tuple(left_out))


def _recommend(designs: Sequence[Design], tolerance: float) -> tuple[Recommendation, Recommendation]:
    rows = range(len(designs))
    easy = [row for row in rows if designs[row].is_easy]
    calm = [row for row in easy if designs[row].assessment.worst_residual <= tolerance * EASY]
    among = calm or easy or list(rows)
    fastest = min(among, key=lambda row: designs[row].shaper.duration)
    if not calm:  # nothing holds over the whole range: at least at the modes themselves
        exact = [row for row in among if max(designs[row].assessment.residual_vibration) <= tolerance * EASY]
        fastest = min(exact or among, key=lambda row: designs[row].shaper.duration)
    widest = max(_margin(designs[row]) for row in among)
    robust = min(
        (row for row in among if _margin(designs[row]) >= widest - ALIKE),
        key=lambda row: designs[row].shaper.duration,
    )
    return (
        Recommendation(fastest, _why_fastest(designs, fastest, tolerance, holds=bool(calm))),
        Recommendation(robust, _why_robust(designs[robust], designs[fastest], tolerance)),
    )


def _margin(design: Design) -> float:
    return design.assessment.insensitivity.margin


def _why_fastest(designs: Sequence[Design], row: int, tolerance: float, *, holds: bool) -> str:
    design = designs[row]
    lasting = f"{1e3 * design.shaper.duration:.2f} ms"
    error = max(design.assessment.model_error, key=lambda e: e.residual_vibration)
    where = f"with frequencies {error.frequency:.0%} off" + (
        f" and damping {error.damping:.0%} off" if error.damping else ""
    )
    if holds:
        reason = (
            f"the shortest, {lasting}, that leaves at most {tolerance:.0%} {where} "
            "and never asks more of the axis than the unshaped command"
        )
    else:
        reason = (
            f"the shortest that cancels the modes, {lasting}; no shaper leaves at "
            f"most {tolerance:.0%} {where}, this one leaves {error.residual_vibration:.0%}"
        )
    shorter = [d for d in designs[:row] if not d.is_easy]
    if shorter and holds:
        first = shorter[0]
        reason += (
            f" ({first.name} takes {1e3 * first.shaper.duration:.2f} ms, but may ask "
            f"{first.shaper.sum_abs_amplitude:.3g} times as much)"
        )
    return reason


def _why_robust(design: Design, fastest: Design, tolerance: float) -> str:
    band = design.assessment.insensitivity
    high = "any higher frequency" if band.high is None else f"{band.high:.3f}"
    price = 1e3 * (design.shaper.duration - fastest.shaper.duration)
    return f"at most {tolerance:.0%} is left from {band.low:.3f} to {high} of the modelled frequency; " + (
        f"{price:.2f} ms longer than the fastest" if price > 0.0 else "and it is the fastest, too"
    )


def pareto_front(designs: Sequence[Design]) -> list[int]:
    """Rows that no other design beats in both duration and margin, shortest first."""
    front, best = list[int](), -inf
    order = sorted(
        range(len(designs)), key=lambda row: (designs[row].shaper.duration, -_margin(designs[row]))
    )
    for row in order:
        if _margin(designs[row]) > best:
            front.append(row)
            best = _margin(designs[row])
    return front
