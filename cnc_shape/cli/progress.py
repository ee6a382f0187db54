"""Progress on stderr, where a person watches."""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager

Advance = Callable[[float], None]


def announce_compilation(*, quiet: bool) -> None:
    """Say so when the kernels have to be compiled first: it happens once, and takes its time."""
    from cnc_shape.kernels import compiled_before

    if not quiet and not compiled_before():
        sys.stderr.write("compiling the numerical kernels for this processor, once: some twenty seconds\n")


@contextmanager
def progress(what: str, total: float | None, *, quiet: bool) -> Generator[Advance]:
    """Show a bar for `what`; the body calls the value with how much of `total` it has just done.

    Parameters
    ----------
    what
        Named beside the bar.
    total
        How much there is to do, in any unit, or None where that is not known.
    quiet
        Show nothing (``--quiet``, ``--json``). Nothing is shown either unless stderr is a terminal.
    """
    if quiet or not sys.stderr.isatty():
        yield lambda amount: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=total)
        yield lambda amount: bar.advance(task, amount)
