"""Modes over position against the shapers of their axes: what a check tells, and what is warned of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cnc_shape.config.complaints import locate
from cnc_shape.config.setup import Setup, ShaperChoice
from cnc_shape.config.yaml_tree import Tree
from cnc_shape.machine import Machine
from cnc_shape.program import ROTARY, Note, unit_of
from cnc_shape.shapers import Shaper
from cnc_shape.shapers.insensitivity import DEFAULT_VIBRATION_TOLERANCE
from cnc_shape.shapers.over_position import ModeOverPosition, over_position


@dataclass(frozen=True, eq=False, slots=True)
class VaryingMode:
    """A mode with a table, its place in the machine, and what the shaper of its axis does there."""

    axis: str
    index: int  # of the mode
    shaper: str | None  # its type
    found: ModeOverPosition

    @property
    def unit(self) -> str:
        """Of the positions, as people read them."""
        return "°" if self.found.table.axis in ROTARY else "mm"

    def _place(self, position: float) -> str:
        return f"{position / unit_of(self.found.table.axis):.4g}"

    def summary(self) -> str:
        """Where the mode goes, and what is left of a vibration."""
        found, axis = self.found, self.found.table.axis.upper()
        low, high = found.frequency.min(), found.frequency.max()
        below, above = found.deviation
        start, end = self._place(found.position[0]), self._place(found.position[-1])
        told = (
            f"mode of {found.mode.natural_frequency:g} Hz goes from {low:.4g} to {high:.4g} Hz "
            f"({100.0 * below:+.3g} to {100.0 * above:+.3g} %) over {axis} {start} to {end} {self.unit}"
        )
        if self.shaper is None:
            return told
        most, place = found.worst
        told += f"; {self.shaper} leaves up to {100.0 * most:.3g} % of its vibration"
        told += f", at {axis} {self._place(place)}"
        if most <= DEFAULT_VIBRATION_TOLERANCE:
            return told
        calm, limit = found.calm(), f"{100.0 * DEFAULT_VIBRATION_TOLERANCE:g} %"
        if calm is None:
            return f"{told}, and nowhere less than {limit}"
        return f"{told}, and at most {limit} from {self._place(calm[0])} to {self._place(calm[1])}"

    def numbers(self) -> dict[str, object]:
        """The same, ready for JSON."""
        found, unit = self.found, unit_of(self.found.table.axis)
        key = "position_deg" if self.found.table.axis in ROTARY else "position_mm"
        most, place = found.worst
        return {
            "axis": self.axis,
            "design_frequency_hz": found.mode.natural_frequency,
            "over": found.table.axis,
            key: [float(found.position[0]) / unit, float(found.position[-1]) / unit],
            "frequency_hz": [float(found.frequency.min()), float(found.frequency.max())],
            "deviation": list(found.deviation),
            "band_hz": None if found.band is None else list(found.band),
            "residual_vibration": None if self.shaper is None else most,
            f"residual_vibration_{key}": None if self.shaper is None else place / unit,
        }


def varying_modes(
    machine: Machine, shapers: Mapping[str, Shaper], choices: Mapping[str, ShaperChoice]
) -> list[VaryingMode]:
    """Every mode with a table, over the travel of the table's axis or, where it has none, over the table."""
    return [
        VaryingMode(
            axis.name,
            index,
            choices[axis.name].type if axis.name in shapers else None,
            over_position(mode, shapers.get(axis.name), machine.axis(mode.table.axis).limits.travel),
        )
        for axis in machine.axes
        for index, mode in enumerate(axis.modes)
        if mode.table is not None
    ]


def position_notes(
    tree: Tree, machine: Machine, shapers: Mapping[str, Shaper], choices: Mapping[str, ShaperChoice]
) -> tuple[Note, ...]:
    """Warn of every shaper that leaves more than 5 % of a mode somewhere on its way."""
    notes: list[Note] = []
    for mode in varying_modes(machine, shapers, choices):
        if mode.shaper is not None and mode.found.worst[0] > DEFAULT_VIBRATION_TOLERANCE:
            place, _ = locate(tree, ("axes", mode.axis, "modes", mode.index, "over_position"))
            notes.append(Note(place.line, f"axis {mode.axis}: {mode.summary()}"))
    return tuple(notes)


def position_facts(setup: Setup) -> list[dict[str, object]]:
    """What `check` tells of the modes with tables, ready for JSON."""
    modes = varying_modes(setup.machine, setup.acting_shapers, setup.choices)
    return [{**mode.numbers(), "summary": mode.summary()} for mode in modes]
