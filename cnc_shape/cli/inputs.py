"""Options of reading, and warnings, as the command line has them."""

from __future__ import annotations

import sys
from collections.abc import Iterable

from cnc_shape.cli.output import one_line
from cnc_shape.config.setup import Setup
from cnc_shape.errors import OptionError
from cnc_shape.readers import Curve, ReadingOptions
from cnc_shape.readers.gcode import Dialect, GcodeOptions


def reading_options(
    dialect: str, path: str, setup: Setup, *, block_delete: bool, closed: bool
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
        raise OptionError(f"--path is {' or '.join(curves)}, not {path!r}")
    gcode = GcodeOptions(dialect=known[dialect], block_delete=block_delete, tools=setup.tools)
    return ReadingOptions(gcode=gcode, curve=curves[path], closed=closed)


def warn(warnings: Iterable[str], *, quiet: bool) -> None:
    """Print warnings on stderr, one line each."""
    if not quiet:
        for warning in warnings:
            sys.stderr.write(one_line(warning) + "\n")
