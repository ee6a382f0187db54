"""Keys of a mode over position -> ModeTable, and back: what goes together, and what contradicts."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import NoReturn

from cnc_shape.config.complaints import KeyPath, refuse_at
from cnc_shape.config.mode_models import OverPositionModel
from cnc_shape.config.spelling import to_degrees
from cnc_shape.config.yaml_tree import Tree
from cnc_shape.modes import ModeTable
from cnc_shape.program import ROTARY, unit_of

IN_MM, IN_DEGREES = "position_mm", "position_deg"


def read_mode_table(
    source: str, tree: Tree, path: KeyPath, model: OverPositionModel, own_axis: str, own_damping: float
) -> ModeTable:
    """Return the table of a mode of `own_axis`, whose damping ratio holds where the table gives none.

    `path` leads to the table in the file.

    Raises
    ------
    ConfigError
        Positions in the wrong unit, missing, or not increasing; columns of unlike length.
    """

    def wrong(where: KeyPath, reason: str, hint: str) -> NoReturn:
        refuse_at(source, tree, (*path, *where), reason, hint)

    axis = model.axis or own_axis
    key, other = (IN_DEGREES, IN_MM) if axis in ROTARY else (IN_MM, IN_DEGREES)
    given = {IN_MM: model.position_mm, IN_DEGREES: model.position_deg}
    if given[other] is not None:
        wrong((other,), f"axis {axis} stands in {'degrees' if axis in ROTARY else 'mm'}", f"write {key}:")
    positions = given[key]
    if positions is None:
        wrong((), f"{key} is missing", f"add {key}: with a place for every frequency")
    for row, (before, after) in enumerate(pairwise(positions), 1):
        if not before < after:
            wrong((key, row), f"{after:g} is not above {before:g} before it", "sort the rows by position")
    damping = _column("damping_ratio", model.damping_ratio or [own_damping], len(positions), wrong)
    frequency = _column("frequency_hz", model.frequency_hz, len(positions), wrong)
    unit = unit_of(axis)
    return ModeTable(axis, tuple(unit * place for place in positions), frequency, damping)


def _column(
    key: str, values: list[float], rows: int, wrong: Callable[[KeyPath, str, str], NoReturn]
) -> tuple[float, ...]:
    """Values of all rows; one is that of all."""
    if len(values) == 1:
        return (values[0],) * rows
    if len(values) != rows:
        wrong((key,), f"{len(values)} values for {rows} positions", "give one for every position")
    return tuple(values)


def dump_mode_table(table: ModeTable) -> dict[str, object]:
    """Return the keys of a table; reading them gives an equal one."""
    rotary = table.axis in ROTARY
    same = len(set(table.damping_ratio)) == 1
    return {
        "axis": table.axis,
        IN_DEGREES if rotary else IN_MM: list(map(to_degrees, table.position) if rotary else table.position),
        "frequency_hz": list(table.natural_frequency),
        "damping_ratio": table.damping_ratio[0] if same else list(table.damping_ratio),
    }
