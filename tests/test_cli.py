"""The command line: at once, one line of error with a hint, and an exit code that can be relied on."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import typer
from answers import hearing_signals

from cnc_shape import __version__, cli
from cnc_shape.cli import run
from cnc_shape.cli.errors import guarded
from cnc_shape.cli.output import one_line, print_json
from cnc_shape.cli.progress import line_by_line, progress
from cnc_shape.config import bundled, check_machine, load_machine
from cnc_shape.errors import InfeasibleError, ProgramError
from cnc_shape.opening import open_motion
from cnc_shape.readers import ReadingOptions

HEAVY = ("numpy", "numba", "scipy", "pydantic", "yaml", "matplotlib", "jinja2")
HELP_TIME = 0.3  # s of one processor
ROOT = Path(__file__).resolve().parent.parent


def python(code: str, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env={**os.environ, **environment},
        timeout=300,  # the first run compiles
        check=False,
    )


def raising(error: BaseException) -> Callable[[], object]:
    def command() -> object:
        raise error

    return command


ASK = f"""
import sys
from cnc_shape.cli import run
status = run(sys.argv[1:])
loaded = [name for name in {HEAVY!r} if name in sys.modules]
sys.stderr.write(repr((status, loaded)))
"""


@pytest.mark.parametrize(("error", "status"), [(KeyboardInterrupt(), 130), (cli.Terminated(), 143)])
def test_a_signal_while_the_command_line_is_built(
    error: BaseException, status: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(typer.main, "get_command", lambda app: raising(error)())
    assert run(["--version"]) == status


@pytest.mark.parametrize(("word", "status"), [("--help", 0), ("--version", 0), ("--nonsense", 2)])
def test_nothing_heavy_is_imported_to_answer(word: str, status: int) -> None:
    done = python(ASK, word)
    assert done.stderr.endswith(f"({status}, [])"), done.stderr


@pytest.mark.parametrize("command", cli.COMMANDS, ids=lambda command: command.__name__)
def test_nothing_heavy_is_imported_to_explain_a_command(command: Callable[..., object]) -> None:
    done = python(ASK, command.__name__, "--help")
    assert done.stderr.endswith(("(0, [])", "(0, ['pydantic'])")), (
        done.stderr
    )  # typer itself may use pydantic


@pytest.mark.parametrize(
    ("words", "spared"),
    [
        (["check", "samples/bracket.nc"], ("numba", "scipy", "matplotlib", "jinja2", "yaml")),
        (["simulate", "samples/bracket.nc"], ("matplotlib", "jinja2", "scipy.signal", "scipy.optimize")),
    ],
)
def test_a_command_imports_no_more_than_it_needs(words: list[str], spared: tuple[str, ...]) -> None:
    ask = ASK.replace(repr(HEAVY), repr(spared))
    done = python(ask, *words, "--quiet")
    assert done.stderr.endswith("(0, [])"), done.stderr


def test_help_is_there_at_once() -> None:
    used: list[float] = []
    for _ in range(3):
        before = os.times()
        assert python("from cnc_shape.cli import main; main()", "--help").returncode == 0
        after = os.times()
        used.append(
            after.children_user - before.children_user + after.children_system - before.children_system
        )
    assert min(used) < HELP_TIME  # processor time: others may keep the machine busy


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--version"]) == 0
    assert capsys.readouterr() == (f"cnc-shape {__version__}\n", "")


def test_no_command_prints_the_help_and_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([]) == 2
    assert "init" in capsys.readouterr().out


def test_every_command_has_a_help_and_json() -> None:
    commands = typer.main.get_command(cli.app).commands  # pyright: ignore[reportAttributeAccessIssue]
    assert set(commands) == {command.__name__ for command in cli.COMMANDS}
    for command in commands.values():
        assert command.help
        assert "--json" in [option for parameter in command.params for option in parameter.opts]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["nonsense"], "error: no such command 'nonsense'"),
        (["--nonsense"], "error: no such option: --nonsense"),
        (["init", "--nonsense"], "error: no such option: --nonsense"),
        (["init", "a.yaml", "b.yaml"], "error: got unexpected extra argument"),
    ],
)
def test_wrong_usage_is_one_line_and_a_hint(
    words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(words) == 2
    out, err = capsys.readouterr()
    first, second = err.splitlines()
    assert out == ""
    assert first.startswith(message)
    assert second.startswith("hint: cnc-shape ")
    assert "--help" in second


def test_wrong_usage_is_told_as_json_too(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["nonsense", "--json"]) == 2
    out, err = capsys.readouterr()
    error = json.loads(out)["error"]
    assert list(error) == ["code", "message", "file", "line", "column", "hint"]
    assert error["code"] == "option"
    assert "error: " + error["message"] == err.splitlines()[0]


def test_an_error_of_a_file_names_its_place(capsys: pytest.CaptureFixture[str]) -> None:
    error = ProgramError("part.nc", 17, 9, "G2 needs R or I/J", hint="give R, or I and J")
    assert guarded(raising(error), json=True) == 2
    out, err = capsys.readouterr()
    assert err == "part.nc:17:9: error: G2 needs R or I/J\nhint: give R, or I and J\n"
    assert json.loads(out) == {
        "error": {
            "code": "program",
            "message": "G2 needs R or I/J",
            "file": "part.nc",
            "line": 17,
            "column": 9,
            "hint": "give R, or I and J",
        }
    }


def test_text_of_a_file_cannot_reach_the_terminal_as_control(capsys: pytest.CaptureFixture[str]) -> None:
    error = ProgramError("a\nb.nc", 1, 1, "\x1b[2J\r\u202e\ud800 is no word", hint="\x07")
    assert guarded(raising(error), json=False) == 2
    assert capsys.readouterr().err == (
        "a\\nb.nc:1:1: error: \\x1b[2J\\r\\u202e\\ud800 is no word\nhint: \\x07\n"
    )
    assert one_line("µm, 30 °C") == "µm, 30 °C"


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (InfeasibleError("too fast"), 2),
        (KeyboardInterrupt(), 130),
        (typer.Abort(), 130),
        (cli.Terminated(), 143),
        (ZeroDivisionError("division by zero"), 70),
        (ValueError("x.shape=(3,)"), 70),
        (RecursionError(), 70),
        (MemoryError(), 70),
    ],
    ids=lambda value: type(value).__name__,
)
def test_every_way_to_end_has_its_exit_code(
    error: BaseException, status: int, capsys: pytest.CaptureFixture[str]
) -> None:
    assert guarded(raising(error), json=True) == status
    out, err = capsys.readouterr()
    assert json.loads(out)["error"]["message"]
    assert "Traceback" not in err
    assert len(err.splitlines()) <= 2


def test_a_bug_says_so_and_shows_its_place_only_when_asked(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    guarded(raising(ZeroDivisionError("division by zero")), json=False)
    assert capsys.readouterr().err.startswith(
        "error: a bug in cnc-shape: ZeroDivisionError: division by zero\nhint: please report it"
    )
    monkeypatch.setenv("CNC_SHAPE_DEBUG", "1")
    guarded(raising(ZeroDivisionError("division by zero")), json=False)
    assert "Traceback" in capsys.readouterr().err


def test_a_command_returns_its_exit_code() -> None:
    assert guarded(lambda: 1, json=False) == 1
    assert guarded(lambda: None, json=False) == 0


ENDLESS = """
import time
from cnc_shape.cli import app, main
@app.command()
def endless():
    "Run for ever."
    print("ready", flush=True)
    time.sleep(60)
