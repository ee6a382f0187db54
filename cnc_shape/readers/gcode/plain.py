"""The compiled way for plain lines: most lines of a long program are a straight move and nothing else.

The bytes go to the kernel `plain_moves`, which stops at the first line that is more than that; it changes
what the readable way would change. Tests hold the two ways equal.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from cnc_shape.readers.gcode.blocks import LARGEST
from cnc_shape.readers.gcode.codes import FEED, INVERSE_TIME, PER_REVOLUTION, RAPID
from cnc_shape.readers.gcode.dialects import Dialect
from cnc_shape.readers.gcode.modal import AXES, Modal
from cnc_shape.readers.gcode.rows import Rows
from cnc_shape.readers.gcode.settings import SLOWEST
from cnc_shape.readers.source import Bytes, ReadingLimits
from cnc_shape.units import PER_MIN

_WORDS = AXES + "GFSEN"  # in the kernel's order


class Modes(NamedTuple):
    """What holds for a stretch of plain lines."""

    absolute: bool
    per_move: bool  # F is moves per minute
    printer: bool  # E words are filament, and G0 runs at its F
    millimetres: float  # per programmed length unit
    per_second: float  # of what is programmed per minute
    coordinate: float  # limit of the coordinates, mm and degrees
    slowest: float  # smallest F
    largest: float  # limit of all numbers
    line_bytes: int
    path_mode: int
    path_tolerance: float  # mm
    merge_tolerance: float  # mm


class Taken(NamedTuple):
    """How far the compiled way came."""

    at: int  # first byte of the line that was not taken
    lines: int
    blocks: int  # lines with words


@cache
def _roles() -> Bytes:
    """What each byte is to the kernel, (256,)."""
    from cnc_shape.kernels import plain_moves as kernel

    roles = np.full(256, kernel.FOREIGN, dtype=np.uint8)
    roles[[ord(" "), ord("\t")]] = kernel.BLANK
    roles[ord(";")], roles[ord("(")] = kernel.REMARK, kernel.OPENING
    for word, letter in enumerate(_WORDS):
        roles[[ord(letter), ord(letter.lower())]] = kernel.FIRST_WORD + word
    return roles


def take_plain_moves(
    text: Bytes,
    at: int,
    line: int,
    modal: Modal,
    rows: Rows,
    dialect: Dialect,
    *,
    most_rows: int,
    blocks: int,
    limits: ReadingLimits,
) -> Taken:
    """Take the plain lines that come next; stop at the first that is not, or when there is no more room.

    Parameters
    ----------
    text, at
        Whole lines of the program, and where to begin.
    line
        Lines before `at`.
    modal, rows
        Updated.
    dialect
        Whose rules hold.
    most_rows
        That `rows` shall hold.
    blocks
        The most lines with words.
    limits
        Of coordinates and line length.
    """
    if modal.feed_mode == PER_REVOLUTION or modal.diameter:
        return Taken(at, 0, 0)
    from cnc_shape.kernels import plain_moves as kernel

    motions = {None: kernel.NO_MOTION, RAPID: kernel.RAPID, FEED: kernel.STRAIGHT}
    registers = np.array(
        [motions.get(modal.motion, kernel.CURVED), modal.feed, modal.feed_angular, modal.spindle_speed]
    )
    position = np.array(modal.position)
    modes = Modes(
        absolute=modal.absolute,
        per_move=modal.feed_mode == INVERSE_TIME,
        printer=dialect is Dialect.MARLIN,
        millimetres=modal.millimetres,
        per_second=PER_MIN,
        coordinate=float(limits.coordinate),
        slowest=SLOWEST,
        largest=LARGEST,
        line_bytes=limits.line_bytes,
        path_mode=int(modal.path_mode),
        path_tolerance=modal.path_tolerance,
        merge_tolerance=modal.merge_tolerance,
    )
    room = min(most_rows, rows.make_room())
    end, lines, rows.count, executed = kernel.plain_moves(
        text, at, line, _roles(), modes, registers, position, np.array(modal.offset), rows.columns,
        rows.count, room, blocks,
    )  # fmt: skip
    if lines:
        motion, modal.feed, modal.feed_angular, modal.spindle_speed = registers.tolist()
        modal.position = position.tolist()
        if motion != kernel.CURVED:
            modal.motion = {kernel.NO_MOTION: None, kernel.RAPID: RAPID, kernel.STRAIGHT: FEED}[motion]
    return Taken(end, lines, executed)
