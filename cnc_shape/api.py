"""The commands as functions: a program through the whole chain, its report, its picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cnc_shape.cases import default_cases, pick_cases, timings
from cnc_shape.config.dump import dump_machine
from cnc_shape.config.setup import Setup
from cnc_shape.opening import digest, open_motion
from cnc_shape.pipeline import Run, run
from cnc_shape.readers import ReadingOptions
from cnc_shape.readers.source import STANDARD_INPUT
from cnc_shape.report import folder as run_folder
from cnc_shape.report.figures import path_figure
from cnc_shape.report.style import Format
from cnc_shape.report.words import saturations
from cnc_shape.slowing import slow_down

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def simulate_program(
    path: str | Path,
    setup: Setup,
    cases: Sequence[str] | None = None,
    options: ReadingOptions | None = None,
    *,
    record: bool = True,
    all_signals: bool = False,
) -> Run:
    """Send a program through a machine, case by case.

    The signals of a case are in memory up to 131,072 samples; of more, ``run.signal(case)`` has the extremes,
    and its ``samples`` every one, from a nameless file, up to two million or `all_signals`.

    Parameters
    ----------
    path
        G-code or CSV.
    setup
        The machine, from `load_machine`.
    cases
        Rows of the table; None: the machine's own.
    options
        How to read the file.
    record
        Keep the signals for a report.
    all_signals
        Keep every sample of them, however many there are.
    """
    tolerance, slowdown = setup.planning.tool_tolerance, None
    if tolerance is not None and setup.acting_shapers:
        slowdown = slow_down(str(path), setup, options or ReadingOptions(), tolerance).slowdown
    picked = default_cases(setup, slowdown) if cases is None else pick_cases(setup, cases, slowdown)
    with open_motion(str(path), setup, options, timings(picked)) as motion:
        return run(motion.blocks, setup, picked, motion.name, record=record, all_signals=all_signals)


def report_context(
    inputs: Sequence[str],
    setup: Setup,
    command: Sequence[str] = (),
    warnings: Sequence[str] = (),
    figure_format: Format = "svg",
) -> run_folder.Context:
    """What a run folder says about where its run came from."""
    return run_folder.Context(
        command=command,
        inputs={Path(path).name: digest(path) for path in inputs},
        program=next((Path(path) for path in inputs if path != STANDARD_INPUT), None),
        machine=dump_machine(setup),
        shapers=setup.acting_shapers,
        modes={axis.name: axis.modes for axis in setup.machine.axes},
        warnings=warnings,
        figure_format=figure_format,
    )


def write_report(run: Run, folder: str | Path, setup: Setup, *, force: bool = False) -> Path:
    """Write the run folder of a recorded run; returns the path of its page."""
    context = report_context([], setup, warnings=saturations(run.summary))
    return run_folder.write_report(run, Path(folder), context, force=force)


def plot(run: Run) -> Figure:
    """Draw the programmed path and every case's tool, contour error magnified."""
    return path_figure(run)
