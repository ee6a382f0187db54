"""How a command ends: every way to fail becomes one line, a hint and an exit code."""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Callable
from contextlib import suppress
from typing import Final

import typer

from cnc_shape.cli.output import print_json
from cnc_shape.errors import CncShapeError, OptionError, OutputError
from cnc_shape.report.text import one_line

DONE: Final = 0
GATE_FAILED: Final = 1
WRONG_INPUT: Final = 2
BUG: Final = 70
INTERRUPTED: Final = 130  # 128 + SIGINT
BROKEN_PIPE: Final = 141  # 128 + SIGPIPE: whoever read the output has left
TERMINATED: Final = 143  # 128 + SIGTERM

# typer holds its own copy of click since 0.26 and wraps the public one before. Its classes are named here by
# descent (BadParameter is a UsageError is a ClickException), so that either will do.
_ClickException: Final = typer.BadParameter.__mro__[2]


class Terminated(BaseException):
    """The process was asked to end by SIGTERM."""


class _InterruptedError(CncShapeError):
    code = "interrupted"


class _BugError(CncShapeError):
    code = "bug"


def error_object(error: CncShapeError) -> dict[str, object]:
    """Return `error` as the object that ``--json`` prints."""
    return {
        "code": error.code,
        "message": error.reason,
        "file": error.source,
        "line": error.line,
        "column": error.column,
        "hint": error.hint,
    }


def report_error(error: CncShapeError, *, json: bool) -> None:
    """Say `error` and its hint on stderr, one line each, and on stdout as JSON where asked for."""
    lines = [str(error)] if error.hint is None else [str(error), f"hint: {error.hint}"]
    with suppress(OSError):  # nobody is left to tell
        sys.stderr.write("".join(one_line(line) + "\n" for line in lines))
    if json:
        print_json(None, {"error": error_object(error)})


def guarded(command: Callable[[], object], *, json: bool) -> int:
    """Run `command`; return its exit code, or the one that belongs to what it raised."""
    try:
        status = _attempt(command, json=json)
        sys.stdout.flush()
    except BrokenPipeError:
        _close_output()
        return BROKEN_PIPE
    except OSError as fault:
        _close_output()
        report_error(_stream_error(fault), json=False)
        return WRONG_INPUT
    return status


def _stream_error(fault: OSError) -> OutputError:
    reason = (fault.strerror or str(fault)).lower()
    return OutputError(
        f"cannot write to standard output: {reason}", hint="check the disk or the program behind it"
    )


def _attempt(command: Callable[[], object], *, json: bool) -> int:
    try:
        status = command()
    except BrokenPipeError:
        raise
    except CncShapeError as error:
        report_error(error, json=json)
        return WRONG_INPUT
    except (KeyboardInterrupt, typer.Abort):
        status = INTERRUPTED
    except Terminated:
        report_error(_InterruptedError("terminated"), json=json)
        return TERMINATED
    except SystemExit as leaving:
        if isinstance(leaving.__context__, BrokenPipeError):  # typer turns one into exit code 1
            raise leaving.__context__ from None
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.filename is None:  # a stream: whatever has a name is known
            raise
        if isinstance(error, _ClickException):
            report_error(_usage(error), json=json)
            return WRONG_INPUT
        ended = _interruption(error)
        if ended is None:
            return _bug(error, json=json)
        report_error(_InterruptedError("terminated" if ended == TERMINATED else "interrupted"), json=json)
        return ended
    if status == INTERRUPTED:  # also what typer makes of a KeyboardInterrupt
        report_error(_InterruptedError("interrupted"), json=json)
    return status if isinstance(status, int) else DONE


def _interruption(error: BaseException) -> int | None:
    """Exit code of a signal that came while compiled code ran, which wraps it in an error of its own."""
    inner = error.__cause__ or error.__context__
    while inner is not None:
        if isinstance(inner, KeyboardInterrupt | Terminated):
            return TERMINATED if isinstance(inner, Terminated) else INTERRUPTED
        inner = inner.__cause__ or inner.__context__
    return None


def _usage(error: Exception) -> OptionError:
    """Return what typer found wrong with the command line, said in our words."""
    message = " ".join(str(getattr(error, "format_message")()).split()).rstrip(".")  # noqa: B009  # see _ClickException
    context = getattr(error, "ctx", None)
    name = "cnc-shape" if context is None else context.command_path
    return OptionError(message[:1].lower() + message[1:], hint=f"{name} --help lists what there is")


def _bug(error: Exception, *, json: bool) -> int:
    if os.environ.get("CNC_SHAPE_DEBUG") == "1":
        traceback.print_exception(error)
    what = f"a bug in cnc-shape: {type(error).__name__}: {error}"
    report_error(
        _BugError(what, hint="please report it; with CNC_SHAPE_DEBUG=1 it says where it happened"), json=json
    )
    return BUG


def _close_output() -> None:
    """Point stdout at nothing, so that the interpreter's last flush has nowhere to fail."""
    sys.stdout = sys.__stdout__
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    os.close(nothing)
