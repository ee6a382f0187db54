"""Compensation: what a drive's controller does about loads, as plain values."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


@dataclass(frozen=True, slots=True)
class DisturbanceObserver:
    """Full-order observer of position, velocity and load torque (paper 003, eqs 1-5), and its feedforward."""

    bandwidth: float = 300.0  # rad/s, of its triple pole
    feedforward: float = 1.0  # -, share of the estimate that is added to the torque; 0: it only watches


WATCHING = DisturbanceObserver(feedforward=0.0)  # where another term needs one and none is configured


class GainLaw(Enum):
    """What raises the gain of the velocity loop, as a ratio to its nominal one."""

    EFFECTIVE_INERTIA = 0  # load torque over acceleration, as an inertia (paper 003, read consistently)
    LITERAL = 1  # Kv = alpha A J / 2 as printed (paper 003, eq 17)
    LITERAL_INVERSE = 2  # Kv = 2 / (alpha A J), what eqs 15 and 16 say
    FIXED = 3  # always the largest ratio
    TRIGGERED = 4  # grows with the displacement under load, all joints together, up to a threshold


@dataclass(frozen=True, slots=True)
class InertiaCompensation:
    """Velocity gain that follows the load (spec: inertia compensation, sections 3.4 and 3.5)."""

    max_gain_ratio: float = 2.5  # -
    deadband: float | None = None  # N m, load below which nothing is done; None: 1.5 times Coulomb friction
    regularisation: float | None = None  # rad/s^2, acceleration that is added; None: deadband / inertia
    window: float = 0.02  # s, time constant of the leaky windows
    attack: float = 0.01  # s, time constant of a rising gain
    release: float = 1.0  # s, of a falling one
    forgetting: float = 0.995  # - per ms, of the agreement between model and contour error
    law: GainLaw = GainLaw.EFFECTIVE_INERTIA
    scale_integral_time: bool = False  # the integral time falls as the gain rises
    threshold: float = 5e-3  # mm, displacement at which GainLaw.TRIGGERED is at the largest ratio
    torque_speed_slope: float = 3.32  # rad/s per N m, alpha of the literal readings

    @property
    def starting_ratio(self) -> float:
        """Gain ratio before the first sample, -."""
        return self.max_gain_ratio if self.law is GainLaw.FIXED else 1.0


@dataclass(frozen=True, slots=True)
class FrictionFeedforward:
    """Shares of the motor's own friction that are fed forward at the lagged reference velocity."""

    coulomb: float = 1.0  # -
    viscous: float = 1.0  # -


@dataclass(frozen=True, slots=True)
class InertiaIdentification:
    """Recursive least squares of the true inertia, gated by excitation (spec: section 3.6)."""

    forgetting_time: float = 1.0  # s
    excitation: float = 200.0  # rad/s^2, RMS acceleration below which nothing is learnt
    smallest: float = 0.3  # -, of the nominal inertia: bounds of what is identified
    largest: float = 5.0  # -
