"""Samples as CSV lines that come one by one, at a fixed interval: nothing is read ahead."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.errors import ProgramError
from cnc_shape.readers.source import UTF8_MARK, ReadingLimits, text_of
from cnc_shape.readers.table import FEED, TIME, Header, RowReader, parse_header

JITTER = 0.01  # -, of the interval: times are written with few decimals


@dataclass(frozen=True, eq=False, slots=True)
class Sample:
    """One line."""

    line: int
    values: FloatArray  # (c,) as written, in the header's units, column by column
    time: float | None  # s
    time_text: str  # as written
    time_column: int  # 1-based, in the line


class SampleLines:
    """The lines of a live table: the header at once, then one sample for each line that comes.

    Parameters
    ----------
    stream
        Where the lines come from.
    name
        What errors call it.
    limits
        How long a line, how large a coordinate may be.

    Raises
    ------
    ProgramError
        No header, one that `parse_header` refuses, or a feed rate: samples say themselves how fast they are.
    """

    def __init__(self, stream: BinaryIO, name: str, limits: ReadingLimits) -> None:
        self.name = name
        self._stream, self._limits = stream, limits
        self._number = 0
        text = next(self._texts(), None)
        if text is None:
            raise ProgramError(name, None, None, "no header came", hint="begin with a line time_s,x_mm,y_mm")
        self.titles = [cell.strip() for cell in text.split(",")]
        self.header: Header = parse_header(name, self._number, text)
        if FEED in self.header.names:
            raise ProgramError(
                name, self._number, 1, "samples have no feed rate", hint="leave the column out"
            )
        self._reader = RowReader(name, limits, self.header)

    @property
    def columns(self) -> list[int]:
        """Columns that are axes."""
        return [k for k, name in enumerate(self.header.names) if name != TIME]

    @property
    def axes(self) -> tuple[str, ...]:
        """Their axes, in the order of the columns."""
        return tuple(self.header.names[k] for k in self.columns)

    @property
    def clock(self) -> int | None:
        """Column of the time."""
        return self.header.names.index(TIME) if TIME in self.header.names else None

    def __iter__(self) -> Iterator[Sample]:
        """Yield every line as soon as it has come; blank ones are skipped.

        Raises
        ------
        ProgramError
            A ragged line, text, an infinite or a huge number.
        """
        clock = self.clock
        for text in self._texts():
            cells = self._reader.cells(self._number, text)
            scaled = self._reader.values(self._number, cells)
            values = np.array([float(cell) for cell in cells.groups()])
            if clock is None:
                yield Sample(self._number, values, None, "", 1)
            else:
                place = cells.start(clock + 1) + 1
                yield Sample(self._number, values, float(scaled[clock]), cells.group(clock + 1), place)

    def _texts(self) -> Iterator[str]:
        """Yield the lines that are not blank, without their ends."""
        while line := self._next():
            self._number += 1
            if self._number == 1:
                line = line.removeprefix(UTF8_MARK)
            text = text_of(self.name, self._number, line.rstrip(b"\r\n"), self._limits)
            if text.strip():
                yield text

    def _next(self) -> bytes:
        try:
            return self._stream.readline(self._limits.line_bytes + 3)  # the ends of line and one too many
        except OSError as fault:
            reason = f"cannot read: {(fault.strerror or str(fault)).lower()}"
            raise ProgramError(self.name, None, None, reason, hint="check what writes into it") from fault


def check_interval(lines: SampleLines, before: Sample, sample: Sample, sample_time: float) -> None:
    """Refuse a sample that does not follow the one before it by the sample time.

    Raises
    ------
    ProgramError
        Later or earlier by more than `JITTER`.
    """
    if before.time is None or sample.time is None:
        return
    step = sample.time - before.time
    if abs(step - sample_time) > JITTER * sample_time:
        raise ProgramError(
            lines.name, sample.line, sample.time_column,
            f"the sample comes {1e3 * step:.6g} ms after the one before, not {1e3 * sample_time:.6g} ms",
            hint="samples must come at a fixed interval; --sample-time-s names it",
        )  # fmt: skip


def interval_of(lines: SampleLines, before: Sample, sample: Sample, usual: float) -> float | None:
    """Interval that the first two samples tell, s; None where the table has no times.

    Times have few decimals: where they come near the `usual` interval they mean it.

    Raises
    ------
    ProgramError
        Time does not go on.
    """
    if before.time is None or sample.time is None:
        return None
    step = sample.time - before.time
    if step <= 0.0:
        way = "runs backwards" if step < 0.0 else "stands still"
        raise ProgramError(
            lines.name, sample.line, sample.time_column, f"time {way} at {sample.time:g} s",
            hint="samples are in order of time",
        )  # fmt: skip
    return usual if abs(step - usual) <= JITTER * usual else step
