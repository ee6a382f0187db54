"""``cnc-shape apply``: a program's shaped axis commands as a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cnc_shape.cli.options import BlockDelete, Closed, Dialect, Force, Json, Machine, PathStyle, Quiet

if TYPE_CHECKING:
    from cnc_shape.applying import Application, Applied

SUFFIXES = (".csv", ".npz")


def apply(
    file: Annotated[
        str | None,
        typer.Argument(metavar="FILE", help="G-code or CSV; - for standard input.", show_default=False),
    ] = None,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="OUT.csv or OUT.npz; - for CSV on standard output.")
    ] = None,
    machine: Machine = None,
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
    """Shape a program's axis commands and write them at the servo period."""
    if stream:
        from cnc_shape.cli.streaming import stream_samples

        stream_samples(file, output, machine, interpolation, sample_time_s, json=json, quiet=quiet)
        return
    from cnc_shape.applying import Application
    from cnc_shape.cli.output import print_json, print_text, warn
    from cnc_shape.cli.progress import line_by_line, progress
    from cnc_shape.cli.reading import named_options
    from cnc_shape.config.machine_file import load_machine
    from cnc_shape.errors import OptionError
    from cnc_shape.opening import open_motion

    if file is None:
        raise OptionError("missing argument 'FILE'", hint="name a program, or - for standard input")
    if interpolation is not None or sample_time_s is not None:
        raise OptionError(
            "--interpolation and --sample-time-s are for live samples", hint="give --stream, too"
        )
    if json and output == "-":
        raise OptionError("--json and -o - both want standard output", hint="name a file for the samples")
    target = _target(file, output, force=force)
    setup = load_machine(machine)
    options = named_options(dialect, path, setup.tools, block_delete=block_delete, closed=closed)
    kind = setup.planning.shaping
    with (
        open_motion(file, setup, options, [setup.timing(kind)]) as motion,
        progress("applying", motion.lines, quiet=quiet or json) as advance,
    ):
        blocks = line_by_line(motion.blocks, advance)
        work = Application(blocks, setup.machine, setup.command_shaping(kind), setup.control.sample_time)
        _write(work, target, force=force)
        done = work.summary()
    notes = [] if setup.acting_shapers else ["this machine has no shapers: the command is written unshaped"]
    warn([*motion.warnings(), *notes], quiet=quiet)
    if json:
        print_json("apply", _result(done, target))
    elif target is not None:
        print_text(_text(done, target))


def _target(file: str, output: str | None, *, force: bool) -> Path | None:
    """The file to write, or None for standard output."""
    from cnc_shape.errors import OptionError
    from cnc_shape.writers.publish import check_target

    if output == "-":
        return None
    if output is None:
        stem = Path("stdin" if file == "-" else file).stem
        if Path(file).suffix.lower() != ".csv":
            raise OptionError(
                "writing a shaped .nc program is not built yet", hint=f"name the output: -o {stem}.shaped.csv"
            )
        output = f"{stem}.shaped.csv"
    target = Path(output)
    if target.suffix.lower() not in SUFFIXES:
        hint = "use .csv or .npz" + (
            "; .nc is not built yet" if target.suffix.lower() in (".nc", ".ngc") else ""
        )
        raise OptionError(f"cannot write {target.suffix or 'a file without suffix'}: {output}", hint=hint)
    if file != "-" and target.exists() and Path(file).exists() and target.samefile(file):
        raise OptionError(
            f"{output} is the input itself", hint="name another output: inputs are never overwritten"
        )
    check_target(target, force=force)
    return target


def _write(work: Application, target: Path | None, *, force: bool) -> None:
    from cnc_shape.writers.samples import stream_csv, write_csv, write_npz

    if target is None:
        import sys

        stream_csv(sys.stdout.buffer.write, work.blocks())
        sys.stdout.buffer.flush()
    elif target.suffix.lower() == ".csv":
        write_csv(target, work.blocks(), force=force)
    else:
        write_npz(target, work.blocks(), force=force)


def _result(done: Applied, target: Path | None) -> dict[str, Any]:
    from cnc_shape.units import MICROMETRE

    return {
        "cycle_time_s": done.cycle_time,
        "shaped_time_s": done.shaped_time,
        "samples": done.samples,
        "sample_time_s": done.sample_time,
        "axes": list(done.axes),
        "command_contour_rms_um": done.command.rms / MICROMETRE,
        "command_contour_max_um": done.command.max / MICROMETRE,
        "worst_limit_violation": done.worst_limit_violation,
        "shaped_acceleration_ratio": done.shaped_acceleration_ratio,
        "output": "-" if target is None else str(target),
    }


def _text(done: Applied, target: Path) -> str:
    from cnc_shape.units import MICROMETRE

    return "\n".join(
        (
            f"{target}: {done.samples} samples of {', '.join(axis.upper() for axis in done.axes)}",
            f"  {done.shaped_time:.3f} s shaped, {done.cycle_time:.3f} s unshaped",
            f"  command leaves the path by up to {done.command.max / MICROMETRE:.2f} µm "
            f"({done.command.rms / MICROMETRE:.2f} µm RMS)",
            f"  largest acceleration {done.shaped_acceleration_ratio:.1%} of its limit",
        )
    )
