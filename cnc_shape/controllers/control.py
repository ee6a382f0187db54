"""Control: which terms a machine's servo loop is the sum of."""

from __future__ import annotations

from dataclasses import dataclass

from cnc_shape.controllers.compensation import (
    DisturbanceObserver,
    FrictionFeedforward,
    InertiaCompensation,
    InertiaIdentification,
)
from cnc_shape.controllers.cross_coupling import CrossCoupling
from cnc_shape.controllers.feedforward import Feedforward


@dataclass(frozen=True, slots=True)
class Control:
    """The servo loop: position loop always, the other terms where they are given."""

    sample_time: float = 1e-3  # s
    position_gain: float = 20.0  # 1/s
    delay_samples: int = 0  # the drive hears its command this many samples late
    feedforward: Feedforward | None = None
    cross_coupling: CrossCoupling | None = None
    jacobian_every: int = 1  # samples for which the loop keeps the Jacobian of a commanded pose
    joint_gains: tuple[float, ...] = ()  # 1/s, position gain of every joint; (): `position_gain` for all
    disturbance_observer: DisturbanceObserver | None = None  # this and what follows act on servo motors alone
    inertia_compensation: InertiaCompensation | None = None
    friction_feedforward: FrictionFeedforward | None = None
    inertia_identification: InertiaIdentification | None = None

    def gains(self, joints: int) -> tuple[float, ...]:
        """Position gain of every joint, 1/s."""
        return self.joint_gains or (self.position_gain,) * joints
