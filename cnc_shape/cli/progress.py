"""Progress on stderr, where a person watches."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol, TypeVar

from cnc_shape.cli.output import print_error

if TYPE_CHECKING:
    from cnc_shape.toolpath import Toolpath

Advance = Callable[[float], None]


class _Stretch(Protocol):
    """What may bring a piece of the program along."""

    @property
    def toolpath(self) -> Toolpath | None: ...


S = TypeVar("S", bound=_Stretch)


class _Told(logging.Handler):
    """What the kernels log, on stderr."""

    def emit(self, record: logging.LogRecord) -> None:
        print_error(record.getMessage())


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
    kernels, told = logging.getLogger("cnc_shape.kernels"), _Told()
    level = kernels.level
    kernels.addHandler(told)
    kernels.setLevel(logging.INFO)
    try:
        with _bar(what, total) as advance:
            yield advance
    finally:
        kernels.setLevel(level)
        kernels.removeHandler(told)


def line_by_line(blocks: Iterable[S], advance: Advance) -> Iterator[S]:
    """Hand on the stretches of a motion; advance by the lines of the program that each has brought."""
    done = 0
    for block in blocks:
        yield block
        if block.toolpath is not None and len(block.toolpath):
            line = max(done, int(block.toolpath.line[-1]))
            advance(line - done)
            done = line


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
