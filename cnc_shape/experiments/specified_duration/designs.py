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

    @property
    def label(self) -> str:
        """``eq 15``."""
        return f"eq {self.number}"


def _specified(
    number: int, name: str, mode: Mode, periods: float, *, bounded: bool = False, note: str = ""
) -> Equation:
    largest, gap = (LARGEST_AMPLITUDE, LEAST_GAP) if bounded else (inf, 0.0)

    def design(mode: Mode) -> Shaper:
        return sd(mode, duration_periods=periods, max_amplitude=largest if bounded else None, min_gap=gap)

    return Equation(number, name, mode, design, periods, largest, gap, note)


ASSUMED: Final = "A_max and t_min are not said for the container: those of eq 17. "

EQUATIONS: Final = (
    _specified(14, "SD 0.8 s, 1 Hz undamped", UNDAMPED, 0.8 / UNDAMPED.damped_period),
    _specified(15, "SD 0.8 s, 1 Hz, ζ 0.1", DAMPED, 0.8 / DAMPED.damped_period),
    _specified(16, "SD 1.3 s, 1 Hz, ζ 0.1", DAMPED, 1.3 / DAMPED.damped_period),
    _specified(17, "SD 0.4 s, 1 Hz, ζ 0.1", DAMPED, 0.4 / DAMPED.damped_period, bounded=True),
    Equation(18, "ZV, 1 Hz, ζ 0.1", DAMPED, lambda mode: zv(mode)),
    Equation(19, "ZVD, 1 Hz, ζ 0.1", DAMPED, lambda mode: zvd(mode)),
    _specified(20, "SD 0.35 periods, container", CONTAINER, 0.35, bounded=True, note=ASSUMED),
    _specified(21, "SD 0.8 periods, container", CONTAINER, 0.8),
    Equation(22, "ZV, container", CONTAINER, lambda mode: zv(mode)),
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
    return {equation.number: Design(equation, equation.design(equation.mode)) for equation in EQUATIONS}
