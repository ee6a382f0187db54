"""``cnc-shape apply``: a program's shaped axis commands as a file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cnc_shape.cli.options import BlockDelete, Closed, Dialect, Force, Json, Machine, PathStyle, Quiet

if TYPE_CHECKING:
    from cnc_shape.applying import Application
    from cnc_shape.writers.program import WrittenProgram

SAMPLES = (".csv", ".npz")
PROGRAMS = (".nc", ".ngc", ".gcode")


def apply(
    file: Annotated[
        str | None,
        typer.Argument(metavar="FILE", help="G-code or CSV; - for standard input.", show_default=False),
    ] = None,
    output: Annotated[
        str | None,
        typer.Option(
            "-o", "--output", help="OUT.nc, .ngc or .gcode; OUT.csv or .npz; - for CSV on standard output."
        ),
    ] = None,
    machine: Machine = None,
    tolerance_um: Annotated[
        float | None,
        typer.Option(
            "--tolerance-um",
            help="How closely a program follows the shaped motion, µm (and millidegrees); 1 by default.",
            show_default=False,
        ),
    ] = None,
    respect_limits: Annotated[
        bool,
        typer.Option("--respect-limits", help="Plan anew until the shaped motion keeps the axis limits."),
    ] = False,
    dialect: Dialect = "auto",
    block_delete: BlockDelete = False,
    path: PathStyle = "polyline",
    closed: Closed = False,
    force: Force = False,
    stream: Annotated[
        bool, typer.Option("--stream", help="Shape CSV samples line by line, from standard input to output.")
    ] = False,
    interpolation: Annotated[
        str | None,
        typer.Option(
            help="With --stream, impulses between samples: exact, linear, cubic or rounded.",
            show_default="exact",
        ),
    ] = None,
    sample_time_s: Annotated[
        float | None,
        typer.Option(help="With --stream, interval of the samples.", show_default="as their times say"),
    ] = None,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Shape a program's axis commands; write them as a program, or as samples at the servo period."""
    if stream:
        from cnc_shape.cli.streaming import refuse_options, stream_samples

        refuse_options(
            {"--dialect": dialect != "auto", "--block-delete": block_delete, "--path": path != "polyline",
             "--closed": closed, "--force": force, "--tolerance-um": tolerance_um is not None,
             "--respect-limits": respect_limits}
        )  # fmt: skip
        stream_samples(file, output, machine, interpolation, sample_time_s, json=json, quiet=quiet)
        return
    from cnc_shape.applying import Application
    from cnc_shape.cli import applied
    from cnc_shape.cli.output import print_json, print_text, warn
    from cnc_shape.cli.progress import line_by_line, progress
    from cnc_shape.cli.reading import named_options
    from cnc_shape.cli.slowed import slowed_down, slowed_json, slowed_notes
    from cnc_shape.config.machine_file import load_machine
    from cnc_shape.errors import OptionError
    from cnc_shape.opening import open_motion
    from cnc_shape.respecting import respect_limits as find_limits

    if file is None:
        raise OptionError("missing argument 'FILE'", hint="name a program, or - for standard input")
    if interpolation is not None or sample_time_s is not None:
        raise OptionError(
            "--interpolation and --sample-time-s are for live samples", hint="give --stream, too"
        )
    if json and output == "-":
        raise OptionError("--json and -o - both want standard output", hint="name a file for the samples")
    target = _target(file, output, force=force)
    as_program = target is not None and target.suffix.lower() in PROGRAMS
    if tolerance_um is not None and not as_program:
        raise OptionError("--tolerance-um is for programs: samples are exact", hint="write to OUT.nc")
    setup = load_machine(machine)
    options = named_options(dialect, path, setup.tools, block_delete=block_delete, closed=closed)
    kind = setup.planning.shaping
    slowed = slowed_down(file, setup, options, quiet=quiet or json)
    timing = replace(setup.timing(kind), slowdown=slowed.slowdown if slowed else None)
    respect = None
    if respect_limits:
        with progress("planning", None, quiet=quiet or json):
            respect = find_limits(file, setup, options, timing)
    planner = respect.machine if respect else None
    with (
        open_motion(file, setup, options, [timing], planner=planner) as motion,
        progress("applying", motion.lines, quiet=quiet or json) as advance,
    ):
        blocks = line_by_line(motion.blocks, advance)
        work = Application(blocks, setup.machine, setup.command_shaping(kind), setup.control.sample_time)
        remarks = applied.remarks(motion.name, setup) if as_program else []
        written = _write(work, target, tolerance_um, remarks, force=force)
        done = work.summary()
    notes = applied.notes(done, setup, target if written else None, timed=motion.timed)
    warn([*motion.warnings(), *notes, *slowed_notes(slowed, setup)], quiet=quiet)
    if json:
        print_json("apply", applied.result(done, target, written, respect, setup) | slowed_json(slowed))
    elif target is not None:
        print_text(applied.text(done, target, written, respect, setup))


def _target(file: str, output: str | None, *, force: bool) -> Path | None:
    """The file to write, or None for standard output."""
    from cnc_shape.errors import OptionError
    from cnc_shape.writers.publish import check_target

    if output == "-":
        return None
    if output is None:
        table = Path(file).suffix.lower() == ".csv"
        output = f"{Path('stdin' if file == '-' else file).stem}.shaped{'.csv' if table else '.nc'}"
    target = Path(output)
    if target.suffix.lower() not in (*SAMPLES, *PROGRAMS):
        raise OptionError(
            f"cannot write {target.suffix or 'a file without suffix'}: {output}",
            hint=f"use {', '.join((*PROGRAMS, *SAMPLES))}",
        )
    if file != "-" and target.exists() and Path(file).exists() and target.samefile(file):
        raise OptionError(
            f"{output} is the input itself", hint="name another output: inputs are never overwritten"
        )
    check_target(target, force=force)
    return target


def _write(
    work: Application, target: Path | None, tolerance_um: float | None, remarks: list[str], *, force: bool
) -> WrittenProgram | None:
    from cnc_shape.units import MICROMETRE

    if target is not None and target.suffix.lower() in PROGRAMS:
        from cnc_shape.writers.program import write_program

        tolerance = MICROMETRE * (1.0 if tolerance_um is None else tolerance_um)
        return write_program(target, work.blocks(), tolerance=tolerance, remarks=remarks, force=force)
    from cnc_shape.writers.samples import stream_csv, write_csv, write_npz

    if target is None:
        import sys

        stream_csv(sys.stdout.buffer.write, work.blocks())
        sys.stdout.buffer.flush()
    elif target.suffix.lower() == ".csv":
        write_csv(target, work.blocks(), force=force)
    else:
        write_npz(target, work.blocks(), force=force)
    return None
