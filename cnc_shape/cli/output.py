"""What goes to stdout: one JSON object, or text. Nothing else does."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Mapping

from cnc_shape.report.text import one_line


def print_json(command: str | None, result: Mapping[str, object]) -> None:
    """Print `result` as one JSON object, its schema ``cnc-shape/<command>/1`` first.

    Parameters
    ----------
    command
        The command that speaks, or None for an object without a schema (an error).
    result
        What it says. NaN and infinity are refused: they are no JSON.

    Raises
    ------
    ValueError
        `result` holds a NaN or an infinity.
    """
    schema = {} if command is None else {"schema": f"cnc-shape/{command}/1"}
    print_text(json.dumps({**schema, **result}, indent=2, allow_nan=False))


def print_text(text: str) -> None:
    """Print `text` and end the line."""
    sys.stdout.write(text if text.endswith("\n") else text + "\n")


def print_error(text: str) -> None:
    """Print one line on stderr."""
    sys.stderr.write(one_line(text) + "\n")


def warn(warnings: Iterable[str], *, quiet: bool) -> None:
    """Print warnings on stderr, one line each."""
    if not quiet:
        for warning in warnings:
            print_error(warning)