main()
"""


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_end_a_command_quietly(number: signal.Signals, status: int) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", ENDLESS, "endless"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
        preexec_fn=hearing_signals,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        process.send_signal(number)
        _, err = process.communicate(timeout=30)
    assert process.returncode == status
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize("words", [["--version"], ["--help"], ["init", "-"]], ids=lambda words: words[0])
def test_a_reader_that_leaves_is_no_error(words: list[str]) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, "-m", "cnc_shape", *words],
        stdout=writing,
        stderr=subprocess.PIPE,
        cwd=ROOT,
        check=False,
    )
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, b"")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full here")
@pytest.mark.parametrize("words", [["--version"], ["--help"], ["init", "-"]], ids=lambda words: words[0])
def test_a_full_disk_behind_standard_output_is_told(words: list[str]) -> None:
    command = [sys.executable, "-m", "cnc_shape", *words]
    with open("/dev/full", "w") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, cwd=ROOT, text=True, check=False)
    assert done.returncode == 2
    first, second = done.stderr.splitlines()
    assert first == "error: cannot write to standard output: no space left on device"
    assert second.startswith("hint: ")


@pytest.mark.skipif(os.name == "nt", reason="needs a POSIX shell")
@pytest.mark.parametrize(("closed", "status"), [(">&-", 0), ("2>&-", 0), (">&- 2>&-", 0)])
def test_closed_streams_are_no_bug(closed: str, status: int) -> None:
    done = subprocess.run(
        f'"{sys.executable}" -m cnc_shape --version {closed}', shell=True, cwd=ROOT, check=False
    )
    assert done.returncode == status


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_json_has_no_nan(value: float) -> None:
    with pytest.raises(ValueError, match="JSON compliant"):
        print_json("check", {"length_mm": value})


def test_the_schema_comes_first(capsys: pytest.CaptureFixture[str]) -> None:
    print_json("check", {"a": 1})
    assert list(json.loads(capsys.readouterr().out).items()) == [("schema", "cnc-shape/check/1"), ("a", 1)]


def test_no_colour_is_honoured() -> None:
    for environment, coloured in (({"NO_COLOR": "1"}, False), ({"NO_COLOR": ""}, True)):
        done = python(
            "from cnc_shape.cli import main; main()", "--help", FORCE_COLOR="1", TERM="xterm", **environment
        )
        assert (re.search(r"\x1b\[[0-9;]*3[0-7]m", done.stdout) is not None) is coloured


class Terminal:
    """A stderr that a person watches."""

    def __init__(self) -> None:
        self.text = ""

    def write(self, text: str) -> int:
        self.text += text
        return len(text)

    def flush(self) -> None: ...

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(
    ("terminal", "quiet", "seen"), [(True, False, True), (True, True, False), (False, False, False)]
)
def test_progress_is_for_people(
    terminal: bool, quiet: bool, seen: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    stream = Terminal()
    stream.isatty = lambda: terminal  # type: ignore[method-assign]
    monkeypatch.setattr(sys, "stderr", stream)
    with progress("planning", 2.0, quiet=quiet) as advance:
        advance(1.0)
    assert ("planning" in stream.text) is seen


def test_the_bar_advances_by_the_lines_of_the_program(tmp_path: Path) -> None:
    program = tmp_path / "part.nc"
    program.write_text("G21 G90 F600\n" + "G1 X1\n(to and fro)\nX0\n" * 10 + "M2\n")
    advances: list[float] = []
    with open_motion(str(program), load_machine(bundled("xy_stage.yaml")), ReadingOptions(rows=4)) as motion:
        for _ in line_by_line(motion.blocks, advances.append):
            pass
    assert len(advances) > 2
    assert min(advances) >= 0
    assert sum(advances) == motion.lines - 1  # the last line moves nothing


# --- init


def test_init_writes_a_machine_that_passes_check(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["init"]) == 0
    assert "machine.yaml" in capsys.readouterr().out
    assert check_machine("machine.yaml")["warnings"] == []
    assert run(["init", "mill", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"schema": "cnc-shape/init/1", "output": "mill.yaml"}
    assert sorted(os.listdir()) == ["machine.yaml", "mill.yaml"]


def test_init_replaces_nothing_unasked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("machine.yaml").write_text("mine")
    assert run(["init"]) == 2
    assert "--force" in capsys.readouterr().err
    assert Path("machine.yaml").read_text() == "mine"
    assert run(["init", "--force"]) == 0
    assert check_machine("machine.yaml")


@pytest.mark.parametrize("name", ["part.nc", "", ".", "..", "no/such/folder/m.yaml", "a\0b"])
def test_init_refuses_what_is_no_machine_file(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["init", name]) == 2
    assert "hint: " in capsys.readouterr().err
    assert os.listdir() == []


def test_init_to_standard_output(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["init", "-"]) == 0
    assert capsys.readouterr().out.startswith("# A machine")
    assert run(["init", "-", "--json"]) == 2
