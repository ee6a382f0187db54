"""The keys of a drive."""

from __future__ import annotations

from math import isnan
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from cnc_shape.config.bounds import Duration, Inertia
from cnc_shape.config.strict import Strict, refuse_value


class IdealDriveModel(Strict):
    """A drive that is where it is told to be; the same as no drive."""

    type: Literal["ideal"]


class FirstOrderLagModel(Strict):
    """A velocity drive ``v' = (gain * u - v) / time_constant``."""

    type: Literal["first_order_lag"]
    time_constant_s: Duration
    gain: Annotated[float, Field(ge=1e-3, le=1e3)] = 1.0


def _number(time: float) -> float:
    if isnan(time):
        refuse_value("must be a time, not nan", "give seconds, or .inf for no integral")
    return time


class VelocityLoopModel(Strict):
    """PI velocity control inside a drive."""

    bandwidth_rad_s: Annotated[float, Field(ge=1e-3, le=1e6)] = 400.0
    integral_time_s: Annotated[float, Field(ge=1e-6, allow_inf_nan=True), AfterValidator(_number)] = 0.01
    sample_time_s: Annotated[float, Field(ge=1e-6, le=1.0)] = 2.5e-4


Lead = Annotated[float, Field(ge=1e-6, le=1e6)]


class ServoMotorModel(Strict):
    """A motor with its drive; which lead it has is said by what it moves."""

    type: Literal["servo_motor"]
    inertia_kg_m2: Inertia
    nominal_inertia_kg_m2: Inertia | None = None
    torque_limit_nm: Annotated[float, Field(ge=1e-6, le=1e6)]
    viscous_nm_s: Annotated[float, Field(ge=0.0, le=1e3)] = 0.0
    coulomb_nm: Annotated[float, Field(ge=0.0, le=1e6)] = 0.0
    current_time_constant_s: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    lead_mm_per_rev: Lead | None = None
    lead_deg_per_rev: Lead | None = None
    encoder_counts_per_rev: Annotated[int, Field(ge=0, le=10**9)] = 0
    velocity_loop: VelocityLoopModel = VelocityLoopModel()


AnyDrive = Annotated[IdealDriveModel | FirstOrderLagModel | ServoMotorModel, Field(discriminator="type")]
