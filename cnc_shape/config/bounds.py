"""Bounds within which a number of a machine file can be meant; beyond them it is a slip of the pen."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from cnc_shape.config.strict import refuse_value

Positive = Annotated[float, Field(gt=0.0, le=1e9)]
Gain = Annotated[float, Field(ge=0.0, le=1e6)]
Share = Annotated[float, Field(ge=0.0, le=10.0)]
SignedShare = Annotated[float, Field(ge=-10.0, le=10.0)]
Length = Annotated[float, Field(ge=0.0, le=1e6)]
Coordinate = Annotated[float, Field(ge=-1e9, le=1e9)]
Duration = Annotated[float, Field(ge=1e-6, le=1e3)]
Moment = Annotated[float, Field(ge=-1e6, le=1e6)]  # s, of a program
Torque = Annotated[float, Field(ge=-1e6, le=1e6)]  # N m
Inertia = Annotated[float, Field(ge=1e-9, le=1e4)]  # kg m^2


def _interval(bounds: list[float]) -> list[float]:
    if bounds[0] >= bounds[1]:
        refuse_value(f"the lower end {bounds[0]:g} is not below the upper end {bounds[1]:g}", "swap them")
    return bounds


Interval = Annotated[list[Coordinate], Field(min_length=2, max_length=2), AfterValidator(_interval)]
