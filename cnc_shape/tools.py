"""A row of the tool table."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Tool:
    """A tool as G43 H looks it up; the diameter waits for cutter compensation."""

    number: int
    length: float = 0.0  # mm
    diameter: float = 0.0  # mm
