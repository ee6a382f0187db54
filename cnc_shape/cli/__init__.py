r"""The command line: one file a command, and the table that registers them.

A command is a plain function: its signature is its options, its docstring its help. It loads, calls the
floors below and renders; it returns None, or the exit code where that is not 0. Whatever is heavy (numpy,
numba, pydantic, yaml, rich) is imported inside the function, so that ``--help`` and ``--version`` answer at
once. In a docstring write ``\[`` for ``[``: help is rich markup.
"""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Callable, Sequence
from types import FrameType
from typing import Annotated, Final

import typer

from cnc_shape import __version__
from cnc_shape.cli.apply import apply
from cnc_shape.cli.check import check
from cnc_shape.cli.design import design
from cnc_shape.cli.doctor import doctor
from cnc_shape.cli.errors import WRONG_INPUT, Terminated, guarded
from cnc_shape.cli.init import init
from cnc_shape.cli.output import print_text
from cnc_shape.cli.reproduce import reproduce
from cnc_shape.cli.simulate import simulate

COMMANDS: Final[tuple[Callable[..., int | None], ...]] = (
    simulate, apply, design, check, reproduce, init, doctor,
)  # fmt: skip

GARBAGE_THRESHOLD: Final = 20_000  # objects made before the first generation is searched

app = typer.Typer(
    name="cnc-shape",
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        print_text(f"cnc-shape {__version__}")
        raise typer.Exit


@app.callback()
def cnc_shape(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and stop.")
    ] = False,
) -> None:
    """From a G-code program to its contour error: motion, input shaping, servo and structure."""
    if context.invoked_subcommand is None:
        if text := context.get_help():
            print_text(text)
        raise typer.Exit(WRONG_INPUT)


for _command in COMMANDS:
    app.command(name=_command.__name__)(_command)


def run(arguments: Sequence[str]) -> int:
    """Run one command line (without the program's name) and return its exit code."""
    words = list(arguments)

    def command() -> object:  # to build it takes a while, in which a signal may come
        built = typer.main.get_command(app)
        return built.main(args=words, prog_name="cnc-shape", standalone_mode=False)

    return guarded(command, json="--json" in words)


def _terminate(signum: int, frame: FrameType | None) -> None:
    raise Terminated


def start_quickly() -> None:
    """Settle what must be settled before anything heavy is imported.

    Modules are hundreds of thousands of objects that stay: to search them for garbage after every few hundred
    is a tenth of a short run. And all matrices here are of a few rows, for which the threads of a BLAS only
    wait for each other, milliseconds each where the machine is busy; whoever sets their number has it.
    The loops of the kernels run over a few axes, too: code for vectors takes longer to compile and to run.
    """
    gc.set_threshold(GARBAGE_THRESHOLD, 10, 10)
    for library in ("OPENBLAS", "MKL"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    os.environ.setdefault("NUMBA_LOOP_VECTORIZE", "0")


def main() -> None:
    """Run the command line of this process and leave with its exit code."""
    start_quickly()
    signal.signal(signal.SIGTERM, _terminate)
    sys.stdout = sys.stdout or open(os.devnull, "w")  # noqa: SIM115  # closed by whoever started us
    sys.stderr = sys.stderr or open(os.devnull, "w")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):  # a file name need not be text
        if reconfigure := getattr(stream, "reconfigure", None):
            reconfigure(errors="backslashreplace")
    status = run(sys.argv[1:])
    gc.freeze()  # the interpreter need not search what it is about to drop: a quarter of a second
    sys.exit(status)
