"""The fold over the lines of a program: each changes the modal state and may add a move.

Most lines of a long program are a straight move with nothing else on them. `take_plain_moves` takes those,
many at once, from the bytes; every other line takes the readable way through `read_block`, `settings` and
`motion`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import frozen
from cnc_shape.errors import ProgramError
from cnc_shape.program import Motion, Note, Program
from cnc_shape.readers.gcode import codes, printer
from cnc_shape.readers.gcode.blocks import Block, read_block
from cnc_shape.readers.gcode.dialects import Dialect, Survey
from cnc_shape.readers.gcode.lexer import BlockError, column_of, compact, diagnose, split_words
from cnc_shape.readers.gcode.modal import AXES, Modal
from cnc_shape.readers.gcode.motion import ARCS, dwell, move
from cnc_shape.readers.gcode.plain import take_plain_moves
from cnc_shape.readers.gcode.rows import Rows, to_program
from cnc_shape.readers.gcode.settings import apply_after, apply_before
from cnc_shape.readers.source import Bytes, Source, as_bytes, blocks, line_at, text_of
from cnc_shape.tools import Tool

_LEFT_OVER = frozenset("NFSTO")
LONGEST_WAIT = 64  # lines, before compiled code is tried again where it did not take any


@dataclass(frozen=True, slots=True)
class GcodeOptions:
    """How to read a program of G-code."""

    dialect: Dialect | None = None  # None: decided on evidence
    block_delete: bool = False  # lines that start with / are skipped
    tools: tuple[Tool, ...] = ()


class Interpreter:
    """A program being read: the modal state, and the rows that were not handed on yet."""

    def __init__(self, source: Source, survey: Survey, options: GcodeOptions) -> None:
        self.source = source.name
        self.limits = source.limits
        self.survey = survey
        self.dialect = survey.dialect
        self.options = options
        self.tools = {tool.number: tool for tool in options.tools}
        self.modal = Modal()
        self.rows = Rows()
        self.line = 0
        self.blocks = 0  # executed
        self.opened = self.ended = False  # by %, by M2 or a second %
        self.noted = set[str]()
        self.start = frozen(np.zeros(len(survey.axes)))

    def remark(self, key: str, message: str) -> None:
        """Note `message` at the present line, once per `key`."""
        if key not in self.noted:
            self.noted.add(key)
            self.rows.notes.append(Note(self.line, message))

    def hand_on(self) -> Program:
        """Return the rows so far as a chunk and begin the next."""
        chunk = to_program(self.rows, self.source, self.survey.axes, self.start)
        self.rows, self.start = Rows(), chunk.end
        return chunk

    def take_plain_lines(self, text: Bytes, at: int, rows: int) -> int:
        """Carry out plain lines of `text` from `at` on in the compiled way; return where it stopped."""
        limits = self.limits
        taken = take_plain_moves(
            text, at, self.line, self.modal, self.rows, self.dialect,
            most_rows=rows, blocks=limits.blocks - self.blocks, limits=limits,
        )  # fmt: skip
        self.line += taken.lines
        self.blocks += taken.blocks
        return taken.at

    def take_line(self, line: bytes) -> None:
        """Carry out the next line in the readable way.

        Raises
        ------
        ProgramError
            With the line and the column.
        """
        self.line += 1
        text = text_of(self.source, self.line, line, self.limits)
        try:
            self.execute(text)
        except BlockError as error:
            column = error.column if error.column is not None else column_of(text, error.letter)
            raise ProgramError(self.source, self.line, column or 1, error.reason, hint=error.hint) from None

    def execute(self, line: str) -> None:
        """Carry out the text of a line."""
        if self.dialect is Dialect.MARLIN and printer.is_ignored(line, self.remark):
            return
        text = compact(line)
        if text.startswith("%"):
            self._percent(text)
            return
        if text.startswith("/"):
            if self.options.block_delete:
                return
            text = text[1:]
        if self.dialect is Dialect.GRBL:
            if text.startswith("$"):
                self.remark("$", "lines that start with $ are grbl's settings: ignored")
                return
            text = text.translate({ord(char): None for char in "!~?"})
        elif self.dialect is Dialect.MARLIN:
            text = printer.without_checksum(text)
            if self._printer_moves(text):
                return
        if not text:
            return
        self.count()
        try:
            pairs = split_words(text)
        except BlockError:
            raise diagnose(line) from None
        self._carry_out(read_block(pairs, self.dialect))

    def count(self) -> None:
        """Count an executed block, up to the limit."""
        self.blocks += 1
        if self.blocks > self.limits.blocks:
            raise BlockError(
                f"more blocks were executed than the limit of {self.limits.blocks}",
                hint="raise the limit of the executed blocks, or split the program",
                column=1,
            )

    def _percent(self, text: str) -> None:
        if text != "%" and self.dialect is not Dialect.FANUC:
            raise BlockError("something follows the %", hint="% stands alone on its line", column=1)
        if self.blocks or self.opened:
            self.ended = True
        self.opened = True

    def _printer_moves(self, text: str) -> bool:
        modal = self.modal
        home = printer.home_axes(text)
        if home is not None:
            modal.position = [0.0 if axis in home else value for axis, value in enumerate(modal.position)]
            modal.g92 = [0.0 if axis in home else value for axis, value in enumerate(modal.g92)]
            modal.update_offset()
            self.rows.add(Motion.RAPID, self.line, modal)
            return True
        if printer.zeroes_all(text):
            modal.g92 = list(modal.position)
            modal.update_offset()
            return True
        return False

    def _carry_out(self, block: Block) -> None:
        modal, words, g = self.modal, block.words, block.g
        if "O" in words and (self.blocks > 1 or set(words) - {"N", "O"} or g or block.m):
            raise BlockError(
                "O-words (subroutines and loops) are not built yet", hint="unroll the program", letter="O"
            )
        _one_owner(block, modal)
        non_modal = g.get(codes.NON_MODAL)
        printer_dwell = non_modal == codes.DWELL and self.dialect is Dialect.MARLIN
        pause = dwell(block, self.dialect) if printer_dwell else 0.0  # its S is no spindle speed
        apply_before(block, modal, self.remark)
        if non_modal == codes.DWELL:
            pause = pause if printer_dwell else dwell(block, self.dialect)
            self.rows.add(Motion.DWELL, self.line, modal, dwell=pause)
        if non_modal == codes.SET_POSITION and self.dialect is Dialect.MARLIN:
            words.pop("E", None)  # counts filament
            if not set(AXES) & set(words):
                del g[codes.NON_MODAL]
        if non_modal == codes.SMOOTHNESS:
            words.pop("P", None)
            words.pop("E", None)
            self.remark("G187", "G187 is ignored: the path tolerance is the machine's")
        apply_after(block, modal, self.tools, self.remark)
        move(block, self.line, modal, self.rows, self.dialect, self.limits)
        left = set(words) - _LEFT_OVER
        if self.dialect is Dialect.MARLIN:
            left -= {"E"}
        if left:
            letter = min(left)
            raise BlockError(f"{letter} has no code that uses it", hint=f"take {letter} away", letter=letter)
        self.ended = self.ended or any(code in codes.PROGRAM_ENDS for code in block.m)

    def finish(self) -> None:
        """Note how the text ended, if not by M2, M30 or %."""
        if self.ended or self.dialect is Dialect.MARLIN:
            return
        if self.opened:
            self.remark("end", "no closing % and no M2 or M30: the program ends with the file")
        else:
            self.remark("end", "the program ends without M2 or M30")


def _one_owner(block: Block, modal: Modal) -> None:
    """Refuse words that two codes of the line would claim."""
    g = block.g
    non_modal, named = g.get(codes.NON_MODAL), g.get(codes.MOTION_GROUP)
    dynamic = (
        g.get("tool length") in (codes.TOOL_LENGTH_DYNAMIC, codes.TOOL_LENGTH_ADD) and "H" not in block.words
    )
    claims_axes = [
        codes.name_of(code)
        for code, claims in (
            (non_modal, non_modal == codes.SET_POSITION),
            (g.get("tool length"), dynamic),
            (named, named is not None and named != codes.CANCEL_MOTION),
        )
        if claims and code is not None
    ]
    axes = [letter for letter in AXES if letter in block.words]
    if axes and len(claims_axes) > 1:
        raise BlockError(
            f"{claims_axes[0]} and {claims_axes[1]} both use the axis words", hint="two lines", letter=axes[0]
        )
    if axes and named == codes.CANCEL_MOTION and not claims_axes:
        raise BlockError(
            "G80 takes no axis words", hint="name a motion code on the next line", letter=axes[0]
        )
    arc = (named if named is not None else modal.motion) in ARCS and bool(
        axes or named is not None or set("IJKR") & set(block.words)
    )
    claims_p = [non_modal == codes.DWELL, g.get("path") == codes.BLEND, arc and not claims_axes[:-1]]
    if "P" in block.words and sum(claims_p) > 1:
        raise BlockError("two codes use the P of this line", hint="write two lines", letter="P")


def interpret(
    source: Source, survey: Survey, options: GcodeOptions, *, rows: int, compiled_from: int
) -> Iterator[Program]:
    """Yield the program in chunks of at least `rows` rows; the last holds the rest.

    In a text of `compiled_from` bytes or more plain lines take the compiled way; the answer is the same.

    Raises
    ------
    ProgramError
        At the first thing that is wrong, with its line and column.
    """
    machine = Interpreter(source, survey, options)
    compiled = source.size >= compiled_from
    readable, wait = 0, 1  # lines to go before compiled code is tried again, and after how many the next time
    for block in blocks(source):
        text = as_bytes(block)
        at = 0
        while at < len(block):
            if compiled and readable == 0:
                stop = machine.take_plain_lines(text, at, rows)
                wait = 1 if stop > at else min(2 * wait, LONGEST_WAIT)
                at, readable = stop, wait
            readable -= 1
            if at < len(block) and len(machine.rows) < rows:
                line = line_at(block, at)
                machine.take_line(line)
                at += len(line) + 1
            if machine.ended:
                break
            if len(machine.rows) >= rows:
                yield machine.hand_on()
        if machine.ended:
            break
    machine.finish()
    yield machine.hand_on()
