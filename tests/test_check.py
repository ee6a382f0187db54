"""``cnc-shape check``: the object it prints, its exit codes, what it writes."""

from __future__ import annotations

import json

import numpy as np
import pytest
from archives import arrays_of

from cnc_shape.cli import run

PART = "G21 F600\nG0 X10\nG3 X-10 I-10\nG1 A90\nM2\n"


@pytest.fixture
def part(tmp_path):
    path = tmp_path / "part.nc"
    path.write_text(PART)
    return path


def ask(capsys, *words) -> tuple[int, dict, str]:
    status = run(["check", *map(str, words), "--json"])
    said = capsys.readouterr()
    return status, json.loads(said.out), said.err


def test_one_program(part, capsys):
    status, said, _ = ask(capsys, part)
    assert status == 0
    assert said["schema"] == "cnc-shape/check/1"
    assert (said["dialect"], said["lines"]) == ("rs274", 5)
    assert said["moves"] == {"rapid": 1, "feed": 1, "arc": 1, "spline": 0, "probe": 0, "tap": 0, "dwell": 0}
    assert said["rapid_length_mm"] == 10.0
    assert said["feed_length_mm"] == pytest.approx(10 * np.pi)
    assert said["feed_time_s"] == pytest.approx(np.pi + 9.0)
    assert said["dwell_s"] == 0.0
    assert said["bounds_mm"] == {"min": [-10.0, 0.0, 0.0], "max": [10.0, 10.0, 0.0]}
    assert said["final_position"] == pytest.approx({"x": -10.0, "y": 0.0, "z": 0.0, "a": 90.0})
    assert said["warnings"] == []


def test_all_files_are_read_and_one_fault_decides(part, tmp_path, capsys):
    bad, table = tmp_path / "bad.nc", tmp_path / "path.csv"
    bad.write_text("G0 X1\nG0 X\n")
    table.write_text("x_mm,y_mm\n1,1\n2,2\n")
    status, said, told = ask(capsys, bad, part, table)
    assert status == 2
    assert [entry.get("dialect") for entry in said["files"]] == [None, "rs274", "csv"]
    assert said["files"][0]["error"]["line"] == 2
    assert f"{bad}:2:4: error: X has no number\nhint: " in told
    assert ask(capsys, part, table)[0] == 0


def test_a_faulty_program_writes_nothing(tmp_path, capsys):
    bad, points = tmp_path / "bad.nc", tmp_path / "out.npz"
    bad.write_text("G0 X1\nG0 X\n")
    status, said, told = ask(capsys, bad, "--points", points)
    assert status == 2
    assert said["error"] == {
        "code": "program", "message": "X has no number", "file": str(bad), "line": 2, "column": 4,
        "hint": "write it as X1.5",
    }  # fmt: skip
    assert told == f"{bad}:2:4: error: X has no number\nhint: write it as X1.5\n"
    assert not points.exists()


def test_points_are_written_and_replaced(part, tmp_path, capsys):
    points = tmp_path / "out.npz"
    for _ in range(2):
        assert ask(capsys, part, "--points", points)[0] == 0
    file = arrays_of(points)
    assert sorted(file) == ["end", "feed_mm_min", "kind", "length_mm", "line", "sweep_rad"]
    assert file["end"].shape == (3, 6)


def test_points_never_replace_the_input(part, capsys):
    assert ask(capsys, part, "--points", part)[0] == 2
    assert part.read_text() == PART
    assert ask(capsys, part, part, "--points", "out.npz")[0] == 2


def test_a_machine_files_tools_are_used(part, tmp_path, capsys):
    machine = tmp_path / "machine.yaml"
    machine.write_text(
        "name: test\nkinematics: {type: cartesian}\n"
        "axes: {x: {limits: {velocity_mm_s: 100, acceleration_mm_s2: 1000}}}\n"
        "control: {sample_time_s: 0.001, position_gain_per_s: 20}\n"
        "tools: [{number: 1, length_mm: 50, diameter_mm: 6}]\n"
    )
    part.write_text("T1 M6 G43\nG0 Z1\nM2\n")
    assert ask(capsys, part, "-m", machine)[1]["final_position"]["z"] == 51.0
    assert ask(capsys, part)[1]["warnings"][0]["line"] == 1
    status, said, _ = ask(capsys, machine, part)
    assert (status, said["files"][0]["dialect"]) == (0, "machine")


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--max-blocks", "2", "limit of 2"),
        ("--max-file-bytes", "9", "limit of 9 bytes"),
        ("--max-line-bytes", "9", "limit of 9 bytes"),
        ("--max-coordinate-mm", "9.5", "limit of 9.5 mm"),
        ("--max-coordinate-mm", "inf", "no limit"),
        ("--max-blocks", "0", "no limit"),
        ("--dialect", "klingon", "unknown dialect"),
        ("--path", "zigzag", "--path is"),
    ],
)
def test_limits_and_names_on_the_command_line(part, capsys, option, value, message):
    status, said, _ = ask(capsys, part, option, value)
    assert status == 2
    assert message in said["error"]["message"]


def test_the_table_for_the_eye(part, capsys):
    assert run(["check", str(part)]) == 0
    said = capsys.readouterr()
    assert "1 rapid, 1 feed, 1 arc" in said.out
    assert said.err == ""
    part.write_text("G0 X1\n")
    assert run(["check", str(part)]) == 0
    assert "warning: the program ends without M2 or M30" in capsys.readouterr().err


def test_a_program_without_moves_has_no_bounds(part, capsys):
    part.write_text("G21\nM2\n")
    _, said, _ = ask(capsys, part)
    assert said["bounds_mm"] == {"min": None, "max": None}
