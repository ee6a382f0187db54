"""What a program has set so far: the modal state that is folded over the blocks."""

from __future__ import annotations

from dataclasses import dataclass, field

from cnc_shape.program import PathMode
from cnc_shape.readers.gcode.codes import PER_MINUTE, PLANE_XY

NAN = float("nan")
AXES = "XYZABC"  # order of positions in the interpreter: mm and degrees


def _zeros() -> list[float]:
    return [0.0] * len(AXES)


@dataclass(slots=True)
class Modal:
    """Modes, offsets and the position, in mm and degrees of the machine frame.

    A programmed coordinate p stands for ``p + offset`` of the machine: the tool's length and G92.
    """

    motion: int | None = None  # code of the motion group; None before any, and after G80
    plane: int = PLANE_XY
    absolute: bool = True
    arc_absolute: bool = False
    millimetres: float = 1.0  # per programmed length unit
    diameter: bool = False  # X is a diameter (G7)
    feed_mode: int = PER_MINUTE
    feed: float = 0.0  # mm/min, mm/rev, or 1/min by the feed mode; 0: not set
    feed_angular: float = 0.0  # deg/min, deg/rev: F as it was written
    spindle_speed: float = 0.0  # rev/min
    path_mode: PathMode = PathMode.BLEND
    path_tolerance: float = NAN  # mm
    merge_tolerance: float = NAN  # mm
    selected_tool: int = 0
    loaded_tool: int = 0
    position: list[float] = field(default_factory=_zeros)
    tool_offset: list[float] = field(default_factory=_zeros)
    g92: list[float] = field(default_factory=_zeros)
    g92_active: bool = True
    offset: list[float] = field(default_factory=_zeros)  # of tool and G92 together

    def update_offset(self) -> None:
        """Sum the offsets that hold; the machine stays where it is."""
        active = self.g92 if self.g92_active else _zeros()
        self.offset = [tool + g92 for tool, g92 in zip(self.tool_offset, active, strict=True)]
