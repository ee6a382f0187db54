"""The keys of every kinematics, and the kinematics that they make.

A geometry is checked where it is read: it must hold the tool at the program's origin, where every program
begins, or no motion has a beginning.
"""

from __future__ import annotations

from math import nan
from typing import Annotated, Final, Literal, TypeAlias

import numpy as np
from pydantic import AfterValidator, Field, TypeAdapter, ValidationError, model_validator

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.config.setup import KinematicsChoice
from cnc_shape.config.strict import Strict, refuse_key, refuse_value
from cnc_shape.errors import OptionError
from cnc_shape.kinematics import (
    Kinematics,
    Rails,
    cartesian,
    corexy,
    cubic_parallel,
    cubic_rails,
    linear_delta,
    stewart,
    trunnion_ac,
)
from cnc_shape.kinematics.reach import CONDITION_LIMIT, condition
from cnc_shape.units import DEGREE

LEAST_DIRECTION: Final = 1e-6  # length of a vector that still points somewhere
PARALLEL: Final = 1e-9  # 1 - |cosine| between two legs below which they hold the platform alike
ORIGIN: Final = "x = y = z = 0"


def _pointing(direction: list[float]) -> list[float]:
    if np.linalg.norm(direction) < LEAST_DIRECTION:
        refuse_value("a rail needs a direction, not 0", "give the way it runs, like [0, 0, 1]")
    return direction


Size = Annotated[float, Field(ge=1e-3, le=1e6)]
Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Angle = Annotated[float, Field(ge=-360.0, le=360.0)]
Vector = Annotated[list[Coordinate], Field(min_length=3, max_length=3)]
Angles = Annotated[list[Angle], Field(min_length=3, max_length=3)]
NOWHERE: Final = (0.0, 0.0, 0.0)


class CartesianModel(Strict):
    """One drive per axis."""

    type: Literal["cartesian"]


class CorexyModel(Strict):
    """Two motors and one belt for x and y, a drive of its own for z."""

    type: Literal["corexy"]


class LinearDeltaModel(Strict):
    """Three carriages on vertical towers."""

    type: Literal["linear_delta"]
    tower_radius_mm: Size
    link_length_mm: Size
    tower_angles_deg: Angles = Field(default_factory=lambda: [90.0, 210.0, 330.0])

    @model_validator(mode="after")
    def _holds(self) -> LinearDeltaModel:
        try:
            kinematics = _linear_delta(self)
        except OptionError as error:
            key = {
                "tower_radius": "tower_radius_mm",
                "link_length": "link_length_mm",
                "tower_angles": "tower_angles_deg",
            }[error.argument or "link_length"]
            refuse_value(error.reason, error.hint or "lengthen the links, or move the towers inward", (key,))
        _hold_origin(kinematics, (), "change tower_radius_mm or link_length_mm")
        return self


class RailModel(Strict):
    """A rail, and the leg whose foot slides on it."""

    direction: Annotated[Vector, AfterValidator(_pointing)]
    platform_point_mm: Vector
    origin_mm: Vector
    link_length_mm: Size | None = None


class CubicParallelModel(Strict):
    """Six legs of fixed length on rails: those of a cube, or every rail by itself."""

    type: Literal["cubic_parallel"]
    half_width_mm: Size | None = None
    rails: Annotated[list[RailModel], Field(min_length=6, max_length=6)] | None = None
    link_length_mm: Size | None = None
    tool_offset_mm: Vector = Field(default_factory=lambda: list(NOWHERE))

    @model_validator(mode="after")
    def _holds(self) -> CubicParallelModel:
        if self.rails is None and self.half_width_mm is None:
            refuse_value("needs half_width_mm or rails", "give half_width_mm for a cube, or six rails")
        if self.rails is not None and self.half_width_mm is not None:
            refuse_key("rails", "half_width_mm says where the rails are", "remove one of the two")
        for index, rail in enumerate(self.rails or [None]):
            if self.link_length_mm is None and (rail is None or rail.link_length_mm is None):
                within = () if rail is None else ("rails", index)
                refuse_value("link_length_mm is missing", "add link_length_mm: with its value", within)
        rails = _rails(self)
        for index, short in enumerate(_distances(rails) - rails.link_length):
            if short >= 0.0 and self.rails is not None:
                reason = f"its leg does not reach the platform at {ORIGIN}: it is {short:g} mm short"
                refuse_value(reason, "lengthen link_length_mm, or move origin_mm", ("rails", index))
        _hold_origin(cubic_parallel(rails), () if self.rails is None else ("rails",), "move a rail")
        return self


class LegModel(Strict):
    """A leg that extends between the base and the platform."""

    base_mm: Vector
    platform_mm: Vector


class StewartModel(Strict):
    """Six legs that extend."""

    type: Literal["stewart"]
    legs: Annotated[list[LegModel], Field(min_length=6, max_length=6)]
    tool_offset_mm: Vector = Field(default_factory=lambda: list(NOWHERE))

    @model_validator(mode="after")
    def _holds(self) -> StewartModel:
        hint = f"move base_mm so that {ORIGIN} is amid the tool's space"
        _hold_origin(_stewart(self), ("legs",), hint)
        return self


