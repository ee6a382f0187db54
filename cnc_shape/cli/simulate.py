"""``cnc-shape simulate``: a program through the whole chain, and the table of its contour error."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cnc_shape.cli.options import BlockDelete, Closed, Dialect, Force, Json, Machine, PathStyle, Quiet

if TYPE_CHECKING:
    from cnc_shape.pipeline import Run
    from cnc_shape.report.folder import Context
    from cnc_shape.report.style import Format
    from cnc_shape.trade import TradeRow

SAMPLE = "bracket.nc"


def simulate(
    file: Annotated[
        str | None,
        typer.Argument(
            metavar="[FILE]", help="G-code or CSV; - for standard input; without it the bundled bracket."
        ),
    ] = None,
    machine: Machine = None,
    report: Annotated[
        bool, typer.Option("--report", help="Write a run folder with page, figures and signals.")
    ] = False,
    output: Annotated[
        str | None, typer.Option("-o", "--output", metavar="DIR", help="The run folder; implies --report.")
    ] = None,
    all_signals: Annotated[
        bool,
        typer.Option("--all-signals", help="With --report: every sample in signals.npz, however many."),
    ] = False,
    cases: Annotated[
        str | None,
        typer.Option(
            metavar="A,B",
            help="Rows of the table, such as unshaped,shaped+cross_coupled or independent+disturbed.",
        ),
    ] = None,
    fail_on: Annotated[
        list[str] | None,
        typer.Option(metavar="CONDITION", help='Exit 1 if the last row meets it: "max_contour_um>20".'),
    ] = None,
    figures: Annotated[str, typer.Option(help="Format of the figures: svg, png or pdf.")] = "svg",
    dialect: Dialect = "auto",
    block_delete: BlockDelete = False,
    path: PathStyle = "polyline",
    closed: Closed = False,
    force: Force = False,
    quiet: Quiet = False,
    json: Json = False,
) -> int:
    """Simulate a program: motion, shaping, servo, structure; print its contour error case by case."""
    from cnc_shape.cases import default_cases, pick_cases, timings
    from cnc_shape.cli.errors import DONE, GATE_FAILED
    from cnc_shape.cli.gate import parse_gate
    from cnc_shape.cli.output import print_error, print_json, warn
    from cnc_shape.cli.progress import line_by_line, progress
    from cnc_shape.cli.reading import named_options
    from cnc_shape.cli.slowed import slowed_down, slowed_json, slowed_notes
    from cnc_shape.config.bundled import bundled
    from cnc_shape.config.machine_file import load_machine
    from cnc_shape.opening import open_motion
    from cnc_shape.pipeline import run
    from cnc_shape.report.table import summary_json
    from cnc_shape.report.words import saturations
    from cnc_shape.trade import Trade

    gates = [parse_gate(text) for text in fail_on or []]
    kind = _figure_format(figures)
    setup = load_machine(machine)
    names = None if cases is None else [name.strip() for name in cases.split(",")]
    picked = default_cases(setup) if names is None else pick_cases(setup, names)
    wanted = report or output is not None
    _check_wanted(wanted, all_signals=all_signals)
    if output is not None:
        _check_folder(Path(output), force=force)
    source = file if file is not None else str(bundled(SAMPLE))
    options = named_options(dialect, path, setup.tools, block_delete=block_delete, closed=closed)
    slowed = slowed_down(source, setup, options, quiet=quiet or json)
    if slowed is not None:
        gentle = slowed.slowdown
        picked = default_cases(setup, gentle) if names is None else pick_cases(setup, names, gentle)
    trade = Trade(setup) if wanted else None
    with (
        open_motion(source, setup, options, timings(picked), trade.timings if trade else ()) as motion,
        progress("simulating", motion.lines, quiet=quiet or json) as advance,
    ):
        blocks = line_by_line(motion.blocks, advance)
        observers = [] if trade is None else [trade]
        result = run(
            blocks, setup, picked, motion.name, record=wanted, all_signals=all_signals, observers=observers
        )
    page, kinds = None, () if trade is None else trade.rows()
    notes = [*slowed_notes(slowed, setup), *saturations(result.summary)]
    if any(case.disturbed for case in result.summary.cases):
        notes += motion.unmet_loads()
    if wanted:
        from cnc_shape.api import report_context

        command = [
            "simulate", motion.name, *(["--cases", cases] if cases else []),
            *(["--all-signals"] if all_signals else []),
        ]  # fmt: skip
        told = [*motion.warnings(by_name=True), *notes]
        context = report_context([source], setup, command, told, kind)
        page = _report(result, output, context, kinds, force=force)
    warn([*motion.warnings(), *notes], quiet=quiet)
    if json:
        extra: dict[str, Any] = slowed_json(slowed) | ({} if page is None else {"report": str(page)})
        if kinds:
            from cnc_shape.report.trade_table import trade_json

            extra["trade"] = trade_json(kinds)
        if result.limit_use is not None:
            from cnc_shape.report.limit_table import limits_json

            extra["planned"] = limits_json(result.limit_use)
        print_json(None, {**summary_json(result.summary), **extra})
    else:
        _print_table(result, kinds, page)
    failures = [failure for gate in gates if (failure := gate.failure(result.summary)) is not None]
    for failure in failures:
        print_error(failure)
    return GATE_FAILED if failures else DONE


def _figure_format(text: str) -> Format:
    from cnc_shape.errors import OptionError

    formats: dict[str, Format] = {"svg": "svg", "png": "png", "pdf": "pdf"}
    if text not in formats:
        raise OptionError(f"figures come as {', '.join(formats)}, not {text!r}")
    return formats[text]


def _check_wanted(report: bool, *, all_signals: bool) -> None:
    from cnc_shape.errors import OptionError

    if all_signals and not report:
        raise OptionError("--all-signals has no report to write them to", hint="add --report, or -o DIR")


def _check_folder(folder: Path, *, force: bool) -> None:
    from cnc_shape.report.folder import MARKER
    from cnc_shape.writers.publish import check_folder

    check_folder(folder, MARKER, force=force)


def _report(
    result: Run, output: str | None, context: Context, trade: Sequence[TradeRow], *, force: bool
) -> Path:
    from cnc_shape.report.folder import default_folder, write_report

    if output is not None:
        return write_report(result, Path(output), context, trade, force=force)
    folder = default_folder(result, context)
    return write_report(result, folder, context, trade, force=True)  # its name is its content's


def _print_table(result: Run, trade: Sequence[TradeRow], page: Path | None) -> None:
    from rich.console import Console

    from cnc_shape.report.table import build_table

    console = Console(highlight=False, soft_wrap=False)
    console.print(build_table(result.summary, console.width))
    if trade:
        from cnc_shape.report.trade_table import trade_table

        console.print(trade_table(trade, console.width))
    if page is not None:
        console.print(f"report: {page}", soft_wrap=True, markup=False)
