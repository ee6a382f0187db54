"""Command lines for tests: run one in this process, and what it says."""

from __future__ import annotations

import json
import signal

from cnc_shape.cli import run


def answer(capfd, *words: str, code: int = 0):
    """Run a command with --json and return its object."""
    assert run([*words, "--json"]) == code
    return json.loads(capfd.readouterr().out)


def refused(capfd, *words: str) -> str:
    """Run a command that must be refused; return what it said."""
    assert run([*words]) == 2
    plain = capfd.readouterr()
    assert plain.out == ""
    assert "Traceback" not in plain.err
    error = answer(capfd, *words, code=2)["error"]
    assert set(error) == {"code", "message", "file", "line", "column", "hint"}
    assert error["message"] in plain.err
    return plain.err


def hearing_signals() -> None:
    """Let a child be interrupted, even where the tests themselves run in the background and must not be."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
