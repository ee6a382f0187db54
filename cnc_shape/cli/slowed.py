"""What a tool tolerance of the machine file does to a command: the motion is slowed down before it runs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cnc_shape.config.setup import Setup
    from cnc_shape.readers import ReadingOptions
    from cnc_shape.slowing import Slowed


def slowed_down(path: str, setup: Setup, options: ReadingOptions, *, quiet: bool) -> Slowed | None:
    """Find the slowdown that the machine's tool tolerance asks for; None where it asks for nothing."""
    tolerance = setup.planning.tool_tolerance
    if tolerance is None or not setup.acting_shapers:
        return None
    from cnc_shape.cli.progress import progress
    from cnc_shape.slowing import slow_down

    with progress("slowing down", None, quiet=quiet):
        return slow_down(path, setup, options, tolerance)


def slowed_notes(slowed: Slowed | None, setup: Setup) -> list[str]:
    """What to tell on standard error."""
    if slowed is not None:
        return [slowed.summary()]
    if setup.planning.tool_tolerance is not None:
        return ["tool_tolerance_mm slows shaped motions down, and nothing is shaped here: it does nothing"]
    return []


def slowed_json(slowed: Slowed | None) -> dict[str, Any]:
    """The same as JSON, to be added to the command's object."""
    if slowed is None:
        return {}
    return {
        "tool_tolerance": {
            "tolerance_um": 1e3 * slowed.tolerance,
            "reached_um": 1e3 * slowed.reached,
            "met": slowed.met,
            "simulations": slowed.passes,
            "models": [dict(model.factors) for model in slowed.models],
            "unhurried_cycle_time_s": slowed.unhurried,
            "cycle_time_s": slowed.cycle_time,
        }
    }
