"""``cnc-shape check``: read and validate programs, tables and machine files, and say what they hold."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cnc_shape.cli.options import (
    MACHINE_SUFFIXES,
    BlockDelete,
    Closed,
    Dialect,
    Force,
    Json,
    PathStyle,
    Quiet,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cnc_shape.arrays import FloatArray, IntArray
    from cnc_shape.census import Census
    from cnc_shape.cli.cycle_time import Clock
    from cnc_shape.config.setup import Setup
    from cnc_shape.program import Program
    from cnc_shape.readers import Reading, ReadingOptions


def check(
    files: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="FILE…", help="G-code, CSV or machine files; - for stdin.", show_default=False
        ),
    ] = None,
    machine: Annotated[
        str | None,
        typer.Option(
            "-m",
            "--machine",
            envvar="CNC_SHAPE_MACHINE",
            help="Machine file: its tools, with --time its limits.",
        ),
    ] = None,
    time: Annotated[
        bool, typer.Option("--time", help="Plan the motion: its cycle time, and where time is lost.")
    ] = False,
    times: Annotated[
        str | None,
        typer.Option(metavar="OUT.csv", help="Write the time of every move of one file; implies --time."),
    ] = None,
    jacobian: Annotated[
        bool, typer.Option("--jacobian", help="Print the machine's Jacobian, by every formula it has.")
    ] = False,
    pose: Annotated[
        str | None,
        typer.Option(metavar="X,Y,Z…", help="Where to: axes in mm and degrees.", show_default="home"),
    ] = None,
    points: Annotated[
        str | None, typer.Option(metavar="OUT.npz", help="Write the programmed moves of one file as arrays.")
    ] = None,
    dialect: Dialect = "auto",
    block_delete: BlockDelete = False,
    path: PathStyle = "polyline",
    closed: Closed = False,
    max_blocks: Annotated[
        int | None, typer.Option(help="Most blocks that are executed.", show_default="20 M")
    ] = None,
    max_file_bytes: Annotated[int | None, typer.Option(help="Largest file.", show_default="256 MiB")] = None,
    max_line_bytes: Annotated[int | None, typer.Option(help="Longest line.", show_default="64 KiB")] = None,
    max_coordinate_mm: Annotated[
        float | None, typer.Option(help="Largest coordinate.", show_default="1e6")
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
    json: Json = False,
) -> int:
    """Read and validate files: what they count, how long they are, how far they reach."""
    from cnc_shape.cli.errors import DONE, WRONG_INPUT, error_object, report_error
    from cnc_shape.cli.output import print_json
    from cnc_shape.cli.progress import progress
    from cnc_shape.cli.reading import limited, named_options, sole_program
    from cnc_shape.errors import CncShapeError, OptionError

    if jacobian:
        from cnc_shape.cli.jacobian import show_jacobian

        show_jacobian(machine, files or [], pose, json=json)
        return DONE
    if not files or pose is not None:
        reason = "check needs a FILE" if not files else "--pose goes with --jacobian"
        raise OptionError(reason, hint="name programs, CSV or machine files; or -m MACHINE --jacobian")
    setup = _setup(machine, quiet=quiet) if machine is not None or time or times is not None else None
    options = limited(
        named_options(dialect, path, setup.tools if setup else (), block_delete=block_delete, closed=closed),
        blocks=max_blocks,
        file_bytes=max_file_bytes,
        line_bytes=max_line_bytes,
        coordinate=max_coordinate_mm,
    )
    if points is not None:
        sole_program(files, "--points", points)
    clock: Clock | None = None
    if setup is not None and (time or times is not None):
        from cnc_shape.cli.cycle_time import Clock, check_times

        target = None if times is None else check_times(files, times, force=force)
        clock = Clock(setup, target, force, quiet, silent=quiet or json)
    results: list[dict[str, Any]] = []
    status = DONE
    for file in files:
        try:
            with progress("reading", None, quiet=quiet or json or clock is not None):
                result = _check(file, options, points, clock)
        except CncShapeError as error:
            if len(files) == 1:
                raise
            report_error(error, json=False)
            results.append({"file": file, "error": error_object(error)})
            status = WRONG_INPUT
            continue
        results.append(result)
        if not json:
            _show(result, quiet=quiet)
    if json:
        print_json("check", results[0] if len(files) == 1 else {"files": results})
    return status


def _setup(machine: str | None, *, quiet: bool) -> Setup:
    from cnc_shape.cli.output import warn
    from cnc_shape.config.machine_file import load_machine

    setup = load_machine(machine)
    warn(setup.warnings, quiet=quiet)
    return setup


def _check(file: str, options: ReadingOptions, points: str | None, clock: Clock | None) -> dict[str, Any]:
    if Path(file).suffix.lower() in MACHINE_SUFFIXES:
        from cnc_shape.config.check import check_machine

        return check_machine(file)
    from cnc_shape.census import count
    from cnc_shape.readers import reading
    from cnc_shape.writers.points import points_file, points_of
    from cnc_shape.writers.publish import publish

    census: Census | None = None
    rows: list[dict[str, FloatArray | IntArray]] = []

    def counted(chunks: Iterator[Program]) -> Iterator[Program]:
        nonlocal census
        for chunk in chunks:
            census = count(census, chunk)
            if points is not None:
                rows.append(points_of(chunk))
            yield chunk

    with reading(file, options) as opened:
        told: dict[str, Any] = {}
        if clock is not None:
            from cnc_shape.cli.cycle_time import time_of

            told["time"] = time_of(opened, counted(opened.chunks), clock)
        else:
            for _ in counted(opened.chunks):
                pass
        assert census is not None  # a reader yields one chunk at least
        if points is not None:
            publish(points, points_file(rows), force=True)
        return _result(opened, census) | told


def _result(opened: Reading, census: Census) -> dict[str, Any]:
    from cnc_shape.program import unit_of

    empty = not census.low[0] <= census.high[0]
    return {
        "file": opened.source,
        "dialect": opened.dialect,
        "dialect_evidence": opened.evidence,
        "lines": opened.lines,
        "moves": {
            "rapid": census.rapids, "feed": census.feeds, "arc": census.arcs,
            "spline": 0, "probe": 0, "tap": 0, "dwell": census.dwells,
        },
        "rapid_length_mm": census.rapid_length,
        "feed_length_mm": census.feed_length,
        "feed_time_s": census.feed_time,
        "dwell_s": census.dwell,
        "bounds_mm": {
            "min": None if empty else census.low.tolist(),
            "max": None if empty else census.high.tolist(),
        },
        "final_position": {
            axis: float(value) / unit_of(axis)
            for axis, value in zip(census.axes, census.position, strict=True)
        },
        "warnings": [{"line": note.line, "message": note.message} for note in census.notes],
    }  # fmt: skip


def _show(result: dict[str, Any], *, quiet: bool) -> None:
    """Print a result for the eye; warnings go to stderr."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from cnc_shape.cli.output import print_error

    table = Table(title=Text(result["file"], style="bold"), title_justify="left", show_header=False, box=None)
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    for name, value in _facts(result):
        table.add_row(Text(name), Text(value))
    Console(highlight=False).print(table)
    if not quiet:
        for warning in result["warnings"]:
            print_error(f"{result['file']}:{warning['line']}: warning: {warning['message']}")


