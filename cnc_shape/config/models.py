"""The keys of a machine file: their types, units, bounds and defaults.

The bounds are those within which a number can be meant: beyond them it is a slip of the pen, or asks for
more memory than there is. Drives, compensation and disturbances have files of their own.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from cnc_shape.config.bounds import Gain, Interval, Length, Positive, Share
from cnc_shape.config.compensation_models import (
    DisturbanceObserverModel,
    FrictionFeedforwardModel,
    InertiaCompensationModel,
    InertiaIdentificationModel,
)
from cnc_shape.config.disturbance_models import AnyDisturbance
from cnc_shape.config.drive_models import AnyDrive
from cnc_shape.config.kinematics import AnyKinematics
from cnc_shape.config.mode_models import OverPositionModel
from cnc_shape.config.shaper_options import AnyShaper
from cnc_shape.config.strict import Strict


class LinearLimits(Strict):
    """What a linear axis may do."""

    velocity_mm_s: Positive
    acceleration_mm_s2: Positive
    jerk_mm_s3: Annotated[float, Field(ge=1e-3, le=1e12)] | None = None
    travel_mm: Interval | None = None


class RotaryLimits(Strict):
    """What a rotary axis may do."""

    velocity_deg_s: Positive
    acceleration_deg_s2: Positive
    jerk_deg_s3: Annotated[float, Field(ge=1e-3, le=1e12)] | None = None
    travel_deg: Interval | None = None


class ModeModel(Strict):
    """A vibration mode between drive and tool."""

    frequency_hz: Annotated[float, Field(ge=1e-3, le=1e5)]
    damping_ratio: Annotated[float, Field(ge=0.0, lt=1.0)]
    participation: Annotated[float, Field(ge=-100.0, le=100.0)] | None = None
    frequency_uncertainty: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    damping_uncertainty: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    over_position: OverPositionModel | None = None


class _AxisModel(Strict):
    drive: AnyDrive | None = None
    modes: list[ModeModel] = Field(default_factory=list[ModeModel], max_length=32)
    shaper: AnyShaper | None = None


class LinearAxisModel(_AxisModel):
    """An axis in mm."""

    limits: LinearLimits


class RotaryAxisModel(_AxisModel):
    """An axis in degrees."""

    limits: RotaryLimits


class AxesModel(Strict):
    """The axes a machine has."""

    x: LinearAxisModel | None = None
    y: LinearAxisModel | None = None
    z: LinearAxisModel | None = None
    a: RotaryAxisModel | None = None
    b: RotaryAxisModel | None = None
    c: RotaryAxisModel | None = None


class JointModel(Strict):
    """A joint: what moves it."""

    drive: AnyDrive | None = None


class PlanningModel(Strict):
    """How motion is planned."""

    path_tolerance_mm: Annotated[float, Field(ge=1e-6, le=100.0)] = 0.01
    shaping: Literal["contour", "axis", "path", "none"] = "contour"
    stop_dwell_shaper_durations: Annotated[float, Field(ge=0.0, le=100.0)] = 0.5
    align: bool = True
    tool_tolerance_mm: Annotated[float, Field(ge=1e-5, le=100.0)] | None = None
    path_acceleration_mm_s2: Annotated[float, Field(ge=1e-3, le=1e9)] | None = None
    interpolation_period_s: Annotated[float, Field(ge=1e-6, le=1.0)] | None = None
    chord_error_mm: Annotated[float, Field(ge=1e-6, le=100.0)] | None = None


class FeedforwardModel(Strict):
    """What is fed forward, and through which drive model."""

    velocity: Share = 0.0
    acceleration: Share = 0.0
    model_time_constant_s: Annotated[float, Field(ge=0.0, le=1e3)] | None = None
    model_gain: Annotated[float, Field(ge=1e-3, le=1e3)] | None = None


class CrossCouplingModel(Strict):
    """How the axes answer the contour error together."""

    estimator: Literal["tangent", "foot_point", "circle"] = "foot_point"
    proportional_per_s: Gain
    integral_per_s2: Annotated[float, Field(ge=0.0, le=1e9)] = 0.0
    derivative: Annotated[float, Field(ge=0.0, le=1e3)] = 0.0
    form: Literal["vector", "scalar"] = "vector"
    orientation_per_s: Gain = 0.0


class ControlModel(Strict):
    """The servo loop."""

    sample_time_s: Annotated[float, Field(ge=1e-6, le=1.0)] = 1e-3
    position_gain_per_s: Annotated[float, Field(gt=0.0, le=1e6)] = 20.0
    delay_samples: Annotated[int, Field(ge=0, le=1000)] = 0
    feedforward: FeedforwardModel | None = None
    cross_coupling: CrossCouplingModel | None = None
    jacobian_every: Annotated[int, Field(ge=1, le=10**6)] = 1
    disturbance_observer: DisturbanceObserverModel | None = None
    inertia_compensation: InertiaCompensationModel | None = None
    friction_feedforward: FrictionFeedforwardModel | None = None
    inertia_identification: InertiaIdentificationModel | None = None


class ToolModel(Strict):
    """A row of the tool table."""

    number: Annotated[int, Field(ge=0, le=10**6)]
    length_mm: Annotated[float, Field(ge=-1e6, le=1e6)] = 0.0
    diameter_mm: Length = 0.0


class MachineModel(Strict):
    """A whole machine file."""

    name: Annotated[str, Field(min_length=1, max_length=200)] | None = None
    kinematics: AnyKinematics | None = None
    axes: AxesModel
    joints: list[JointModel] | None = None
    planning: PlanningModel = PlanningModel()
    control: ControlModel = ControlModel()
    disturbances: list[AnyDisturbance] = Field(default_factory=list[AnyDisturbance], max_length=100)
    tools: list[ToolModel] = Field(default_factory=list[ToolModel], max_length=1000)
