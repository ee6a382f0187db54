"""The run folder: complete, the same to the byte each time, and free of numbers that are none."""

from __future__ import annotations

import csv
import hashlib
import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from runs import MODE, PROGRAM, TEXT, driven, make_run, shaper

from cnc_shape.arrays import frozen, frozen_integers
from cnc_shape.contour import ContourError
from cnc_shape.errors import InfeasibleError, OutputError
from cnc_shape.recording import MOTORS, Recorder
from cnc_shape.report.folder import RUNS, Context, default_folder, write_report
from cnc_shape.report.table import summary_json
from cnc_shape.response import Response
from cnc_shape.trajectory import Trajectory

RUN = make_run(600)
CONTEXT = Context(
    command=("simulate", PROGRAM),
    inputs={PROGRAM: hashlib.sha256(TEXT).hexdigest()},
    machine="name: XY stage\n",
    shapers={"x": shaper()},
    modes={"x": (MODE,)},
    warnings=("part.nc:3: warning: µ",),
)
FILES = {
    "report.html", "results.json", "signals.npz", "tables.csv", "machine.yaml", "run.json",
    "figures/path.svg", "figures/error.svg", "figures/motion.svg", "figures/vibration.svg",
    "figures/shapers.svg",
}  # fmt: skip


def content(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("out") / "run"
    assert write_report(RUN, folder, CONTEXT) == folder / "report.html"
    return folder


@pytest.fixture
def quick(monkeypatch) -> None:
    """Leave the drawing out, where it is not what is tested."""
    monkeypatch.setattr("cnc_shape.report.folder.render", lambda figure, kind: b"<svg/>")


def test_the_folder_holds_what_it_promises(written):
    assert set(content(written)) == FILES
    assert [path.name for path in written.parent.iterdir()] == ["run"]
    assert (written / "machine.yaml").read_text() == "name: XY stage\n"


def test_a_run_written_again_is_the_same_to_the_byte(written, tmp_path, monkeypatch):
    monkeypatch.setattr("time.time", lambda: 2e9)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1")
    monkeypatch.chdir(tmp_path)
    write_report(RUN, "other", CONTEXT)
    assert content(tmp_path / "other") == content(written)


def test_results_are_the_json_of_the_command(written):
    assert json.loads((written / "results.json").read_bytes()) == summary_json(RUN.summary)
    with (written / "tables.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    for row, case in zip(rows, summary_json(RUN.summary)["cases"], strict=True):
        assert float(row["tool_contour_rms_um"]) == case["tool_contour_rms_um"]


def test_signals_hold_every_sample_time_first_with_units(written):
    with np.load(written / "signals.npz") as signals:
        assert signals.files[0] == "unshaped/time_s"
        for case in RUN.signals:
            assert_array_equal(signals[f"{case.case}/time_s"], case.time)
            assert_array_equal(signals[f"{case.case}/tool_y_mm"], case.tool[:, 1])
            assert_array_equal(signals[f"{case.case}/acceleration_x_mm_s2"], case.acceleration[:, 0])
            assert_array_equal(signals[f"{case.case}/tool_contour_error_mm"], case.tool_error)
            assert_array_equal(signals[f"{case.case}/line"], case.line)
            assert_array_equal(signals[f"{case.case}/settling_x_mm"], case.settling[:, 0])


def test_motors_have_their_signals_figures_and_numbers(tmp_path, quick):
    run = driven(600)
    write_report(run, tmp_path / "run", CONTEXT)
    drawn = {path.name for path in (tmp_path / "run" / "figures").glob("motors_*")}
    assert drawn == {
        f"motors_{signals.case}.svg" for signals in run.signals if signals.case.endswith("+disturbed")
    }
    results = json.loads((tmp_path / "run" / "results.json").read_bytes())["cases"]
    with np.load(tmp_path / "run" / "signals.npz") as signals:
        for case, row in zip(run.signals, results, strict=True):
            for k, motor in enumerate(row["motors"]):
                stem, joint = case.case, motor["joint"]
                for name, unit in (
                    ("torque", "_nm"), ("load", "_nm"), ("estimate", "_nm"), ("gain_ratio", ""),
                    ("effective_inertia", "_kg_m2"), ("agreement", ""), ("inertia", "_kg_m2"),
                ):  # fmt: skip
                    values = signals[f"{stem}/{name}_{joint}{unit}"]
                    assert_array_equal(values, getattr(case.motors, name)[:, k])
                torque = np.abs(signals[f"{stem}/torque_{joint}_nm"])
                assert motor["peak_torque_nm"] == torque.max()
                assert motor["saturated_share"] == np.mean(torque >= 2.2)


@pytest.mark.parametrize("name", MOTORS)
def test_a_motor_signal_that_is_not_finite_is_named_with_its_time(tmp_path, name):
    run = driven(600)
    values = getattr(run.signals[1].motors, name).copy()
    values[60, 1] = np.inf
    bad = replace(run.signals[1], motors=replace(run.signals[1].motors, **{name: frozen(values)}))
    with pytest.raises(
        InfeasibleError, match=rf"{name} of Y of the case independent\+disturbed is inf at t = "
    ):
        write_report(replace(run, signals=(run.signals[0], bad, *run.signals[2:])), tmp_path / "run", CONTEXT)
    assert list(tmp_path.iterdir()) == []


def test_run_json_names_inputs_versions_and_command(written):
    run = json.loads((written / "run.json").read_bytes())
    assert run["schema"] == "cnc-shape/run/1"
    assert run["command"] == ["simulate", PROGRAM]
    assert run["inputs"] == {PROGRAM: hashlib.sha256(TEXT).hexdigest()}
    assert run["machine_sha256"] == hashlib.sha256(b"name: XY stage\n").hexdigest()
    assert run["versions"]["numpy"] == np.__version__


def test_the_default_folder_goes_with_what_was_run(tmp_path, monkeypatch, quick):
    folder = default_folder(RUN, CONTEXT)
    assert folder == default_folder(RUN, CONTEXT)
    assert folder.parent == Path(RUNS)
    assert folder.name.startswith("corner_and_arc-")
    assert len({folder, default_folder(RUN, replace(CONTEXT, machine="name: other\n"))}) == 2
    monkeypatch.chdir(tmp_path)
    write_report(RUN, folder, CONTEXT)
    with pytest.raises(OutputError, match="exists"):
        write_report(RUN, folder, CONTEXT)
    write_report(RUN, folder, CONTEXT, force=True)
    assert set(content(folder)) == FILES


@pytest.mark.parametrize("name", ["../../etc/passwd", "..", "a/b", "-rf", "x" * 500, "", "\udcff\n", "CON"])
def test_the_default_folder_stays_in_its_place(name):
    folder = default_folder(replace(RUN, summary=replace(RUN.summary, program=name)), CONTEXT)
    assert folder.parent == Path(RUNS)
    assert not folder.name.startswith((".", "-"))
    assert len(folder.name) < 100


def test_an_older_folder_needs_force(tmp_path, quick):
    write_report(RUN, tmp_path / "run", CONTEXT)
    before = content(tmp_path / "run")
    (tmp_path / "run" / "stale").write_bytes(b"")
    with pytest.raises(OutputError, match="exists"):
        write_report(RUN, tmp_path / "run", CONTEXT)
    write_report(RUN, tmp_path / "run", CONTEXT, force=True)
    assert content(tmp_path / "run") == before


@pytest.mark.parametrize("name", ["tool", "velocity", "drive_error", "time", "foot", "settling"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_signal_that_is_not_finite_is_named_with_its_time_and_nothing_is_written(tmp_path, name, value):
    shaped = RUN.signal("shaped")
    values = getattr(shaped, name).copy()
    values[60] = value
    bad = replace(shaped, **{name: frozen(values)})
    with pytest.raises(InfeasibleError, match=rf"{name}.* of the case shaped is {value} at t = "):
        write_report(replace(RUN, signals=(RUN.signals[0], bad, RUN.signals[2])), tmp_path / "run", CONTEXT)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("call", [1, 5, 12])
def test_a_fault_leaves_nothing(tmp_path, monkeypatch, call, quick):
    original, calls = os.fsync, []

    def faulty(descriptor):
        calls.append(descriptor)
        if len(calls) == call:
            raise OSError(5, "Input/output error")
        original(descriptor)

    monkeypatch.setattr(os, "fsync", faulty)
    with pytest.raises(OutputError, match="input/output"):
        write_report(RUN, tmp_path / "run", CONTEXT)
    assert list(tmp_path.iterdir()) == []


def test_names_that_are_no_text_are_spelled_out(tmp_path, quick):
    odd = "part\udcff.nc"
    run = replace(RUN, summary=replace(RUN.summary, program=odd))
    write_report(run, tmp_path / "run", replace(CONTEXT, inputs={odd: "00"}, command=("simulate", odd)))
    assert json.loads((tmp_path / "run" / "results.json").read_bytes())["program"] == odd
    assert b"part\\udcff.nc" in (tmp_path / "run" / "report.html").read_bytes()


def test_figures_come_in_the_format_asked_for(tmp_path, quick):
    write_report(RUN, tmp_path / "run", replace(CONTEXT, figure_format="png"))
    assert {p.suffix for p in (tmp_path / "run" / "figures").iterdir()} == {".png"}
    assert b"data:image/svg+xml" in (tmp_path / "run" / "report.html").read_bytes()


def test_a_run_without_signals_is_our_own_bug(tmp_path):
    with pytest.raises(ValueError, match="signals"):
        write_report(replace(RUN, signals=()), tmp_path / "run", CONTEXT)


def thinned(samples: int, **limits):
    """The run of `RUN`'s kind as a recorder keeps it, whole and thinned."""
    whole = make_run(samples)
    signals = tuple(recorded(case, **limits) for case in whole.signals)
    return whole, replace(whole, signals=signals)


def recorded(case, **limits):
    recorder = Recorder(case.case, case.axes, float(case.time[1]), buckets=32, **limits)
    for low in range(0, case.time.size, 700):
        part = {
            name: frozen(getattr(case, name)[low : low + 700])
            for name in (
                "command", "position", "tool", "velocity", "acceleration", "command_error", "drive_error",
                "tool_error", "foot", "time",
            )
        }  # fmt: skip
        lines = frozen_integers(case.line[low : low + 700])
        command = Trajectory(
            case.axes, float(case.time[1]), part["time"], part["command"], part["velocity"], part["acceleration"]
        )  # fmt: skip
        errors = [
            ContourError(part[name], part["foot"], part["time"], lines)
            for name in ("command_error", "drive_error", "tool_error")
        ]
        at = part["position"]
        recorder.add(Response(command, at, at, at, part["tool"], at, at[:0, 0]), errors)
    return recorder.signals(case.settling)


@pytest.mark.parametrize("limits", [{"kept": 5000}, {"kept": 10, "all_signals": True}])
def test_signals_that_are_not_in_memory_are_written_as_if_they_were(tmp_path, quick, limits):
    whole, run = thinned(5000, **limits)
    assert run.signals[0].factor > 1
    write_report(whole, tmp_path / "whole", CONTEXT)
    write_report(run, tmp_path / "run", CONTEXT)
    with (
        np.load(tmp_path / "whole" / "signals.npz") as mine,
        np.load(tmp_path / "run" / "signals.npz") as theirs,
    ):
        assert mine.files == theirs.files
        for name in mine.files:
            if not name.endswith("time_s"):  # a product here, a sum there
                assert_array_equal(mine[name], theirs[name])
            assert mine[name].dtype == theirs[name].dtype
    page = (tmp_path / "run" / "report.html").read_text()
    assert "extremes of every" in page
    assert "1 : " not in page


def test_signals_beyond_the_limit_are_thinned_and_say_so(tmp_path, quick):
    whole, run = thinned(5000, kept=4999)
    write_report(run, tmp_path / "run", CONTEXT)
    results = summary_json(whole.summary)["cases"]
    with np.load(tmp_path / "run" / "signals.npz") as signals:
        for case in results:
            name = case["name"]
            assert signals[f"{name}/decimation"] == run.signal(name).factor == 32
            assert signals[f"{name}/time_s"].size <= 256
            for array, key in (("command_", "command_"), ("", ""), ("tool_", "tool_")):
                worst = 1e3 * signals[f"{name}/{array}contour_error_mm"].max()
                assert worst == pytest.approx(case[f"{key}contour_max_um"], rel=1e-15)
    assert "1 : 32, the extremes of every 256" in (tmp_path / "run" / "report.html").read_text()
