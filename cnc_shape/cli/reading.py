"""Names on the command line become options of the readers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from cnc_shape.cli.options import MACHINE_SUFFIXES
from cnc_shape.errors import OptionError
from cnc_shape.readers import Curve, ReadingOptions
from cnc_shape.readers.gcode import Dialect, GcodeOptions
from cnc_shape.readers.source import ReadingLimits
from cnc_shape.tools import Tool


def named_options(
    dialect: str, path: str, tools: Sequence[Tool], *, block_delete: bool, closed: bool
) -> ReadingOptions:
    """Options of the command line as the reader's.

    Raises
    ------
    OptionError
        An unknown dialect or way of joining way-points.
    """
    known = {"auto": None, **{member.value: member for member in Dialect}}
    if dialect not in known:
        raise OptionError(f"unknown dialect {dialect!r}", hint="there are " + ", ".join(known))
    curves = {member.value: member for member in Curve}
    if path not in curves:
        raise OptionError(f"--path is {' or '.join(curves)}, not {path!r}", hint="take --path polyline")
    gcode = GcodeOptions(dialect=known[dialect], block_delete=block_delete, tools=tuple(tools))
    return ReadingOptions(gcode=gcode, curve=curves[path], closed=closed)


def limited(
    options: ReadingOptions,
    *,
    blocks: int | None,
    file_bytes: int | None,
    line_bytes: int | None,
    coordinate: float | None,
) -> ReadingOptions:
    """Replace the limits that are given; the others stay.

    Raises
    ------
    OptionError
        A limit that is not positive.
    """
    limits = ReadingLimits()
    for option, value in (
        ("--max-blocks", blocks), ("--max-file-bytes", file_bytes), ("--max-line-bytes", line_bytes),
        ("--max-coordinate-mm", coordinate),
    ):  # fmt: skip
        if value is not None and not 0 < value < float("inf"):
            raise OptionError(f"{option} {value:g} is no limit", hint="give a positive number")
    return replace(
        options,
        limits=replace(
            limits,
            blocks=blocks or limits.blocks,
            file_bytes=file_bytes or limits.file_bytes,
            line_bytes=line_bytes or limits.line_bytes,
            coordinate=coordinate or limits.coordinate,
        ),
    )


def sole_program(files: Sequence[str], option: str, target: str) -> None:
    """Refuse an option that writes a file about one program where there are more, or where it is the program.

    Raises
    ------
    OptionError
        Several files, a machine file, or a target that is the input.
    """
    if len(files) > 1 or Path(files[0]).suffix.lower() in MACHINE_SUFFIXES:
        raise OptionError(f"{option} takes one program", hint="check one file at a time")
    if Path(target).exists() and Path(files[0]).exists() and Path(target).samefile(files[0]):
        raise OptionError(
            f"{target} is the input itself", hint="name another output: inputs are never overwritten"
        )
