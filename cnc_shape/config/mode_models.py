"""Keys of a mode that depends on where an axis stands."""

from __future__ import annotations

from typing import Annotated, Literal, cast

from pydantic import BeforeValidator, Field

from cnc_shape.config.strict import Strict
from cnc_shape.modes import HIGHEST_FREQUENCY, LOWEST_FREQUENCY

MOST_ROWS = 1000


def _listed(value: object) -> object:
    """One damping ratio is that of every row."""
    return cast("list[object]", value) if isinstance(value, list) else [value]


Column = Field(min_length=2, max_length=MOST_ROWS)
Positions = Annotated[list[Annotated[float, Field(ge=-1e9, le=1e9)]], Column]
Frequencies = Annotated[list[Annotated[float, Field(ge=LOWEST_FREQUENCY, le=HIGHEST_FREQUENCY)]], Column]
Damping = Annotated[
    list[Annotated[float, Field(ge=0.0, lt=1.0)]],
    Field(min_length=1, max_length=MOST_ROWS),
    BeforeValidator(_listed),
]


class OverPositionModel(Strict):
    """Rows of a table: frequency and damping where an axis stands."""

    axis: Literal["x", "y", "z", "a", "b", "c"] | None = None
    position_mm: Positions | None = None
    position_deg: Positions | None = None
    frequency_hz: Frequencies
    damping_ratio: Damping | None = None
