"""The methods that are compared, by name: what each does about a load."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from cnc_shape.controllers import (
    Control,
    DisturbanceObserver,
    Feedforward,
    FrictionFeedforward,
    GainLaw,
    InertiaCompensation,
)

POSITION_GAIN: Final = 44.67  # 1/s, fitted
NONE: Final = Control(position_gain=POSITION_GAIN)
PAPERS: Final = InertiaCompensation(max_gain_ratio=2.5, deadband=0.12, regularisation=261.0)
FED: Final = Feedforward(velocity=1.0, acceleration=1.0)
COULOMB: Final = FrictionFeedforward(coulomb=1.0, viscous=0.0)


def compensated(
    max_gain_ratio: float = 2.5,
    law: GainLaw = GainLaw.EFFECTIVE_INERTIA,
    base: Control = NONE,
    *,
    scale_integral_time: bool = False,
) -> Control:
    """`base` with a velocity gain that follows the load."""
    term = replace(PAPERS, max_gain_ratio=max_gain_ratio, law=law, scale_integral_time=scale_integral_time)
    return replace(base, inertia_compensation=term)


def observed(bandwidth: float, base: Control = NONE, share: float = 1.0) -> Control:
    """`base` with what a disturbance observer sees fed forward as torque."""
    return replace(base, disturbance_observer=DisturbanceObserver(bandwidth, share))


def stiffer(ratio: float, base: Control = NONE) -> Control:
    """`base` with a velocity gain that is always `ratio` times the nominal one."""
    return compensated(ratio, GainLaw.FIXED, base)


def gain_ratio(control: Control) -> float:
    """Largest velocity gain that a method comes to, over the nominal one."""
    term = control.inertia_compensation
    return 1.0 if term is None else term.max_gain_ratio


PAPER: Final = compensated()  # the paper's method, read consistently
STIFF: Final = stiffer(2.5)
OBSERVER: Final = observed(300.0)
FED_OBSERVER: Final = replace(OBSERVER, feedforward=FED)
OURS: Final = replace(stiffer(1.2, FED_OBSERVER), friction_feedforward=COULOMB)

METHODS: Final[Mapping[str, Control]] = {
    "none": NONE,
    "paper, κ ≤ 2.5": PAPER,
    "paper, κ ≤ 1.5": compensated(1.5),
    "paper, κ ≤ 3": compensated(3.0),
    "paper, κ ≤ 2.5, integral time / κ": compensated(scale_integral_time=True),
    "constant gain × 2.5": STIFF,
    "gain triggered at 5 µm": compensated(law=GainLaw.TRIGGERED),
    "observer 150 rad/s": observed(150.0),
    "observer 300 rad/s": OBSERVER,
    "observer 150 rad/s, paper": compensated(base=observed(150.0)),
    "observer 150 rad/s, friction fed forward": replace(observed(150.0), friction_feedforward=COULOMB),
    "observer 150 rad/s, motion fed forward": replace(observed(150.0), feedforward=FED),
    "observer 300 rad/s, motion fed forward": FED_OBSERVER,
    "ours": OURS,
}

AS_PRINTED: Final[Mapping[str, Control]] = {
    "eq 17 as printed": compensated(law=GainLaw.LITERAL),
    "eqs 15 and 16": compensated(law=GainLaw.LITERAL_INVERSE),
    "sign of eq 4": observed(150.0, share=-1.0),
}
