"""What moves: straight moves, arcs and dwells become rows."""

from __future__ import annotations

from cnc_shape.program import Motion
from cnc_shape.readers.gcode import codes
from cnc_shape.readers.gcode.arcs import (
    NORMALS,
    OFFSET_LETTERS,
    PLANES,
    SPIRAL_TOLERANCE,
    SPIRAL_TOLERANCE_INCH,
    Arc,
    arc_by_center,
    arc_by_radius,
)
from cnc_shape.readers.gcode.blocks import Block
from cnc_shape.readers.gcode.dialects import Dialect
from cnc_shape.readers.gcode.lexer import BlockError
from cnc_shape.readers.gcode.modal import AXES, Modal
from cnc_shape.readers.gcode.rows import AS_FAST_AS_THE_AXES_CAN, Feed, Rows
from cnc_shape.readers.gcode.settings import take_axes, whole
from cnc_shape.readers.source import ReadingLimits
from cnc_shape.units import MILLISECOND, PER_MIN

_ARC_WORDS = "IJKR"
_ZERO_NORMAL = (Dialect.GRBL, Dialect.MARLIN)  # take a centre offset of 0 along the plane's normal
ARCS = (codes.ARC_CW, codes.ARC_CCW)


def dwell(block: Block, dialect: Dialect) -> float:
    """Take the time of G4 out of the block, s: P in seconds; printers: P in ms and S in seconds."""
    if dialect is Dialect.MARLIN:
        milliseconds = block.words.pop("P", 0.0)
        time = block.words.pop("S", milliseconds * MILLISECOND)
    elif "P" not in block.words:
        raise BlockError("G4 needs P, the time in seconds", hint="write G4 P0.5", letter="G4")
    else:
        time = block.words.pop("P")
    if time < 0.0:
        raise BlockError(f"the dwell of {time:g} s is negative", hint="give a positive time", letter="P")
    return time


def move(block: Block, line: int, modal: Modal, rows: Rows, dialect: Dialect, limits: ReadingLimits) -> None:
    """Carry out the motion of a block: the code it names, or the one before."""
    named = block.g.get(codes.MOTION_GROUP)
    if named == codes.CANCEL_MOTION:
        modal.motion = None
    elif named is not None:
        modal.motion = named
    motion = modal.motion
    frame = block.g.get(codes.NON_MODAL) == codes.MACHINE_FRAME
    given = take_axes(block, modal)
    extrudes = dialect is Dialect.MARLIN and "E" in block.words
    turns = motion in ARCS and (named is not None or any(letter in block.words for letter in _ARC_WORDS))
    if not given and not extrudes and not turns:
        if frame:
            raise BlockError("G53 needs G0 or G1 and an axis word", hint="write G53 G0 Z0", letter="G53")
        return
    if motion is None:
        raise BlockError(
            "axis words without a motion code",
            hint="write G0, G1, G2 or G3 first",
            letter=AXES[next(iter(given), 0)],
        )
    if frame and (motion in ARCS or not modal.absolute):
        raise BlockError("G53 takes G0 or G1 under G90 only", hint="write G90 G53 G0 …", letter="G53")
    start = modal.position
    end = _targets(given, modal, frame, limits)
    if motion in ARCS:
        _arc(block, line, start, end, modal, rows, dialect, limits)
        return
    modal.position = end
    kind = Motion.RAPID if motion == codes.RAPID else Motion.FEED
    rows.add(kind, line, modal, feed=_feed(block, modal, kind, dialect))


def _targets(
    given: dict[int, float], modal: Modal, machine_frame: bool, limits: ReadingLimits
) -> list[float]:
    end = list(modal.position)
    for axis, value in given.items():
        if not modal.absolute:
            end[axis] += value
        else:
            end[axis] = value if machine_frame else value + modal.offset[axis]
        check_coordinate(end[axis], AXES[axis], limits)
    return end


def check_coordinate(value: float, letter: str, limits: ReadingLimits) -> None:
    """Refuse a coordinate, centre or radius beyond the limit."""
    if not -limits.coordinate <= value <= limits.coordinate:
        unit = "mm" if letter not in "ABC" else "degrees"
        raise BlockError(
            f"{letter} reaches {value:.6g} {unit}, beyond the limit of {limits.coordinate:g} {unit}",
            hint="check the number and the units (G20, G21)",
            letter=letter,
        )


