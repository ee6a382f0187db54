"""Programs for tests: text in, `Program` out, and what two programs have in common."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from cnc_shape.errors import ProgramError
from cnc_shape.program import Program, concatenate
from cnc_shape.readers import ReadingOptions, read_program
from cnc_shape.readers.gcode import GcodeOptions, interpret, survey
from cnc_shape.readers.source import ReadingLimits, Source

DEFAULT = GcodeOptions()
AS_USUAL = ReadingOptions()
COLUMNS = [name for name in Program.__slots__ if name not in ("source", "axes", "notes")]


def from_memory(text: str | bytes, limits: ReadingLimits = AS_USUAL.limits, name: str = "part.nc") -> Source:
    """Text as a source."""
    data = text.encode() if isinstance(text, str) else text
    return Source(name, io.BytesIO(data), limits, len(data))


def chunks(
    text: str | bytes, options: GcodeOptions = DEFAULT, *, how: ReadingOptions = AS_USUAL
) -> list[Program]:
    """Read G-code from memory, as chunks."""
    source = from_memory(text, how.limits)
    seen = survey(source, options.dialect)
    return list(interpret(source, seen, options, rows=how.rows, compiled_from=how.compiled_from))


def read(text: str | bytes, options: GcodeOptions = DEFAULT, *, how: ReadingOptions = AS_USUAL) -> Program:
    """Read G-code from memory."""
    return concatenate(chunks(text, options, how=how))


def attempt(
    text: str | bytes, options: GcodeOptions = DEFAULT, *, how: ReadingOptions = AS_USUAL
) -> Program | ProgramError:
    """Read G-code from memory; a refusal is an answer too."""
    try:
        return read(text, options, how=how)
    except ProgramError as error:
        return error


def attempt_file(path: Path, options: ReadingOptions | None = None) -> Program | ProgramError:
    """Read a file; a refusal is an answer too."""
    try:
        return read_program(path, options)
    except ProgramError as error:
        return error


def assert_same(one: Program, other: Program, *, but: tuple[str, ...] = ()) -> None:
    """Every column has the same bits."""
    assert one.axes == other.axes
    for name in COLUMNS:
        if name not in but:
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


def messages(program: Program) -> list[str]:
    """The warnings' texts."""
    return [note.message for note in program.notes]