def _facts(result: dict[str, Any]) -> list[tuple[str, str]]:
    if result["dialect"] == "machine":
        from cnc_shape.cli.machine_facts import machine_facts

        return machine_facts(result)
    time: list[tuple[str, str]] = []
    if "time" in result:
        from cnc_shape.cli.cycle_time import time_facts

        time = time_facts(result["time"])
    because = f" ({result['dialect_evidence']})" if result["dialect_evidence"] else ""
    moves = ", ".join(f"{count} {name}" for name, count in result["moves"].items() if count) or "none"
    low, high = result["bounds_mm"]["min"], result["bounds_mm"]["max"]
    bounds = [f"{axis} {a:.3f} … {b:.3f}" for axis, a, b in zip("XYZ", low, high, strict=True)] if low else []
    return [
        ("dialect", result["dialect"] + because),
        ("lines", f"{result['lines']}"),
        ("moves", moves),
        ("rapids", f"{result['rapid_length_mm']:.3f} mm"),
        (
            "feeds",
            f"{result['feed_length_mm']:.3f} mm in {result['feed_time_s']:.3f} s at the programmed feed",
        ),
        ("dwells", f"{result['dwell_s']:.3f} s"),
        ("bounds", "  ".join(bounds) + " mm" if bounds else "none"),
        (
            "ends at",
            "  ".join(f"{axis.upper()} {value:.3f}" for axis, value in result["final_position"].items()),
        ),
        *time,
    ]