def _feed(block: Block, modal: Modal, kind: Motion, dialect: Dialect) -> Feed:
    mode = modal.feed_mode
    if kind is Motion.RAPID:
        if dialect is Dialect.MARLIN and modal.feed > 0.0:
            return Feed(modal.feed * PER_MIN, modal.feed_angular * PER_MIN)
        return AS_FAST_AS_THE_AXES_CAN
    name = "G1" if kind is Motion.FEED else "an arc"
    if mode == codes.INVERSE_TIME:
        if block.words.get("F", 0.0) == 0.0:
            raise BlockError(
                f"{name} under G93 needs its own F", hint="F is 1 / minutes of the move", letter="G1"
            )
        return Feed(modal.feed * PER_MIN, modal.feed * PER_MIN, per_move=True)
    if modal.feed == 0.0:
        raise BlockError(f"{name} without a feed", hint="give F before it or with it", letter="G1")
    if mode == codes.PER_REVOLUTION:
        if modal.spindle_speed == 0.0:
            raise BlockError(
                "feed per revolution (G95) with the spindle speed 0: no motion", hint="give S", letter="G1"
            )
        per_second = modal.spindle_speed * PER_MIN
        return Feed(modal.feed * per_second, modal.feed_angular * per_second)
    return Feed(modal.feed * PER_MIN, modal.feed_angular * PER_MIN)


def _arc(
    block: Block,
    line: int,
    start: list[float],
    end: list[float],
    modal: Modal,
    rows: Rows,
    dialect: Dialect,
    limits: ReadingLimits,
) -> None:
    first, second, normal = PLANES[modal.plane]
    geometry = _arc_geometry(
        block, (start[first], start[second]), (end[first], end[second]), modal, dialect, limits
    )
    center = [0.0, 0.0, 0.0]
    center[first], center[second], center[normal] = *geometry.center, start[normal]
    modal.position = end
    feed = _feed(block, modal, Motion.ARC, dialect)
    rows.add_arc(line, modal, feed, (center[0], center[1], center[2]), NORMALS[modal.plane], geometry.sweep)


def _arc_geometry(
    block: Block,
    start: tuple[float, float],
    end: tuple[float, float],
    modal: Modal,
    dialect: Dialect,
    limits: ReadingLimits,
) -> Arc:
    words = block.words
    name = codes.name_of(modal.motion or 0)
    direction = 1.0 if modal.motion == codes.ARC_CCW else -1.0
    turns = whole(block, "P") if "P" in words else 1
    words.pop("P", None)
    if not 1 <= turns <= limits.turns:
        raise BlockError(
            f"P {turns} turns: from 1 to the limit of {limits.turns}", hint="check P", letter="P"
        )
    letter_first, letter_second, letter_normal = OFFSET_LETTERS[modal.plane]
    if letter_normal in words and (dialect not in _ZERO_NORMAL or words[letter_normal] != 0.0):
        raise BlockError(
            f"{letter_normal} in the plane of {codes.name_of(modal.plane)}",
            hint=f"give {letter_first} and {letter_second}, or choose the plane with G17, G18 or G19",
            letter=letter_normal,
        )
    words.pop(letter_normal, None)
    by_center = letter_first in words or letter_second in words
    if "R" in words:
        if by_center:
            raise BlockError(f"{name} with both R and a centre", hint="keep one of them", letter="R")
        radius = words.pop("R") * modal.millimetres
        check_coordinate(radius, "R", limits)
        return arc_by_radius(start, end, radius, direction, turns)
    if not by_center:
        raise BlockError(
            f"{name} needs R or {letter_first}/{letter_second}",
            hint=f"give R, or {letter_first} and {letter_second}",
            letter=name,
        )
    center: list[float] = []
    axes = PLANES[modal.plane]
    for letter, axis, place in ((letter_first, axes[0], start[0]), (letter_second, axes[1], start[1])):
        if letter not in words and modal.arc_absolute:
            raise BlockError(
                f"{name} under G90.1 needs {letter_first} and {letter_second}",
                hint=f"give {letter}",
                letter=name,
            )
        value = words.pop(letter, 0.0) * modal.millimetres
        center.append(value + (modal.offset[axis] if modal.arc_absolute else place))
        check_coordinate(center[-1], letter, limits)
    inch = modal.millimetres != 1.0
    tolerance = SPIRAL_TOLERANCE_INCH if inch else SPIRAL_TOLERANCE
    return arc_by_center(start, end, (center[0], center[1]), direction, turns, tolerance)