class TrunnionModel(Strict):
    """A table that tilts about x and turns about its own z."""

    type: Literal["trunnion_ac"]
    pivot_mm: Vector


KinematicsModel: TypeAlias = (
    CartesianModel | CorexyModel | LinearDeltaModel | CubicParallelModel | StewartModel | TrunnionModel
)
AnyKinematics = Annotated[KinematicsModel, Field(discriminator="type")]
_READER: Final[TypeAdapter[KinematicsModel]] = TypeAdapter(AnyKinematics)


def choice_of(model: KinematicsModel) -> KinematicsChoice:
    """Return what a file says of its kinematics, keyed as there."""
    return KinematicsChoice(
        model.type, model.model_dump(exclude={"type"}, exclude_unset=True, exclude_none=True)
    )


def kinematics_of(choice: KinematicsChoice) -> Kinematics:
    """Return the kinematics that `choice` asks for.

    Raises
    ------
    OptionError
        No such kinematics, parameters that it does not take, or a geometry that holds no tool.
    """
    model = _read(choice)
    match model:
        case CartesianModel():
            return cartesian()
        case CorexyModel():
            return corexy()
        case LinearDeltaModel():
            return _linear_delta(model)
        case CubicParallelModel():
            return cubic_parallel(_rails(model))
        case StewartModel():
            return _stewart(model)
        case TrunnionModel():
            return trunnion_ac(frozen(model.pivot_mm))


def rails_of(choice: KinematicsChoice) -> Rails | None:
    """Return the rails of a cubic parallel manipulator; None of another kinematics.

    Raises
    ------
    OptionError
        As `kinematics_of`.
    """
    model = _read(choice)
    return _rails(model) if isinstance(model, CubicParallelModel) else None


def _read(choice: KinematicsChoice) -> KinematicsModel:
    try:
        return _READER.validate_python({"type": choice.type, **choice.options})
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"]))
        hint = str(first.get("ctx", {}).get("hint", "see the keys of the machine file"))
        raise OptionError(f"kinematics: {where}: {first['msg']}", hint=hint, argument="choice") from None


def _linear_delta(model: LinearDeltaModel) -> Kinematics:
    first, second, third = (angle * DEGREE for angle in model.tower_angles_deg)
    return linear_delta(model.tower_radius_mm, model.link_length_mm, (first, second, third))


def _rails(model: CubicParallelModel) -> Rails:
    offset, length = frozen(model.tool_offset_mm), model.link_length_mm or nan
    if model.rails is None:
        return cubic_rails(model.half_width_mm or nan, length, offset)
    direction = np.array([rail.direction for rail in model.rails])
    return Rails(
        frozen(direction / np.linalg.norm(direction, axis=1)[:, None]),
        frozen([rail.platform_point_mm for rail in model.rails]),
        frozen([rail.origin_mm for rail in model.rails]),
        frozen([rail.link_length_mm or length for rail in model.rails]),
        offset,
    )


def _stewart(model: StewartModel) -> Kinematics:
    return stewart(
        frozen([leg.base_mm for leg in model.legs]),
        frozen([leg.platform_mm for leg in model.legs]),
        frozen(model.tool_offset_mm),
    )


def _distances(rails: Rails) -> FloatArray:
    """Distance of every leg's end from its rail where the tool is at the origin, (6,) mm."""
    apart = rails.platform_point - rails.tool_offset - rails.origin
    along = (apart * rails.direction).sum(axis=1)
    return np.linalg.norm(apart - along[:, None] * rails.direction, axis=1)


def _hold_origin(kinematics: Kinematics, legs: tuple[str, ...], hint: str) -> None:
    """Refuse a geometry that does not hold the tool at the origin; `legs` is the key they are listed by."""
    origin = np.zeros((1, len(kinematics.axes)))
    reached = np.isfinite(kinematics.inverse(origin)[0])
    if not reached.all():
        index = int(np.argmin(reached))
        where = (*legs, index) if legs else ()
        refuse_value(f"leg {kinematics.joints[index]} cannot reach {ORIGIN}", hint, where)
    number = float(condition(kinematics, origin)[0][0])
    if number <= CONDITION_LIMIT:
        return
    for one, other in _alike(kinematics.inverse_jacobian(origin)[0], kinematics.radian) if legs else []:
        names = f"{kinematics.joints[one]} and {kinematics.joints[other]}"
        reason = f"legs {names} hold the platform alike at {ORIGIN}, so that it is loose"
        refuse_value(reason, f"give {kinematics.joints[other]} a place of its own", (*legs, other))
    told = (
        f"condition number {number:.3g}, limit {CONDITION_LIMIT:g}" if np.isfinite(number) else "no inverse"
    )
    refuse_value(f"the machine is singular at {ORIGIN}: {told}", hint, legs)


def _alike(rates: FloatArray, radian: float) -> list[tuple[int, int]]:
    """Pairs of rows (six rates of a joint) that are multiples of each other."""
    scaled = rates / np.array([1.0, 1.0, 1.0, radian, radian, radian])
    unit = scaled / np.linalg.norm(scaled, axis=1)[:, None]
    cosine = np.abs(unit @ unit.T)
    return [(i, j) for i in range(6) for j in range(i + 1, 6) if cosine[i, j] > 1.0 - PARALLEL]
