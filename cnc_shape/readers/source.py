"""Text at the door: a file or standard input as numbered lines, within named limits."""

from __future__ import annotations

import io
import sys
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cnc_shape.errors import ProgramError

BLOCK_BYTES = 1 << 20  # read at once
CHUNK_ROWS = 4096  # moves that are handed on together
COMPILED_FROM = 1 << 16  # bytes: reading a shorter text takes less time than loading compiled code
STANDARD_INPUT = "-"
UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")
UTF8_MARK = b"\xef\xbb\xbf"

Bytes: TypeAlias = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class ReadingLimits:
    """How much a reader takes before it refuses, each limit named in its message."""

    file_bytes: int = 256 << 20
    line_bytes: int = 64 << 10
    coordinate: float = 1e6  # mm, and degrees for rotary axes
    blocks: int = 20_000_000  # executed
    turns: int = 10_000  # of one arc
    samples: int = 50_000_000  # of a resampled time trajectory


@dataclass(frozen=True, slots=True)
class Source:
    """An open text that can be read more than once.

    Errors name `name`; `stream` is seekable and belongs to `open_source`.
    """

    name: str
    stream: BinaryIO
    limits: ReadingLimits
    size: int  # bytes


@contextmanager
def open_source(path: str | Path, limits: ReadingLimits) -> Generator[Source]:
    """Open `path` (``-``: standard input) for reading, and refuse what is no text file.

    Raises
    ------
    ProgramError
        No such file, a folder, no permission, empty, UTF-16, or beyond ``limits.file_bytes``.
    """
    name = "<stdin>" if str(path) == STANDARD_INPUT else str(path)
    with _faults(name):
        handle = sys.stdin.buffer if str(path) == STANDARD_INPUT else open(path, "rb")  # noqa: SIM115
    try:
        with _faults(name):
            stream = _seekable(name, handle, limits)
        yield Source(name, stream, limits, stream.seek(0, io.SEEK_END))
    finally:
        if handle is not sys.stdin.buffer:
            handle.close()


@contextmanager
def _faults(name: str) -> Generator[None]:
    try:
        yield
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        detail = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        reason = f"cannot read: {detail.lower()}"
        raise ProgramError(name, None, None, reason, hint="check the file's name") from error


def _read(source: Source, size: int) -> bytes:
    with _faults(source.name):
        return source.stream.read(size)


def _seekable(name: str, handle: BinaryIO, limits: ReadingLimits) -> BinaryIO:
    stream = handle if handle.seekable() else io.BytesIO(handle.read(limits.file_bytes + 1))
    size = stream.seek(0, io.SEEK_END)
    stream.seek(0)
    if size == 0:
        raise ProgramError(name, None, None, "the file is empty", hint="give a file with at least one line")
    if size > limits.file_bytes:
        raise ProgramError(
            name,
            None,
            None,
            f"the file holds more than the limit of {limits.file_bytes} bytes",
            hint="raise the limit of the file size, or split the program",
        )
    if stream.read(2) in UTF16_MARKS:
        raise ProgramError(name, 1, 1, "the file is UTF-16 text", hint="save it as UTF-8 or plain ASCII")
    stream.seek(0)
    return stream


def blocks(source: Source) -> Iterator[bytes]:
    r"""Yield the text in pieces that end at line ends, every line end turned into ``\n``."""
    source.stream.seek(0)
    rest = b""
    first = True
    while piece := _read(source, BLOCK_BYTES):
        while piece.endswith(b"\r") and (more := _read(source, 1)):
            piece += more  # never part CR from LF
        if first:
            piece, first = piece.removeprefix(UTF8_MARK), False
        if b"\r" in piece:
            piece = piece.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        whole, end, tail = piece.rpartition(b"\n")
        if end:
            yield rest + whole + end
            rest = tail
        elif len(rest) > source.limits.line_bytes:
            yield rest + tail  # one endless line: `lines` refuses it
            rest = b""
        else:
            rest += tail
    if rest:
        yield rest


def as_bytes(text: bytes) -> Bytes:
    """View text as an array."""
    return np.frombuffer(text, dtype=np.uint8)


def line_at(block: bytes, at: int) -> bytes:
    """Return the line that begins at `at`, without its end."""
    end = block.find(b"\n", at)
    return block[at : end if end >= 0 else len(block)]


def count_lines(block: bytes) -> int:
    """Count the lines of a block: the last may lack its end."""
    return block.count(b"\n") + (not block.endswith(b"\n"))


def lines(source: Source) -> Iterator[tuple[int, str]]:
    """Yield ``(number, text)`` of every line from 1; text without its line end.

    Raises
    ------
    ProgramError
        At a NUL byte, and at a line beyond ``limits.line_bytes``.
    """
    number = 0
    for block in blocks(source):
        for line in block.removesuffix(b"\n").split(b"\n"):
            number += 1
            yield number, text_of(source.name, number, line, source.limits)


def text_of(name: str, number: int, line: bytes, limits: ReadingLimits) -> str:
    """Return line `number` of the text called `name`, without its line end, as text.

    Raises
    ------
    ProgramError
        At a NUL byte, and where the line is longer than ``limits.line_bytes``.
    """
    if len(line) > limits.line_bytes:
        raise ProgramError(
            name,
            number,
            limits.line_bytes + 1,
            f"the line is longer than the limit of {limits.line_bytes} bytes",
            hint="raise the limit of the line length, if this is a program at all",
        )
    if b"\0" in line:
        column = len(line[: line.index(b"\0")].decode("utf-8", "replace")) + 1
        raise ProgramError(
            name, number, column, "NUL byte in the text", hint="this is a binary or damaged file"
        )
    return line.decode("utf-8", "replace")
