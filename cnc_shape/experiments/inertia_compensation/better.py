"""A better method: more stable than the paper's at every inertia, and an order of magnitude nearer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Final, NamedTuple

import numpy as np

from cnc_shape.controllers import Control
from cnc_shape.disturbances import Disturbances, EncoderNoise, SineBurst
from cnc_shape.experiments.experiment import Row, Table
from cnc_shape.experiments.inertia_compensation.loads import BURST, PEAK, load
from cnc_shape.experiments.inertia_compensation.methods import (
    FED_OBSERVER,
    NONE,
    OBSERVER,
    OURS,
    PAPER,
    STIFF,
    gain_ratio,
)
from cnc_shape.experiments.inertia_compensation.rig import (
    COULOMB,
    INERTIA,
    LOADS,
    MOTOR,
    SHOWN,
    UNLOADED,
    Trial,
    errors,
    lap,
    ripple,
)
from cnc_shape.experiments.inertia_compensation.stability import margins_of
from cnc_shape.units import DEGREE

SEED: Final = 20
VARIANTS: Final = 20
COMPARED: Final[Mapping[str, Control]] = {
    "none": NONE,
    "paper, κ ≤ 2.5": PAPER,
    "constant gain × 2.5": STIFF,
    "observer 300 rad/s": OBSERVER,
    "observer 300 rad/s, motion fed forward": FED_OBSERVER,
    "ours": OURS,
}
INERTIAS: Final = (0.5, 0.75, 1.0, 1.25, 1.5)  # of the nominal one


@cache
def variants() -> tuple[tuple[Trial, float], ...]:
    """Laps that differ from the tabulated one, and the true Coulomb friction of each over the nominal one.

    Inertia of every axis, when the load comes, its sign and frequency, and friction; encoders that are half
    a count uncertain. The controllers know of none of it.
    """
    random = np.random.default_rng(SEED)
    found: list[tuple[Trial, float]] = []
    for number in range(VARIANTS):
        inertia = (INERTIA * random.uniform(0.5, 1.5, 3)).tolist()
        later, faster, rougher = random.uniform((-4.5, 0.7, 0.7), (4.5, 1.2, 1.3)).tolist()
        sign = float(random.choice((-1.0, 1.0)))
        burst = SineBurst(faster * BURST.frequency, BURST.length, BURST.centre + later)
        loads = load(burst, sign * PEAK).loads
        motor = replace(MOTOR, coulomb=rougher * COULOMB)
        trial = Trial(
            motors=(motor, motor, motor), disturbances=Disturbances(loads, EncoderNoise(0.5, number))
        )
        found.append((trial.of_inertia(*inertia), rougher))
    return tuple(found)


def unaware(control: Control, rougher: float) -> Control:
    """`control` where friction is `rougher` times what it takes it for."""
    friction = control.friction_feedforward
    if friction is None:
        return control
    return replace(control, friction_feedforward=replace(friction, coulomb=friction.coulomb / rougher))


class Spread(NamedTuple):
    """RMS and largest contour error over the variants, µm: mean and worst of each."""

    rms: float
    worst_rms: float
    largest: float
    worst_largest: float


@cache
def over_variants(control: Control) -> Spread:
    """Errors of a method over the variants."""
    found = np.array([errors(trial, unaware(control, rougher)) for trial, rougher in variants()])
    (rms, largest), (worst, most) = found.mean(axis=0).tolist(), found.max(axis=0).tolist()
    return Spread(rms, worst, largest, most)


def better_table() -> Table:
    """Our method beside the paper's."""
    rows: list[Row] = []
    for name, trial in LOADS.items():
        theirs, ours = errors(trial, PAPER), errors(trial, OURS)
        rows += [
            Row(f"ours under {name}: RMS", "µm", None, ours[0], SHOWN,
                f"{ours[0] / theirs[0]:.2f} of the paper's method, {theirs[0]:.2f} µm"),
            Row(f"ours under {name}: largest", "µm", None, ours[1], SHOWN,
                f"{ours[1] / theirs[1]:.2f} of the paper's method, {theirs[1]:.2f} µm"),
        ]  # fmt: skip
    for method, control in COMPARED.items():
        found = over_variants(control)
        rows += [
            Row(f"{method}, 20 variants: worst RMS", "µm", None, found.worst_rms, SHOWN,
                f"mean {found.rms:.2f} µm"),
            Row(f"{method}, 20 variants: worst largest", "µm", None, found.worst_largest, SHOWN,
                f"mean {found.largest:.2f} µm"),
        ]  # fmt: skip
    for name, control in (("ours", OURS), ("paper, κ ≤ 2.5", PAPER)):
        several = [margins_of(MOTOR, share, control, gain_ratio(control)) for share in INERTIAS]
        rows += [
            Row(f"{name}: largest maximum sensitivity, inertia 0.5 to 1.5 of the nominal one", "-", None,
                max(one.sensitivity for one in several), SHOWN, f"at {_listed()} times"),
            Row(f"{name}: smallest phase margin, inertia 0.5 to 1.5 of the nominal one", "°", None,
                min(one.phase for one in several) / DEGREE, SHOWN, f"at {_listed()} times"),
        ]  # fmt: skip
    rows.append(
        Row("ours: torque ripple without load over that of none", "-", None,
            ripple(lap(UNLOADED, OURS)) / ripple(lap(UNLOADED, NONE)), SHOWN,
            "standard deviation of the torque's change per ms")
    )  # fmt: skip
    return Table(
        "Beyond the paper: a better method at more stability",
        tuple(rows),
        "Ours feeds everything forward that is known: the commanded velocity and acceleration, Coulomb "
        "friction as the command turns, and the load torque that an observer of 300 rad/s sees. The "
        "velocity gain is 1.2 times the nominal one, always: with it the observer leaves a maximum "
        "sensitivity below 2 and 40° of phase from half the inertia to one and a half, where the paper's "
        "method is nearly unstable at half. The variants are drawn from a fixed seed, other ones than it "
        "was designed on: inertia of every axis within 50 %, the load up to 4.5 s earlier or later, of "
        "either sign and 0.7 to 1.2 times as fast, Coulomb friction within 30 % of what is fed forward, "
        "encoders with half a count of noise.",
    )


def _listed() -> str:
    return ", ".join(f"{share:g}" for share in INERTIAS)
