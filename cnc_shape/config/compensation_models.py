"""The keys of what a servo motor's controller does about loads."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from cnc_shape.config.bounds import Duration, Share, SignedShare
from cnc_shape.config.strict import Strict, refuse_value


def _share(value: object) -> object:
    if isinstance(value, bool):
        return float(value)
    if not isinstance(value, int | float):
        refuse_value("must be true, false or a share", "true feeds the whole estimate forward, false none")
    return value


class DisturbanceObserverModel(Strict):
    """An observer of the load torque."""

    bandwidth_rad_s: Annotated[float, Field(ge=1e-3, le=1e5)] = 300.0
    feedforward: Annotated[SignedShare, BeforeValidator(_share)] = 1.0


class InertiaCompensationModel(Strict):
    """A velocity gain that follows the load."""

    max_gain_ratio: Annotated[float, Field(ge=1.0, le=100.0)] = 2.5
    deadband_nm: Annotated[float, Field(ge=0.0, le=1e6)] | None = None
    regularisation_rad_s2: Annotated[float, Field(ge=1e-6, le=1e9)] | None = None
    window_s: Duration = 0.02
    attack_s: Duration = 0.01
    release_s: Duration = 1.0
    forgetting: Annotated[float, Field(gt=0.0, le=1.0)] = 0.995
    law: Literal["effective_inertia", "literal", "literal_inverse", "fixed", "triggered"] = (
        "effective_inertia"
    )
    scale_integral_time: bool = False
    threshold_um: Annotated[float, Field(ge=1e-6, le=1e6)] = 5.0
    torque_speed_slope_rad_s_nm: Annotated[float, Field(ge=1e-6, le=1e6)] = 3.32


class FrictionFeedforwardModel(Strict):
    """Shares of the motor's own friction that are fed forward."""

    coulomb: Share = 1.0
    viscous: Share = 1.0


class InertiaIdentificationModel(Strict):
    """Identification of the true inertia."""

    forgetting_time_s: Duration = 1.0
    excitation_rad_s2: Annotated[float, Field(ge=0.0, le=1e9)] = 200.0
    smallest_ratio: Annotated[float, Field(ge=1e-3, le=1.0)] = 0.3
    largest_ratio: Annotated[float, Field(ge=1.0, le=1e3)] = 5.0
