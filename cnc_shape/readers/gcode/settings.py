"""All that a block changes without moving: feed, speed, tool, units, offsets, modes.

The order inside a block is fixed, whatever the order of its words; `apply_before` and `apply_after` hold
what comes before and after the dwell.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from cnc_shape.program import PathMode
from cnc_shape.readers.gcode import codes
from cnc_shape.readers.gcode.arcs import PLANES
from cnc_shape.readers.gcode.blocks import Block
from cnc_shape.readers.gcode.lexer import BlockError
from cnc_shape.readers.gcode.modal import AXES, NAN, Modal
from cnc_shape.tools import Tool
from cnc_shape.units import MM_PER_INCH

SLOWEST = 1e-6  # smallest F; below it a move would outlast the machine
Remark = Callable[[str, str], None]  # key, message: noted once per key

_PATH_MODES = {
    codes.EXACT_PATH: PathMode.EXACT_PATH,
    codes.EXACT_STOP: PathMode.EXACT_STOP,
    codes.BLEND: PathMode.BLEND,
}


def whole(block: Block, letter: str) -> int:
    """Return the non-negative whole number of a word that is there."""
    value = block.words[letter]
    if value < 0.0 or value != int(value):
        raise BlockError(f"{letter} {value:g} is not a whole number", hint="give 0, 1, 2, …", letter=letter)
    return int(value)


def apply_before(block: Block, modal: Modal, remark: Remark) -> None:
    """Feed mode, F, S, T, M6 and the M codes that leave the path alone."""
    mode = block.g.get("feed mode", modal.feed_mode)
    if mode != modal.feed_mode:
        modal.feed_mode, modal.feed, modal.feed_angular = mode, 0.0, 0.0
    words = block.words
    if "F" in words:
        feed = words["F"]
        if feed < 0.0:
            raise BlockError(f"F {feed:g} is negative", hint="give a positive feed", letter="F")
        if 0.0 < feed < SLOWEST:
            raise BlockError(
                f"F {feed:g} is below the limit of {SLOWEST:g}", hint="check the feed", letter="F"
            )
        modal.feed = feed if mode == codes.INVERSE_TIME else feed * modal.millimetres
        modal.feed_angular = feed
    if "S" in words:
        if words["S"] < 0.0:
            raise BlockError(f"S {words['S']:g} is negative", hint="M4 turns the other way", letter="S")
        modal.spindle_speed = words["S"]
    if "T" in words:
        modal.selected_tool = whole(block, "T")
    if codes.CHANGE_TOOL in block.m:
        modal.loaded_tool = modal.selected_tool
    for code in block.m:
        _machine_code(code, block, modal, remark)


def _machine_code(code: int, block: Block, modal: Modal, remark: Remark) -> None:
    if code == codes.SET_TOOL:
        if "Q" not in block.words:
            raise BlockError("M61 needs Q, the number of the tool", hint="write M61 Q1", letter="M61")
        modal.loaded_tool = whole(block, "Q")
        del block.words["Q"]
    elif code not in (codes.CHANGE_TOOL, *codes.PROGRAM_ENDS):
        purpose = codes.IGNORED.get(code, "machine functions")
        remark(purpose, f"M{code}: {purpose} are ignored")
        for letter in codes.M_WORDS.get(code, ""):
            block.words.pop(letter, None)


def apply_after(block: Block, modal: Modal, tools: Mapping[int, Tool], remark: Remark) -> None:
    """Plane, units, tool length, path mode, distance modes, G92: in this order."""
    g = block.g
    modal.plane = g.get("plane", modal.plane)
    if "units" in g:
        modal.millimetres = MM_PER_INCH if g["units"] == codes.INCH else 1.0
    if "lathe" in g:
        modal.diameter = g["lathe"] == codes.DIAMETER
    if "tool length" in g:
        _tool_length(g["tool length"], block, modal, tools, remark)
    if "path" in g:
        _path_mode(g["path"], block, modal)
    if "distance" in g:
        modal.absolute = g["distance"] == codes.ABSOLUTE
    if "arc centre" in g:
        modal.arc_absolute = g["arc centre"] == codes.ARC_ABSOLUTE
    if g.get(codes.NON_MODAL, 0) // 10 == codes.SET_POSITION // 10:
        _position_offset(g[codes.NON_MODAL], block, modal)


def _tool_length(code: int, block: Block, modal: Modal, tools: Mapping[int, Tool], remark: Remark) -> None:
    offset = (
        [0.0] * len(AXES) if code in (codes.TOOL_LENGTH, codes.TOOL_LENGTH_OFF) else list(modal.tool_offset)
    )
    if code == codes.TOOL_LENGTH or (code == codes.TOOL_LENGTH_ADD and "H" in block.words):
        number = whole(block, "H") if "H" in block.words else modal.loaded_tool
        block.words.pop("H", None)
        if number and number not in tools:
            remark(
                f"tool {number}",
                f"tool {number} is not in the tool table: its length and diameter are taken as 0",
            )
        offset[2] += tools[number].length if number in tools else 0.0
    elif code in (codes.TOOL_LENGTH_DYNAMIC, codes.TOOL_LENGTH_ADD):
        given = take_axes(block, modal)
        if not given:
            name = codes.name_of(code)
            raise BlockError(f"{name} needs an axis word", hint=f"write {name} Z1.5", letter=name)
        for axis, value in given.items():
            offset[axis] = value + (offset[axis] if code == codes.TOOL_LENGTH_ADD else 0.0)
    modal.tool_offset = offset
    modal.update_offset()


def _path_mode(code: int, block: Block, modal: Modal) -> None:
    modal.path_mode = _PATH_MODES[code]
    tolerances = {"P": NAN, "Q": NAN}
    for letter in tolerances:
        if code == codes.BLEND and letter in block.words:
            value = block.words.pop(letter) * modal.millimetres
            if value < 0.0:
                raise BlockError(f"{letter} of G64 is negative", hint="give a tolerance", letter=letter)
            tolerances[letter] = value
    modal.path_tolerance, modal.merge_tolerance = tolerances["P"], tolerances["Q"]


def _position_offset(code: int, block: Block, modal: Modal) -> None:
    if code == codes.SET_POSITION:
        given = take_axes(block, modal)
        if not given:
            raise BlockError("G92 needs an axis word", hint="write G92 X0", letter="G92")
        if not modal.g92_active:
            modal.g92 = [0.0] * len(AXES)  # what G92.2 suspended ends here: the other axes have no offset
        for axis, value in given.items():
            modal.g92[axis] = modal.position[axis] - modal.tool_offset[axis] - value
    elif code == codes.CLEAR_POSITION:
        modal.g92 = [0.0] * len(AXES)
    modal.g92_active = code != codes.SUSPEND_POSITION
    modal.update_offset()


def take_axes(block: Block, modal: Modal) -> dict[int, float]:
    """Take the axis words out of the block: index of the axis, value in mm or degrees."""
    given: dict[int, float] = {}
    for axis, letter in enumerate(AXES):
        if letter in block.words:
            value = block.words.pop(letter)
            if axis < len(PLANES):
                value *= modal.millimetres
            given[axis] = 0.5 * value if axis == 0 and modal.diameter else value
    return given
