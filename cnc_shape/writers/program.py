"""A command as a G-code program: straight moves in inverse time, read back before anybody sees them.

::

    command -> knots.py: straight pieces -> creep.py: none too slow -> text, under a hidden name
       |                                                                |
       +--> spool -------------------------> proof.py: read back and compared, sample by sample -> published

A move carries all axes and ``F``, the reciprocal of its time in minutes (G93). Times are rounded like
coordinates; what a move lacks the next one takes up, so that every knot stays on the clock of the samples. A
rest is a G4: a move without travel in inverse time takes its time on some controls and none on others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import floor, log10
from pathlib import Path

from cnc_shape.arrays import FloatArray
from cnc_shape.chunks import with_last
from cnc_shape.errors import OutputError
from cnc_shape.trajectory import Trajectory
from cnc_shape.units import MICROMETRE
from cnc_shape.writers.creep import CreepStep, Place, without_creep
from cnc_shape.writers.knots import Grid, Knots, knotting, make_grid
from cnc_shape.writers.proof import Proof, read_back
from cnc_shape.writers.publish import publishing
from cnc_shape.writers.samples import positions
from cnc_shape.writers.spool import Spool

Write = Callable[[bytes], object]

TIME_DIGITS = 10  # significant ones of F and of the seconds of a dwell
MINUTE = 60.0  # s
COMMENT_WIDTH = 200  # characters; controls take lines of 256
CLOCK = 1e-6  # s, by which the program may last longer or shorter than the command


@dataclass(frozen=True, slots=True)
class WrittenProgram:
    """What was written, and what reading it back has shown."""

    samples: int  # of the command
    segments: int  # straight moves
    rests: int
    deviation: float  # mm, largest distance from the command at the time of any sample
    turn_deviation: float  # degrees, the same of the rotary axes
    time_difference: float  # s, of the program less that of the command


def write_program(
    path: Path | str,
    blocks: Iterable[Trajectory],
    *,
    tolerance: float = MICROMETRE,
    remarks: Sequence[str] = (),
    force: bool = False,
) -> WrittenProgram:
    """Write a command as a G-code program of straight moves.

    Parameters
    ----------
    path
        The file to make.
    blocks
        Consecutive blocks of one command, at least one, from rest to rest.
    tolerance
        mm over X, Y, Z together; A, B, C together keep the same number of degrees.
    remarks
        Comments for its head, one line each.
    force
        Replace an existing file.

    Raises
    ------
    OptionError
        A tolerance that makes no sense.
    OutputError
        The file cannot be written there, or what was read back is not the command.
    InfeasibleError
        A position that is not finite; it names the axis and the time.
    """
    grid = make_grid(tolerance)
    with publishing(path, force=force) as file:
        kept = _Kept(blocks)
        segments, rests = stream_program(file.write, kept.blocks(), grid, remarks)
        file.flush()
        proof = read_back(Path(file.name), kept.axes, kept.pieces(), kept.sample_time)
        _require(path, proof, grid)
    return WrittenProgram(
        proof.samples, segments, rests, proof.deviation, proof.turn_deviation, proof.time_difference
    )


class _Kept:
    """The positions of a command, put aside as it passes."""

    def __init__(self, blocks: Iterable[Trajectory]) -> None:
        self._blocks = blocks
        self._spool: Spool | None = None
        self.axes: tuple[str, ...] = ()
        self.sample_time = 0.0

    def blocks(self) -> Iterator[Trajectory]:
        for block in self._blocks:
            if self._spool is None:
                self.axes, self.sample_time = block.axes, block.sample_time
                self._spool = Spool(len(block.axes))
            self._spool.append(positions(block, len(self._spool)))
            yield block

    def pieces(self) -> Iterator[tuple[FloatArray, ...]]:
        """The columns, mm and degrees, piece by piece."""
        if self._spool is None:
            raise ValueError("a command without a single block is no program")
        return zip(*(self._spool.pieces(column) for column in range(len(self.axes))), strict=True)


def stream_program(
    write: Write, blocks: Iterable[Trajectory], grid: Grid, remarks: Sequence[str] = ()
) -> tuple[int, int]:
    """Write the lines of a program; return the number of straight moves and of rests."""
    find, found = knotting(grid), None
    hasten: CreepStep | None = None
    here: Place | None = None
    text: _Text | None = None
    for block, last in with_last(blocks):
        hasten = hasten or without_creep(block.axes, block.sample_time, grid)
        text = text or _Text(write, block.axes, block.sample_time, grid, remarks)
        found, knots = find(found, block, last)
        here, knots = hasten(here, knots, last)
        text.add(knots)
    if text is None:
        raise ValueError("a command without a single block is no program")
    write(b"G94\nM2\n")
    return text.segments, text.rests


class _Text:
    """Lines of moves, as knots come in: where the program is, and when."""

    def __init__(
        self, write: Write, axes: Sequence[str], sample_time: float, grid: Grid, remarks: Sequence[str]
    ) -> None:
        self._write = write
        self._letters = [axis.upper() for axis in axes]
        self._sample_time = sample_time
        self._grid = grid
        self._words = ""  # of the present place
        self._clock = 0.0  # s, as the control will count it
        self.segments = self.rests = 0
        write("".join(f"({_remark(text)})\n" for text in remarks).encode("ascii"))
        write(f"G21 G90 G17 G40 G49 G80\nG64 P{decimal(grid.tolerance, 9)} Q0\n".encode("ascii"))

    def add(self, knots: Knots) -> None:
        """Write the pieces that end at `knots`."""
        lines: list[str] = []
        for sample, place in zip(knots.sample.tolist(), knots.place.tolist(), strict=True):
            words = " ".join(
                letter + decimal(steps / self._grid.steps, self._grid.decimals)
                for letter, steps in zip(self._letters, place, strict=True)
            )
            if not self._words:
                lines.append(f"G0 {words}\nG93\n")
            else:
                wanted = sample * self._sample_time - self._clock
                if words == self._words:
                    time = significant(wanted)
                    self._clock += float(time)
                    self.rests += 1
                    lines.append(f"G4 P{time}\n")
                else:
                    feed = significant(MINUTE / wanted)
                    self._clock += MINUTE / float(feed)
                    self.segments += 1
                    lines.append(f"G1 {words} F{feed}\n")
            self._words = words
        self._write("".join(lines).encode("ascii"))


def decimal(value: float, decimals: int) -> str:
    """A number as a control reads it: no exponent, no zeros at its end."""
    text = f"{value:.{decimals}f}"
    return text.rstrip("0").rstrip(".") if decimals else text


def significant(value: float) -> str:
    """A positive number with `TIME_DIGITS` significant digits and without exponent."""
    return decimal(value, max(0, TIME_DIGITS - 1 - floor(log10(value))))


def _remark(text: str) -> str:
    """Make text harmless in a comment: ASCII without brackets, of a length that controls take."""
    plain = text.replace("(", "[").replace(")", "]")
    return "".join(char if char.isascii() and char.isprintable() else "?" for char in plain)[:COMMENT_WIDTH]


def _require(path: Path | str, proof: Proof, grid: Grid) -> None:
    apart = max(proof.deviation, proof.turn_deviation)
    if apart <= grid.tolerance and abs(proof.time_difference) <= CLOCK:
        return
    raise OutputError(
        f"{path} does not read back as it was written: {apart / MICROMETRE:g} µm or millidegrees from the "
        f"command, {proof.time_difference:g} s longer",
        hint="nothing was published; try a larger tolerance, or report this if the disk is sound",
    )
