"""The shaper of an axis as a machine file has it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import cast

from cnc_shape.modes import Mode
from cnc_shape.writers.firmware.handover import Handover


def yaml(handovers: Sequence[Handover]) -> str:
    """``shaper: {type: ..., ...}`` of each axis, below its name where it has one.

    The type and its options, from which the modes of the axis make the same impulses again: those it was
    designed for stand in a comment. Impulses are written out where they were given.
    """
    lines = list[str]()
    named = [handover for handover in handovers if handover.axis is not None]
    for handover in handovers:
        if handover.axis is None:
            lines += [*_modes(handover.modes), _shaper(handover)]
    if named:
        lines.append("axes:")
    for handover in named:
        inner = [*_modes(handover.modes), _shaper(handover)]
        lines += [f"  {handover.axis}:", *(f"    {line}" for line in inner)]
    return "\n".join(lines) + "\n"


def _modes(modes: Sequence[Mode]) -> list[str]:
    if not modes:
        return []
    items = ", ".join(_mapping(_mode(mode)) for mode in modes)
    return [f"# of an axis with modes: [{items}]"]


def _mode(mode: Mode) -> dict[str, object]:
    keys: dict[str, object] = {"frequency_hz": mode.natural_frequency, "damping_ratio": mode.damping_ratio}
    if mode.frequency_uncertainty:
        keys["frequency_uncertainty"] = mode.frequency_uncertainty
    if mode.damping_uncertainty:
        keys["damping_uncertainty"] = mode.damping_uncertainty
    return keys


def _shaper(handover: Handover) -> str:
    return "shaper: " + _mapping({"type": handover.name, **handover.options})


def _mapping(keys: dict[str, object]) -> str:
    return "{" + ", ".join(f"{key}: {_value(value)}" for key, value in keys.items()) + "}"


def _value(value: object) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(_value(one) for one in cast("list[object]", value)) + "]"
    if isinstance(value, str):
        return value if value.isidentifier() else json.dumps(value)
    text = json.dumps(value)
    if isinstance(value, float) and "." not in text:  # YAML knows 1.0e-05, but 1e-05 only as a text
        text = text.replace("e", ".0e")
    return text
