"""Planning keys of a machine file -> Planning: what goes together, and what contradicts."""

from __future__ import annotations

from math import inf

from cnc_shape.config.complaints import locate
from cnc_shape.config.models import PlanningModel
from cnc_shape.config.setup import Planning, Shaping
from cnc_shape.config.yaml_tree import Tree, refuse
from cnc_shape.limits import PathLimits

CHORD_KEYS = ("interpolation_period_s", "chord_error_mm")


def planning_of(source: str, tree: Tree, model: PlanningModel) -> Planning:
    """Return how motion is planned.

    Raises
    ------
    ConfigError
        Keys that contradict each other, or one of two that need each other.
    """
    tolerance = model.tool_tolerance_mm
    if tolerance is not None and tolerance <= model.path_tolerance_mm:
        place, _ = locate(tree, ("planning", "tool_tolerance_mm"))
        reason = (
            f"planning.tool_tolerance_mm: {tolerance:g} mm is not more than path_tolerance_mm, by which "
            f"the path itself may leave the program ({model.path_tolerance_mm:g} mm)"
        )
        refuse(source, place, reason, "lower path_tolerance_mm, or allow the tool more")
    return Planning(
        path_tolerance=model.path_tolerance_mm,
        shaping=Shaping(model.shaping),
        stop_dwell=model.stop_dwell_shaper_durations,
        aligned=model.align,
        tool_tolerance=model.tool_tolerance_mm,
        path_limits=_path_limits(source, tree, model),
    )


def _path_limits(source: str, tree: Tree, model: PlanningModel) -> PathLimits:
    period, error = model.interpolation_period_s, model.chord_error_mm
    if (period is None) != (error is None):
        given, lacking = CHORD_KEYS if error is None else CHORD_KEYS[::-1]
        place, _ = locate(tree, ("planning", given))
        reason = f"planning.{given}: limits the feed only together with {lacking}"
        refuse(source, place, reason, f"add {lacking}: to planning, or remove {given}")
    acceleration = model.path_acceleration_mm_s2
    return PathLimits(inf if acceleration is None else acceleration, period, error)
