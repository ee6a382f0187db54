"""``cnc-shape apply --stream``: samples from standard input, each shaped and handed on before the next."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.cli.output import warn
from cnc_shape.config.machine_file import load_machine
from cnc_shape.config.setup import Setup
from cnc_shape.errors import InfeasibleError, OptionError, ProgramError
from cnc_shape.readers.sample_lines import Sample, SampleLines, check_interval, interval_of
from cnc_shape.readers.source import ReadingLimits
from cnc_shape.shapers.discretisation import Interpolation, coarse
from cnc_shape.shapers.live import Filters, LiveShaper, filters

STDIN = "<stdin>"
TIME_DECIMALS = 12  # of the times after the last sample


def stream_samples(
    file: str | None,
    output: str | None,
    machine: str | None,
    interpolation: str | None,
    sample_time: float | None,
    *,
    json: bool,
    quiet: bool,
) -> None:
    """Shape the samples that come from standard input; write a line for each, and the tail after the end.

    Raises
    ------
    OptionError
        What a stream cannot do, or a sample time that the shapers cannot be sampled at.
    ProgramError
        A line that is no sample, or one that comes too early or late; those before it have been written.
    """
    if file not in (None, "-"):
        raise OptionError(
            f"--stream reads standard input, not {file}", hint=f"cnc-shape apply --stream < {file}"
        )
    if output not in (None, "-") or json:
        raise OptionError(
            f"--stream writes lines on standard output, not {'one JSON object' if json else output}",
            hint="leave --json out" if json else f"cnc-shape apply --stream > {output}",
        )
    if sample_time is not None and not (isfinite(sample_time) and sample_time > 0.0):
        raise OptionError(f"--sample-time-s must be positive and finite, not {sample_time:g}")
    way = _interpolation(interpolation)
    wanted = _Wanted(load_machine(machine), way, sample_time, quiet)
    if not wanted.setup.acting_shapers:
        warn(["this machine has no shapers: the samples go through as they are"], quiet=quiet)
    if sys.stdin is None:  # pyright: ignore[reportUnnecessaryComparison]  # closed by whoever started us
        raise ProgramError(STDIN, None, None, "cannot read: it is closed", hint="pipe the samples into it")
    LiveShaper(filters({}, ("x",), 1.0, Interpolation.LINEAR, {})).push(
        np.zeros(1)
    )  # compiled code is loaded now
    lines = SampleLines(sys.stdin.buffer, STDIN, ReadingLimits())
    for text in _shaped(lines, wanted):
        sys.stdout.buffer.write(text.encode("ascii"))
        sys.stdout.buffer.flush()


@dataclass(frozen=True, slots=True)
class _Wanted:
    """What the command line asks for."""

    setup: Setup
    interpolation: Interpolation | None  # None: the best that there is
    sample_time: float | None  # s; None: as the samples say
    quiet: bool


def _interpolation(name: str | None) -> Interpolation | None:
    names = {member.value: member for member in Interpolation}
    if name is not None and name not in names:
        raise OptionError(f"unknown interpolation {name!r}", hint="there are " + ", ".join(names))
    return None if name is None else names[name]


def _shaped(lines: SampleLines, wanted: _Wanted) -> Iterator[str]:
    """Yield the header, a line for each sample as soon as it is there, and after the last the tail.

    The first sample goes out as it came, for the command has been resting there; so the interval need not be
    known before the second.
    """
    yield ",".join(lines.titles) + "\n"
    columns, usual = lines.columns, wanted.setup.control.sample_time
    sample_time = wanted.sample_time or (usual if lines.clock is None else None)
    live = None if sample_time is None else LiveShaper(_filters(lines, wanted, sample_time))
    before: Sample | None = None
    for sample in lines:
        if before is None:
            before = sample
            if live is not None:
                live.push(sample.values[columns])
            yield _line(lines, sample.time_text, sample.values[columns])
            continue
        if live is None:
            live = _started(lines, wanted, before, sample)
        check_interval(lines, before, sample, live.filters.sample_time)
        yield _line(lines, sample.time_text, live.push(sample.values[columns]))
        before = sample
    if before is not None:
        if live is None:  # a single sample: wherever it is, the command rests
            live = LiveShaper(_filters(lines, wanted, usual))
            live.push(before.values[columns])
        yield "".join(_tail(lines, before, live))


def _started(lines: SampleLines, wanted: _Wanted, first: Sample, second: Sample) -> LiveShaper:
    """A live shaper for the interval of the first two samples, of which it has seen the first."""
    usual = wanted.setup.control.sample_time
    sample_time = interval_of(lines, first, second, usual) or usual
    try:
        live = LiveShaper(_filters(lines, wanted, sample_time))
    except OptionError as error:
        raise ProgramError(
            lines.name, second.line, second.time_column, error.reason, hint=error.hint
        ) from error
    live.push(first.values[lines.columns])
    return live


def _filters(lines: SampleLines, wanted: _Wanted, sample_time: float) -> Filters:
    """Put the machine's shapers on the grid: exactly, or linearly where nobody asked and none is exact."""
    shapers = wanted.setup.acting_shapers
    modes = {axis.name: axis.modes for axis in wanted.setup.machine.axes}
    aligned = wanted.setup.planning.aligned
    way = wanted.interpolation or Interpolation.EXACT
    try:
        made = filters(shapers, lines.axes, sample_time, way, modes, aligned=aligned)
    except InfeasibleError as error:
        if wanted.interpolation is not None:
            raise
        warn([f"{error.reason}: they are linear"], quiet=wanted.quiet)
        way = Interpolation.LINEAR
        made = filters(shapers, lines.axes, sample_time, way, modes, aligned=aligned)
    shaped = [mode for axis in lines.axes if axis in shapers for mode in modes.get(axis, ())]
    told = coarse(way, sample_time, shaped)
    warn([] if told is None else [told], quiet=wanted.quiet)
    return made


def _line(lines: SampleLines, time: str, values: FloatArray) -> str:
    cells = [repr(value) for value in values.tolist()]
    if lines.clock is not None:
        cells.insert(lines.clock, time)
    return ",".join(cells) + "\n"


def _tail(lines: SampleLines, last: Sample, live: LiveShaper) -> Iterator[str]:
    """Yield the lines after the last sample, at which the command rests."""
    sample_time = live.filters.sample_time
    step = sample_time / lines.header.scales[lines.clock] if lines.clock is not None else 0.0
    start = float(last.time_text or 0.0)
    for k, values in enumerate(live.flush(), 1):
        yield _line(lines, repr(float(np.round(start + k * step, TIME_DECIMALS))), values)
