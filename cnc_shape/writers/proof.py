"""Proof of a program: what it says, as the reader understands it, against the command it was made from."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.errors import OutputError, ProgramError
from cnc_shape.program import ROTARY, Motion, Program
from cnc_shape.readers import ReadingOptions, read_chunks
from cnc_shape.readers.gcode import Dialect, GcodeOptions
from cnc_shape.readers.source import ReadingLimits
from cnc_shape.toolpath import rotary_travel, travel_lengths
from cnc_shape.units import DEGREE

SHORTEST_LINE = 3  # bytes, of a line with a word and its end


@dataclass(frozen=True, slots=True)
class Proof:
    """How a program and a command compare."""

    samples: int
    deviation: float  # mm, largest distance in X, Y, Z at the time of any sample
    turn_deviation: float  # degrees, the same in A, B, C
    time_difference: float  # s, of the program less that of the command


def read_back(
    path: Path, axes: Sequence[str], command: Iterable[Sequence[FloatArray]], sample_time: float
) -> Proof:
    """Read a program of moves in inverse time and compare it with the command at every sample.

    Parameters
    ----------
    path
        The program.
    axes
        Of the command.
    command
        Its positions in mm and degrees, piece by piece, a column (n,) an axis.
    sample_time
        Its period, s.

    Raises
    ------
    OutputError
        The program is none, or moves other axes.
    """
    try:
        return _compare(_knots(path, axes), axes, command, sample_time)
    except ProgramError as error:
        raise OutputError(
            f"what was written does not read back: line {error.line}: {error.reason}",
            hint="nothing was published; report this",
        ) from error


def _knots(path: Path, axes: Sequence[str]) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield when and where the moves of each chunk end: duration (m,) s each, place (m,d) mm and degrees."""
    size = path.stat().st_size
    limits = ReadingLimits(file_bytes=size, blocks=size // SHORTEST_LINE + 1)
    rotary = np.array([axis in ROTARY for axis in axes])
    for chunk in read_chunks(path, ReadingOptions(gcode=GcodeOptions(Dialect.RS274), limits=limits)):
        if chunk.axes != tuple(axes):
            found, wanted = (", ".join(names).upper() for names in (chunk.axes, axes))
            raise OutputError(
                f"what was written moves {found}, the command {wanted}",
                hint="nothing was published; report this",
            )
        yield durations(chunk), np.where(rotary, chunk.target / DEGREE, chunk.target)


def durations(program: Program) -> FloatArray:
    """Time of every move as it is programmed, (m,) s; rapids take none."""
    length = travel_lengths(program)
    length = np.where(length > 0.0, length, rotary_travel(program))
    return np.where(program.motion == Motion.DWELL, program.dwell, length / program.feed_rate)


def _compare(
    knots: Iterator[tuple[FloatArray, FloatArray]],
    axes: Sequence[str],
    command: Iterable[Sequence[FloatArray]],
    sample_time: float,
) -> Proof:
    rotary = [k for k, axis in enumerate(axes) if axis in ROTARY]
    linear = [k for k, axis in enumerate(axes) if axis not in ROTARY]
    clock, place = np.zeros(1), np.zeros((1, len(axes)))  # knots that samples to come lie between
    now, samples = 0.0, 0
    worst = [0.0, 0.0]
    for columns in command:
        time = (samples + np.arange(columns[0].size)) * sample_time
        samples += time.size
        while now <= time[-1] and (more := next(knots, None)) is not None:
            ends = np.cumsum(np.concatenate([[now], more[0]]))[1:]
            clock, place = np.concatenate([clock, ends]), np.vstack([place, more[1]])
            now = float(clock[-1])
        apart = np.empty((time.size, len(axes)))
        for k, column in enumerate(columns):
            apart[:, k] = np.interp(time, clock, place[:, k]) - column
        for kind, members in enumerate((linear, rotary)):
            distance: FloatArray = np.sqrt((apart[:, members] ** 2).sum(axis=1))
            worst[kind] = max(worst[kind], float(np.max(distance)))
        passed = max(np.count_nonzero(clock < time[-1]) - 1, 0)
        clock, place = clock[passed:], place[passed:]
    for more in knots:
        now += float(more[0].sum())
    return Proof(samples, worst[0], worst[1], now - (samples - 1) * sample_time)
