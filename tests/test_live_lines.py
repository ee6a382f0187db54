"""``apply --stream``: a line out for every line in, at once, and the tail after the end."""

from __future__ import annotations

import io
import os
import re
import selectors
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from answers import hearing_signals
from commands import trapezoid
from numpy.testing import assert_array_equal

from cnc_shape.cli import run
from cnc_shape.config.bundled import bundled
from cnc_shape.config.machine_file import load_machine
from cnc_shape.shapers.discretisation import Interpolation
from cnc_shape.shapers.live import filters, shape_samples

ROOT = Path(__file__).resolve().parents[1]
PATIENCE = 60.0  # s, for a machine that is busy
MACHINE = """
name: one soft axis
axes:
  x:
    limits: {velocity_mm_s: 500, acceleration_mm_s2: 5000}
    modes: [{frequency_hz: 33.7, damping_ratio: 0.02}]
    shaper: {type: zv}
  a:
    limits: {velocity_deg_s: 90, acceleration_deg_s2: 900}
    modes: [{frequency_hz: 20, damping_ratio: 0.1}]
    shaper: {type: zvd}
"""


@pytest.fixture
def place(tmp_path, monkeypatch) -> Path:
    """A fresh working folder with a machine file, which the commands take."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "soft.yaml").write_text(MACHINE)
    monkeypatch.setenv("CNC_SHAPE_MACHINE", str(tmp_path / "soft.yaml"))
    return tmp_path


def feed(monkeypatch, text: str | bytes) -> None:
    data = text.encode() if isinstance(text, str) else text
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(data)))


def streamed(monkeypatch, capfd, text: str, *words: str) -> tuple[str, np.ndarray, str]:
    """Run the stream over a text; return header, numbers and what it said."""
    feed(monkeypatch, text)
    assert run(["apply", "--stream", *words]) == 0
    said = capfd.readouterr()
    header, *lines = said.out.splitlines()
    return header, np.array([line.split(",") for line in lines], dtype=float), said.err


def broken(monkeypatch, capfd, text: str | bytes, *words: str) -> tuple[list[str], str]:
    """Run a stream that must end in an error; return its lines and what it said."""
    feed(monkeypatch, text)
    assert run(["apply", "--stream", *words]) == 2
    said = capfd.readouterr()
    assert "Traceback" not in said.err
    return said.out.splitlines(), said.err


def table(positions, sample_time=1e-3, header="time_s,x_mm,a_deg", scale=1.0) -> str:
    rows = [
        ",".join([repr(round(k * sample_time * scale, 9)), *map(repr, row)])
        for k, row in enumerate(positions.tolist())
    ]
    return "\n".join([header, *rows]) + "\n"


def move(sample_time=1e-3, count=160) -> np.ndarray:
    """A move of the first axis and noise on the second."""
    x = trapezoid(np.arange(count) * sample_time, 8.0, 100.0, 2000.0)[0]
    return np.column_stack([x, np.random.default_rng(7).normal(size=count)])


def expected(positions, sample_time=1e-3, way=Interpolation.EXACT, axes=("x", "a")) -> np.ndarray:
    setup = load_machine("soft.yaml")
    modes = {axis.name: axis.modes for axis in setup.machine.axes}
    return shape_samples(positions, filters(setup.acting_shapers, axes, sample_time, way, modes))


@pytest.mark.parametrize("way", [None, *Interpolation], ids=lambda way: way.value if way else "default")
def test_lines_are_the_samples_shaped_as_a_whole_bit_for_bit(place, monkeypatch, capfd, way):
    positions = move()
    words = [] if way is None else ["--interpolation", way.value]
    header, rows, _ = streamed(monkeypatch, capfd, table(positions), *words)
    whole = expected(positions, way=way or Interpolation.EXACT)
    assert header == "time_s,x_mm,a_deg"
    assert_array_equal(rows[0, 1:], positions[0])
    assert_array_equal(rows[1:, 1:], whole[1:])
    assert_array_equal(rows[:, 0], [round(k * 1e-3, 12) for k in range(len(whole))])


@pytest.mark.parametrize("sample_time", [0.25e-3, 1.7e-3, 4e-3])
def test_any_interval_that_the_times_tell(place, monkeypatch, capfd, sample_time):
    positions = move(sample_time, 60)
    _, rows, _ = streamed(monkeypatch, capfd, table(positions, sample_time))
    # 0.0017 - 0 is the interval; later differences are not to the last bit
    assert_array_equal(rows[1:, 1:], expected(positions, sample_time)[1:])


def test_times_with_few_decimals_mean_the_servo_period(place, monkeypatch, capfd):
    (place / "soft.yaml").write_text(MACHINE + "control: {sample_time_s: 0.00033333333333}\n")
    positions = move(1e-3 / 3, 40)
    text = table(positions, header="time_ms,x_mm,a_deg")
    lines = [text.splitlines()[0]] + [
        f"{k / 3:.3f},{line.split(',', 1)[1]}" for k, line in enumerate(text.splitlines()[1:])
    ]
    _, rows, _ = streamed(monkeypatch, capfd, "\n".join(lines))
    assert_array_equal(rows[1:, 1:], expected(positions, 0.00033333333333)[1:])


def test_columns_stay_in_their_order_and_units(place, monkeypatch, capfd):
    positions = move()
    text = table(positions, header="time_ms,x_mm,a_deg", scale=1e3)
    swapped = "\n".join(",".join([b, a, t]) for t, a, b in (line.split(",") for line in text.splitlines()))
    header, rows, _ = streamed(monkeypatch, capfd, swapped + "\n")
    assert header == "a_deg,x_mm,time_ms"
    assert_array_equal(rows[1:, :2], expected(positions[:, ::-1], axes=("a", "x"))[1:])
    assert rows[-1, 2] == len(rows) - 1


def test_without_times_the_samples_come_at_the_servo_period_or_as_told(place, monkeypatch, capfd):
    positions = move()[:, :1]
    text = "X_MM\r\n" + "\r\n".join(map(repr, positions[:, 0].tolist()))
    for words, sample_time in (([], 1e-3), (["--sample-time-s", "0.0021"], 2.1e-3)):
        header, rows, _ = streamed(monkeypatch, capfd, text, "-", *words)
        assert header == "X_MM"
        assert_array_equal(rows[1:], expected(positions, sample_time, axes=("x",))[1:])


def test_blank_lines_are_no_samples_and_a_byte_order_mark_no_letter(place, monkeypatch, capfd):
    _, rows, _ = streamed(monkeypatch, capfd, "\ufefftime_s,x_mm\n\n0,1\n\n0.001,1\n")
    assert_array_equal(rows[:2, 1], [1.0, 1.0])


def test_a_single_sample_rests_and_none_says_nothing(place, monkeypatch, capfd):
    _, rows, _ = streamed(monkeypatch, capfd, "time_s,x_mm\n5,2.5\n")
    assert len(rows) == 1 + len(expected(np.zeros((1, 1)), axes=("x",))) - 1
    np.testing.assert_allclose(rows[:, 1], 2.5, rtol=1e-15)
    assert rows[1, 0] == 5.001
    feed(monkeypatch, "time_s,x_mm\n")
    assert run(["apply", "--stream"]) == 0
    assert capfd.readouterr().out == "time_s,x_mm\n"


@pytest.mark.parametrize(
    ("text", "written", "message"),
    [
        ("time_s,x_mm\n0,1\n0.001,2\n0.0025,3\n", 3, "<stdin>:4:1: error: the sample comes 1.5 ms after"),
        ("x_mm,time_s\n1,0\n2,0.001\n3, 0.0013\n", 3, "<stdin>:4:4: error: the sample comes 0.3 ms after"),
        ("time_s,x_mm\n0,1\n0,2\n", 2, "<stdin>:3:1: error: time stands still"),
        ("time_s,x_mm\n0,1\n-1,2\n", 2, "<stdin>:3:1: error: time runs backwards"),
        ("time_s,x_mm\n0,1\n0.05,2\n", 2, "<stdin>:3:1: error: a shaper of 14.84 ms cannot be sampled every 50 ms"),
        ("time_s,x_mm\n0,1\n0.001,fast\n", 2, "<stdin>:3:7: error: 'fast' is no number for x"),
        ("time_s,x_mm\n0,1\n0.001\n", 2, "<stdin>:3:1: error: 1 cells, the header has 2"),
        ("time_s,x_mm\n0,nan\n", 1, "<stdin>:2:3: error: 'nan' is no number"),
        ("time_s,x_mm\n0,1e7\n", 1, "<stdin>:2:3: error: x is beyond the limit"),
        (b"time_s,x_mm\n0,1\0\n", 1, "<stdin>:2:4: error: NUL byte"),
        ("time_s,x_mm\n" + "0" * 100_000, 1, "<stdin>:2:65537: error: the line is longer"),
        ("time_s,speed\n0,1\n", 0, "<stdin>:1:8: error: unknown column 'speed'"),
        ("time_s,x_mm,feed_mm_min\n0,1,2\n", 0, "<stdin>:1:1: error: samples have no feed rate"),
        ("", 0, "<stdin>: error: no header came"),
    ],
    ids=lambda value: value[:40] if isinstance(value, str) else None,
)  # fmt: skip
def test_a_bad_line_ends_the_stream_at_its_place(place, monkeypatch, capfd, text, written, message):
    lines, said = broken(monkeypatch, capfd, text)
    assert message in said
    assert len(lines) == written  # those before it have gone out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["part.csv"], "--stream reads standard input, not part.csv"),
        (["-o", "out.csv"], "on standard output, not out.csv"),
        (["--interpolation", "spline"], "unknown interpolation 'spline'"),
        (["--sample-time-s", "0"], "--sample-time-s must be positive and finite, not 0"),
        (["--sample-time-s", "nan"], "--sample-time-s must be positive"),
        (["--closed"], "--closed is for programs"),
        (["--dialect", "fanuc"], "--dialect is for programs"),
    ],
)
def test_what_a_stream_cannot_do(place, monkeypatch, capfd, words, message):
    lines, said = broken(monkeypatch, capfd, "x_mm\n1\n", *words)
    assert message in said
    assert "hint" in said or "sample-time" in said
    assert not lines


def test_live_options_belong_to_a_stream(place, capfd):
    for words in (["--interpolation", "linear"], ["--sample-time-s", "0.001"]):
        assert run(["apply", "part.nc", *words]) == 2
        assert "give --stream" in capfd.readouterr().err
    assert run(["apply", "--stream", "--json"]) == 2
    assert "not one JSON object" in capfd.readouterr().err


def test_what_is_worth_a_warning_is_told(place, monkeypatch, capfd):
    text = "x_mm\n1\n"
    said = streamed(monkeypatch, capfd, text, "--interpolation", "rounded", "--sample-time-s", "0.004")[2]
    assert "leave up to 0.21 of the vibration at 33.7 Hz" in said
    assert (
        streamed(monkeypatch, capfd, text, "--interpolation", "rounded", "--sample-time-s", "0.004", "-q")[2]
        == ""
    )
    (place / "stiff.yaml").write_text(
        "name: stiff\naxes: {x: {limits: {velocity_mm_s: 9, acceleration_mm_s2: 9}}}\n"
    )
    _, rows, said = streamed(monkeypatch, capfd, text, "-m", "stiff.yaml")
    assert "no shapers" in said
    assert rows.tolist() == [[1.0]]


# --- as a process ---------------------------------------------------------------------------------


@pytest.fixture
def process(place):
    """The stream in a process of its own."""
    with subprocess.Popen(
        [sys.executable, "-m", "cnc_shape", "apply", "--stream"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, bufsize=0, env={**os.environ, "PYTHONPATH": str(ROOT)}, preexec_fn=hearing_signals,
    ) as started:  # fmt: skip
        yield started
        started.kill()


def say(process, text: str) -> None:
    process.stdin.write(text.encode())
    process.stdin.flush()


def hear(process) -> str:
    """One line, or an error where none comes."""
    with selectors.DefaultSelector() as ready:
        ready.register(process.stdout, selectors.EVENT_READ)
        assert ready.select(PATIENCE), "no line came"
    return process.stdout.readline().decode()


def test_every_line_is_answered_before_the_next(process):
    positions = move(count=40)
    lines = table(positions).splitlines(keepends=True)
    heard = []
    for line in lines:
        say(process, line)
        heard.append(hear(process))
    process.stdin.close()
    tail = process.stdout.read().decode().splitlines()
    assert heard[0] == lines[0]
    rows = np.array([line.split(",") for line in [*heard[1:], *tail]], dtype=float)
    assert_array_equal(rows[1:, 1:], expected(positions)[1:])
    assert process.wait(PATIENCE) == 0
    assert process.stderr.read() == b""


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_it_quietly(process, number, status):
    say(process, "time_s,x_mm\n0,1\n")
    assert hear(process) == "time_s,x_mm\n"
    assert hear(process) == "0,1.0\n"
    process.send_signal(number)
    assert process.wait(PATIENCE) == status
    assert process.stdout.read() == b""
    said = process.stderr.read().decode()
    assert "Traceback" not in said
    assert said.count("\n") == 1


def test_whoever_stops_reading_is_no_fault(process):
    say(process, "time_s,x_mm\n0,1\n")
    hear(process)
    process.stdout.close()
    say(process, "".join(f"{k * 1e-3:.3f},{k}\n" for k in range(1, 1000)))
    assert process.wait(PATIENCE) == 141
    assert process.stderr.read() == b""


def test_the_machine_that_is_bundled_streams(monkeypatch, capfd):
    monkeypatch.delenv("CNC_SHAPE_MACHINE", raising=False)
    positions = move()
    _, rows, said = streamed(monkeypatch, capfd, table(positions, header="time_s,x_mm,y_mm"))
    setup = load_machine(bundled("xy_stage.yaml"))
    modes = {axis.name: axis.modes for axis in setup.machine.axes}
    wanted = filters(setup.acting_shapers, ("x", "y"), 1e-3, Interpolation.EXACT, modes)
    assert_array_equal(rows[1:, 1:], shape_samples(positions, wanted)[1:])
    assert said == ""


def test_the_example_of_the_document(monkeypatch, capfd):
    monkeypatch.delenv("CNC_SHAPE_MACHINE", raising=False)
    document = (ROOT / "docs" / "live.md").read_text(encoding="utf-8")
    given, shown = re.search(r"printf '(.*)' \| .* \| head -4\n(.*?)```", document, re.DOTALL).groups()
    feed(monkeypatch, given.replace("\\n", "\n"))
    assert run(["apply", "--stream"]) == 0
    assert capfd.readouterr().out.splitlines()[:4] == shown.splitlines()


def test_a_stream_shapes_the_axes_whatever_a_planned_motion_would_be_shaped_by(place, monkeypatch, capfd):
    positions = move()
    for planning in ("shaping: contour", "shaping: axis", "shaping: path"):
        (place / "soft.yaml").write_text(MACHINE + f"planning: {{{planning}}}\n")
        _, rows, _ = streamed(monkeypatch, capfd, table(positions))
        assert_array_equal(rows[1:, 1:], expected(positions)[1:])
    (place / "soft.yaml").write_text(MACHINE + "planning: {shaping: none}\n")
    _, rows, said = streamed(monkeypatch, capfd, table(positions))
    assert_array_equal(rows[:, 1:], positions)
    assert "no shapers" in said


def test_axes_need_not_wait_for_each_other(place, monkeypatch, capfd):
    (place / "soft.yaml").write_text(MACHINE + "planning: {shaping: axis, align: false}\n")
    positions = move()
    _, rows, _ = streamed(monkeypatch, capfd, table(positions))
    setup = load_machine("soft.yaml")
    modes = {axis.name: axis.modes for axis in setup.machine.axes}
    wanted = filters(setup.acting_shapers, ("x", "a"), 1e-3, Interpolation.EXACT, modes, aligned=False)
    assert_array_equal(rows[1:, 1:], shape_samples(positions, wanted)[1:])
    assert np.any(rows[1:, 1] != expected(positions)[1 : len(rows), 0])
