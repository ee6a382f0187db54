"""A CSV table of numbers: a header that names columns with units, then rows, each checked at its place."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.errors import ProgramError
from cnc_shape.program import ROTARY, XYZ
from cnc_shape.readers.source import Bytes, ReadingLimits, Source, as_bytes, blocks, line_at, lines, text_of
from cnc_shape.units import DEGREE, MM_PER_INCH, MM_PER_MIN

_LENGTHS = {"mm": 1.0, "um": 1e-3, "cm": 10.0, "m": 1e3, "in": MM_PER_INCH}
_ANGLES = {"deg": DEGREE, "rad": 1.0}
_TIMES = {"time_s": 1.0, "time_ms": 1e-3}
_FEEDS = {"feed_mm_min": MM_PER_MIN, "feed_mm_s": 1.0, "feed_in_min": MM_PER_INCH * MM_PER_MIN}
TIME, FEED = "time", "feed"
COLUMNS: dict[str, tuple[str, float]] = {  # header: what it is, factor to mm, rad, s, mm/s
    **{f"{axis}_{unit}": (axis, scale) for axis in XYZ for unit, scale in _LENGTHS.items()},
    **{f"{axis}_{unit}": (axis, scale) for axis in ROTARY for unit, scale in _ANGLES.items()},
    **{name: (TIME, scale) for name, scale in _TIMES.items()},
    **{name: (FEED, scale) for name, scale in _FEEDS.items()},
}
_CELL = r"[ \t]*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]{1,4})?)[ \t]*"


@dataclass(frozen=True, slots=True)
class Header:
    """The columns of a table, by what they are, and what to multiply them by."""

    names: tuple[str, ...]  # x, y, z, a, b, c, time or feed
    scales: tuple[float, ...]

    @property
    def axes(self) -> tuple[str, ...]:
        """Axes x, y, z always, then the rotary ones of the table."""
        return XYZ + tuple(axis for axis in ROTARY if axis in self.names)


def is_table(line: str) -> bool:
    """Whether the first line of a text is the header of a table of positions."""
    cells = [cell.strip().lower() for cell in line.split(",")]
    return len(cells) > 1 and any(re.fullmatch(r"[a-z]+_[a-z_]+", cell) for cell in cells)


def read_header(source: Source) -> Header:
    """Read the first line that is not blank.

    Raises
    ------
    ProgramError
        An unknown or a repeated column, or no axis.
    """
    number, line = next(((number, line) for number, line in lines(source) if line.strip()), (1, ""))
    return parse_header(source.name, number, line)


def parse_header(source: str, number: int, line: str) -> Header:
    """Read the header of the table called `source`.

    Raises
    ------
    ProgramError
        An unknown or a repeated column, or no axis.
    """
    names: list[str] = []
    scales: list[float] = []
    column = 1
    for cell in line.split(","):
        text = cell.strip()
        at = column + len(cell) - len(cell.lstrip())
        column += len(cell) + 1
        known = COLUMNS.get(text.lower())
        if known is None:
            close = get_close_matches(text.lower(), COLUMNS, 1, 0.6)
            raise ProgramError(
                source,
                number,
                at,
                f"unknown column {text!a}",
                hint=f"did you mean {close[0]}?"
                if close
                else "columns are named x_mm, y_mm, a_deg, feed_mm_min, time_s",
            )
        if known[0] in names:
            raise ProgramError(source, number, at, f"a second column for {known[0]}", hint="keep one of them")
        names.append(known[0])
        scales.append(known[1])
    if not set(names) & {*XYZ, *ROTARY}:
        raise ProgramError(source, number, 1, "no column is an axis", hint="name a column x_mm")
    return Header(tuple(names), tuple(scales))


@dataclass(frozen=True, eq=False, slots=True)
class Rows:
    """Consecutive rows of a table."""

    line: IntArray  # (m,)
    values: FloatArray  # (m,c) mm, rad, s and mm/s

    def cut(self, rows: slice) -> Rows:
        """Return some of the rows."""
        return Rows(self.line[rows], self.values[rows])


def join_rows(parts: Sequence[Rows]) -> Rows:
    """Consecutive rows, at least one part, as one."""
    return Rows(
        frozen_integers(np.concatenate([part.line for part in parts])),
        frozen(np.concatenate([part.values for part in parts])),
    )


def read_rows(source: Source, header: Header, *, rows: int, compiled_from: int) -> Iterator[Rows]:
    """Yield the rows of a table, at most `rows` at a time; blank lines are skipped.

    In a text of `compiled_from` bytes or more plain rows take the compiled way; the answer is the same.

    Raises
    ------
    ProgramError
        A ragged row, text, an infinite or a huge number; once the rows before it have been handed on.
    """
    readable = RowReader(source.name, source.limits, header)
    compiled = source.size >= compiled_from
    rows = min(rows, source.size)  # there cannot be more
    values, line = np.empty((rows, len(header.names))), np.empty(rows, dtype=np.int64)
    count = number = 0
    ahead = True  # the header is still to come

    def handed_on() -> Rows:
        return Rows(frozen_integers(line[:count].copy()), frozen(values[:count].copy()))

    for block in blocks(source):
        text = as_bytes(block)
        at = 0
        while at < len(block):
            if compiled and not ahead:
                at, taken, count = _take_plain_rows(text, at, number, readable, values, line, count)
                number += taken
            if at < len(block) and count < rows:
                here = line_at(block, at)
                at += len(here) + 1
                number += 1
                try:
                    row = readable.row(number, here, ahead=ahead)
                except ProgramError:
                    if count:
                        yield handed_on()
                    raise
                if row is not None:
                    values[count], line[count] = row, number
                    count += 1
                ahead = ahead and not here.strip()
            if count == rows:
                yield handed_on()
                count = 0
    if count:
        yield handed_on()


def _take_plain_rows(
    text: Bytes, at: int, number: int, reader: RowReader, values: FloatArray, line: IntArray, count: int
) -> tuple[int, int, int]:
    from cnc_shape.kernels.plain_rows import plain_rows  # a short table need not load compiled code

    return plain_rows(text, at, number, reader.line_bytes, reader.scales, reader.bounds, values, line, count)


class RowReader:
    """The readable way: one line at a time."""

    def __init__(self, name: str, limits: ReadingLimits, header: Header) -> None:
        self._name, self._limits, self._header = name, limits, header
        self._pattern = re.compile(",".join([_CELL] * len(header.names)))
        self.line_bytes = limits.line_bytes
        self.scales: FloatArray = np.array(header.scales)
        self.bounds: FloatArray = np.array(
            [
                limits.coordinate * (DEGREE if name in ROTARY else 1.0) if name in (*XYZ, *ROTARY) else 1e12
                for name in header.names
            ]
        )

    def row(self, number: int, line: bytes, *, ahead: bool) -> FloatArray | None:
        """Return the values of a line, None if it is blank or the header."""
        text = text_of(self._name, number, line, self._limits)
        if ahead or not text.strip():
            return None
        return self.values(number, self.cells(number, text))

    def cells(self, number: int, text: str) -> re.Match[str]:
        """Return the numbers of a line that is not blank, as they are written, each a group."""
        match = self._pattern.fullmatch(text)
        if match is None:
            raise _diagnose(self._name, number, text, self._header)
        return match

    def values(self, number: int, cells: re.Match[str]) -> FloatArray:
        """Return what the cells of a line say, in mm, rad, s and mm/s."""
        values = np.array([float(cell) for cell in cells.groups()]) * self.scales
        beyond = np.flatnonzero(~(np.abs(values) <= self.bounds))
        if beyond.size:
            place = int(beyond[0])
            raise ProgramError(
                self._name,
                number,
                cells.start(place + 1) + 1,
                f"{self._header.names[place]} is beyond the limit of "
                f"{self.bounds[place] / self.scales[place]:g}",
                hint="check the number and its unit",
            )
        return values


def _diagnose(name: str, number: int, line: str, header: Header) -> ProgramError:
    cells = line.split(",")
    if len(cells) != len(header.names):
        return ProgramError(
            name,
            number,
            1,
            f"{len(cells)} cells, the header has {len(header.names)}",
            hint="every row has one number for each column",
        )
    column = 1
    for cell, what in zip(cells, header.names, strict=True):
        if re.fullmatch(_CELL, cell) is None:
            at = column + len(cell) - len(cell.lstrip())
            return ProgramError(
                name,
                number,
                at,
                f"{cell.strip()[:40]!a} is no number for {what}",
                hint="write it as 1.5 or 1e-3",
            )
        column += len(cell) + 1
    return ProgramError(name, number, 1, "the row cannot be read")
