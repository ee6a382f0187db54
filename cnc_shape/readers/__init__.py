"""Readers: text to `Program`. The table `READERS` knows them by the suffix of the file."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from cnc_shape.errors import OptionError, ProgramError
from cnc_shape.program import Program, concatenate
from cnc_shape.readers.gcode import GcodeOptions, interpret, survey
from cnc_shape.readers.source import (
    CHUNK_ROWS,
    COMPILED_FROM,
    ReadingLimits,
    Source,
    blocks,
    count_lines,
    lines,
    open_source,
)
from cnc_shape.readers.table import TIME, is_table, read_header
from cnc_shape.readers.timed import TimedPath, TimedPoints, polyline_through, read_timed_points
from cnc_shape.readers.timed_circle import circle_through
from cnc_shape.readers.timed_spline import spline_through
from cnc_shape.readers.waypoints import read_waypoints

if TYPE_CHECKING:
    from cnc_shape.toolpath import Toolpath
    from cnc_shape.trajectory import Trajectory

CSV = "csv"  # dialect of tables


class Curve(Enum):
    """What joins the rows of a table."""

    POLYLINE = "polyline"
    SPLINE = "spline"
    CIRCLE = "circle"


@dataclass(frozen=True, slots=True)
class ReadingOptions:
    """How to read a program or a table."""

    gcode: GcodeOptions = field(default_factory=GcodeOptions)
    curve: Curve = Curve.POLYLINE  # through the rows of a table
    closed: bool = False  # the path through them returns to the first
    rows: int = CHUNK_ROWS  # of a chunk
    compiled_from: int = COMPILED_FROM  # bytes: in longer texts, plain lines take the compiled way
    limits: ReadingLimits = field(default_factory=ReadingLimits)


@dataclass(frozen=True, eq=False, slots=True)
class Reading:
    """A program that is being read: what is known beforehand, and its chunks in order."""

    source: str
    dialect: str
    lines: int
    axes: tuple[str, ...]
    chunks: Iterator[Program]
    timed: TimedPath | None = None  # rows and their path, if the table is a time trajectory
    evidence: str = ""  # why this dialect


class _Through(Protocol):
    """Lay out the path through the rows of a time trajectory."""

    def __call__(self, points: TimedPoints, *, closed: bool) -> TimedPath: ...


PATHS: dict[Curve, _Through] = {
    Curve.POLYLINE: polyline_through,
    Curve.SPLINE: spline_through,
    Curve.CIRCLE: circle_through,
}
Reader = Callable[[Source, ReadingOptions], Reading]


def gcode_reading(source: Source, options: ReadingOptions) -> Reading:
    """Read a program of G-code."""
    seen = survey(source, options.gcode.dialect)
    chunks = interpret(source, seen, options.gcode, rows=options.rows, compiled_from=options.compiled_from)
    return Reading(source.name, seen.dialect.value, seen.lines, seen.axes, chunks, evidence=seen.evidence)


def table_reading(source: Source, options: ReadingOptions) -> Reading:
    """Read way-points, or a time trajectory where the header has a time."""
    header = read_header(source)
    if options.curve is not Curve.POLYLINE and TIME not in header.names:
        raise OptionError(f"--path {options.curve.value} is not built yet", hint="take --path polyline")
    rows, compiled_from = options.rows, options.compiled_from
    count = sum(count_lines(block) for block in blocks(source))
    if TIME in header.names:
        points = read_timed_points(source, header, rows=rows, compiled_from=compiled_from)
        path = PATHS[options.curve](points, closed=options.closed)
        return Reading(source.name, CSV, count, header.axes, iter([path.program]), path)
    chunks = read_waypoints(source, header, closed=options.closed, rows=rows, compiled_from=compiled_from)
    return Reading(source.name, CSV, count, header.axes, chunks)


_GCODE_SUFFIXES = (
    ".nc",
    ".ngc",
    ".gcode",
    ".gco",
    ".g",
    ".tap",
    ".cnc",
    ".txt",
    ".eia",
    ".iso",
    ".mpf",
    ".din",
)
READERS: dict[str, Reader] = {**dict.fromkeys(_GCODE_SUFFIXES, gcode_reading), ".csv": table_reading}


@contextmanager
def reading(path: str | Path, options: ReadingOptions | None = None) -> Generator[Reading]:
    """Open a program or a table; a suffix that no reader claims is decided by the first line.

    Raises
    ------
    ProgramError
        What is wrong with the file, at once or while its chunks are read.
    """
    options = options or ReadingOptions()
    with open_source(path, options.limits) as source:
        reader = READERS.get(Path(path).suffix.lower())
        if reader is None:
            first = next((line for _, line in lines(source) if line.strip()), "")
            reader = table_reading if is_table(first) else gcode_reading
        yield reader(source, options)


def read_chunks(path: str | Path, options: ReadingOptions | None = None) -> Iterator[Program]:
    """Yield a program in chunks; memory does not grow with its length."""
    with reading(path, options) as opened:
        yield from opened.chunks


def read_program(path: str | Path, options: ReadingOptions | None = None) -> Program:
    """Read a whole program: G-code, or way-points, or the path of a time trajectory."""
    return concatenate(read_chunks(path, options))


def read_trajectory(
    path: str | Path, sample_time: float, options: ReadingOptions | None = None
) -> tuple[Trajectory, Toolpath]:
    """Read a time trajectory, resampled at `sample_time` s, and the path through its rows.

    Raises
    ------
    ProgramError
        As `reading`; the table has no time.
    """
    from cnc_shape.readers.trajectories import resample  # what only reads programs need not load the kernels

    options = options or ReadingOptions()
    with reading(path, options) as opened:
        if opened.timed is None:
            raise ProgramError(opened.source, 1, 1, "no column is the time", hint="name a column time_s")
        return resample(opened.timed, sample_time, samples=options.limits.samples)
