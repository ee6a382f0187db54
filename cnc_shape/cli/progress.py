"""Progress on stderr, where a person watches."""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager

Advance = Callable[[float], None]


def _say_that_kernels_compile() -> None:
    sys.stderr.write(
        "compiling the numerical kernels for this processor, once; cnc-shape doctor --warm does it ahead\n"
    )


@contextmanager
def progress(what: str, total: float | None, *, quiet: bool) -> Generator[Advance]:
    """Show a bar for `what`; the body calls the value with how much of `total` it has just done.

    Where the body has to compile kernels, which happens once and takes its time, one line says so.

    Parameters
    ----------
    what
        Named beside the bar.
    total
        How much there is to do, in any unit, or None where that is not known.
    quiet
        Show and say nothing (``--quiet``, ``--json``). No bar is shown either unless stderr is a terminal.
    """
    if quiet:
        yield lambda amount: None
        return
    from cnc_shape.kernels import compilation_told

    with compilation_told(_say_that_kernels_compile), _bar(what, total) as advance:
        yield advance


@contextmanager
def _bar(what: str, total: float | None) -> Generator[Advance]:
    if not sys.stderr.isatty():
        yield lambda amount: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=total)
        yield lambda amount: bar.advance(task, amount)
