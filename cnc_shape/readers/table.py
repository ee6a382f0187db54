"""A CSV table of numbers: a header that names columns with units, then rows, each checked at its place."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import get_close_matches

from cnc_shape.errors import ProgramError
from cnc_shape.program import ROTARY, XYZ
from cnc_shape.readers.source import Source, lines
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
                source.name,
                number,
                at,
                f"unknown column {text!a}",
                hint=f"did you mean {close[0]}?"
                if close
                else "columns are named x_mm, y_mm, a_deg, feed_mm_min, time_s",
            )
        if known[0] in names:
            raise ProgramError(
                source.name, number, at, f"a second column for {known[0]}", hint="keep one of them"
            )
        names.append(known[0])
        scales.append(known[1])
    if not set(names) & {*XYZ, *ROTARY}:
        raise ProgramError(source.name, number, 1, "no column is an axis", hint="name a column x_mm")
    return Header(tuple(names), tuple(scales))


def read_rows(source: Source, header: Header) -> Iterator[tuple[int, list[float]]]:
    """Yield ``(line, values)`` of each row in mm, rad, s and mm/s; blank lines are skipped.

    Raises
    ------
    ProgramError
        A ragged row, text, an infinite or a huge number.
    """
    pattern = re.compile(",".join([_CELL] * len(header.names)))
    limit = source.limits.coordinate
    limits = [
        limit * (DEGREE if name in ROTARY else 1.0) if name in (*XYZ, *ROTARY) else 1e12
        for name in header.names
    ]
    ahead = True
    for number, line in lines(source):
        if not line.strip():
            continue
        if ahead:
            ahead = False
            continue
        match = pattern.fullmatch(line)
        if match is None:
            raise _diagnose(source.name, number, line, header)
        values = [float(text) * scale for text, scale in zip(match.groups(), header.scales, strict=True)]
        for place, (value, bound) in enumerate(zip(values, limits, strict=True)):
            if not -bound <= value <= bound:
                raise ProgramError(
                    source.name,
                    number,
                    match.start(place + 1) + 1,
                    f"{header.names[place]} is beyond the limit of {bound / header.scales[place]:g}",
                    hint="check the number and its unit",
                )
        yield number, values


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
