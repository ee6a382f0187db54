"""The shapers of paper 002, eqs 14-22: what each is asked for, and what our design functions make of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Final

from cnc_shape.modes import Mode
from cnc_shape.shapers import Shaper, sd, zv, zvd
from cnc_shape.units import TWO_PI

UNDAMPED: Final = Mode(natural_frequency=1.0, damping_ratio=0.0)
DAMPED: Final = Mode(natural_frequency=1.0, damping_ratio=0.1)
CONTAINER: Final = Mode(natural_frequency=3.67 / TWO_PI, damping_ratio=0.0015)  # section 5: 3.67 rad/s
LARGEST_AMPLITUDE: Final = 1.5  # A_max, of eq 17
LEAST_GAP: Final = 1e-3  # s, t_min, of eq 17


@dataclass(frozen=True, eq=False, slots=True)
class Equation:
    """A shaper that the paper prints."""

    number: int
    name: str
    mode: Mode
    design: Callable[[Mode], Shaper]
    periods: float | None = None  # its duration in damped periods; None: no specified-duration shaper
    largest: float = inf  # -, bound on |A_i|
    gap: float = 0.0  # s, bound on the time between impulses
    note: str = ""
    variant: str = ""  # how it departs from the paper's

    @property
    def place(self) -> str:
        """``Section 4, eq (15)``."""
        return f"Section {5 if self.mode is CONTAINER else 4}, eq ({self.number}){self.variant}"


def _specified(
    number: int,
    name: str,
    mode: Mode,
    periods: float,
    largest: float | None = None,
    note: str = "",
    variant: str = "",
) -> Equation:
    gap = 0.0 if largest is None else LEAST_GAP

    def design(mode: Mode) -> Shaper:
        return sd(mode, duration_periods=periods, max_amplitude=largest, min_gap=gap)

    bound = inf if largest is None else largest
    return Equation(number, name, mode, design, periods, bound, gap, note, variant)


ASSUMED: Final = (
    "The text has no A_max and no t_min for the container. Those of eq 17 are taken; with A_max = 1 instead "
    "the "
    "shaper is another and hardly less robust."
)

EQUATIONS: Final = (
    _specified(14, "SD 0.8 s, 1 Hz undamped", UNDAMPED, 0.8 / UNDAMPED.damped_period),
    _specified(15, "SD 0.8 s, 1 Hz, ζ 0.1", DAMPED, 0.8 / DAMPED.damped_period),
    _specified(16, "SD 1.3 s, 1 Hz, ζ 0.1", DAMPED, 1.3 / DAMPED.damped_period),
    _specified(17, "SD 0.4 s, 1 Hz, ζ 0.1", DAMPED, 0.4 / DAMPED.damped_period, LARGEST_AMPLITUDE),
    Equation(18, "ZV, 1 Hz, ζ 0.1", DAMPED, lambda mode: zv(mode)),
    Equation(19, "ZVD, 1 Hz, ζ 0.1", DAMPED, lambda mode: zvd(mode)),
    _specified(20, "SD 0.35 periods, container", CONTAINER, 0.35, LARGEST_AMPLITUDE, ASSUMED),
    _specified(21, "SD 0.8 periods, container", CONTAINER, 0.8),
    Equation(22, "ZV, container", CONTAINER, lambda mode: zv(mode)),
)
LOWER: Final = _specified(
    20, "SD 0.35 periods, container", CONTAINER, 0.35, 1.0, "As eq 20, but A_max = 1.", " with A_max 1"
)


@dataclass(frozen=True, eq=False, slots=True)
class Design:
    """An equation and our shaper for it."""

    equation: Equation
    shaper: Shaper

    @property
    def mode(self) -> Mode:
        """The vibration it is for."""
        return self.equation.mode


def designs() -> dict[int, Design]:
    """All nine shapers, by the number of their equation."""
    return {equation.number: designed(equation) for equation in EQUATIONS}


def designed(equation: Equation) -> Design:
    """Our shaper for an equation."""
    return Design(equation, equation.design(equation.mode))
