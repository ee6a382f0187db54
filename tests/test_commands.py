"""Commands as a user types them: results, exit codes, one line and a hint for everything that is wrong."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from answers import answer, refused
from archives import arrays_of
from numpy.testing import assert_allclose

from cnc_shape.cli import run
from cnc_shape.cli.errors import Terminated, guarded
from cnc_shape.cli.gate import parse_gate
from cnc_shape.errors import OptionError

PROGRAM = "G21 G90 G64 P0.02\nG1 X20 F3000\nG1 Y10\nG3 X10 Y20 I-10 J0\nG0 X0 Y0\nM2\n"


@pytest.fixture
def place(tmp_path, monkeypatch) -> Path:
    """A fresh working folder with a small program."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("CNC_SHAPE_MACHINE", raising=False)
    (tmp_path / "part.nc").write_text(PROGRAM)
    return tmp_path


# --- simulate -------------------------------------------------------------------------------------


def test_simulate_answers_the_contract(place, capfd):
    result = answer(capfd, "simulate", "part.nc")
    assert result["schema"] == "cnc-shape/simulate/1"
    assert list(result)[:6] == ["schema", "program", "machine", "cycle_time_s", "sample_time_s", "samples"]
    assert [case["name"] for case in result["cases"]] == ["unshaped", "shaped", "shaped+cross_coupled"]
    assert set(result["cases"][0]) == {
        "name", "cycle_time_s", "command_contour_rms_um", "command_contour_max_um", "contour_rms_um", "contour_max_um",
        "contour_max_line", "tool_contour_rms_um", "tool_contour_max_um", "following_rms_um", "residual_vibration_um",
    }  # fmt: skip
    assert result["cases"][1]["tool_contour_max_um"] < result["cases"][0]["tool_contour_max_um"]


def test_simulate_without_a_file_tells_the_story(place, capfd):
    assert run(["simulate", "--report"]) == 0
    out = capfd.readouterr().out
    assert "bracket.nc on XY stage with two modes" in out
    page = Path(out.rsplit("report: ", 1)[1].strip())
    assert page.is_file()
    assert {path.name for path in page.parent.iterdir()} == {
        "report.html", "results.json", "signals.npz", "tables.csv", "figures", "machine.yaml", "run.json",
    }  # fmt: skip


def test_the_run_folder_holds_what_the_table_says_and_is_the_same_to_the_byte(place, capfd):
    result = answer(capfd, "simulate", "part.nc", "-o", "one")
    answer(capfd, "simulate", "part.nc", "-o", "two")
    stored = json.loads((place / "one" / "results.json").read_text())
    assert stored == {key: value for key, value in result.items() if key != "report"}
    files = sorted(path.relative_to(place / "one") for path in (place / "one").rglob("*") if path.is_file())
    assert files == sorted(
        path.relative_to(place / "two") for path in (place / "two").rglob("*") if path.is_file()
    )
    for name in files:
        assert (place / "one" / name).read_bytes() == (place / "two" / name).read_bytes(), name
    signals = arrays_of(place / "one" / "signals.npz")
    worst = signals["shaped/tool_contour_error_mm"].max()
    assert_allclose(1e3 * worst, result["cases"][1]["tool_contour_max_um"], rtol=1e-12)


def test_all_signals_are_asked_for_with_a_report(place, capfd, monkeypatch):
    message = refused(capfd, "simulate", "part.nc", "--all-signals")
    assert "--all-signals has no report" in message
    assert "--report" in message
    monkeypatch.setattr(
        "cnc_shape.recording.recorder.Recorder.__init__.__kwdefaults__",
        {"all_signals": False, "kept": 100, "buckets": 4},
    )
    answer(capfd, "simulate", "part.nc", "-o", "few", "--cases", "unshaped")
    samples = answer(capfd, "simulate", "part.nc", "-o", "all", "--cases", "unshaped", "--all-signals")[
        "samples"
    ]
    for name, fewest, most in (("few", 8, 32), ("all", samples, samples)):
        signals = arrays_of(place / name / "signals.npz")
        assert fewest <= signals["unshaped/time_s"].size <= most
        assert (signals["unshaped/decimation"] == 1) == (name == "all")
    assert json.loads((place / "all" / "run.json").read_text())["command"][-1] == "--all-signals"
    assert "--all-signals" not in (place / "few" / "run.json").read_text()


def test_simulate_picks_cases_and_is_a_gate(place, capfd):
    assert run(["simulate", "part.nc", "--cases", "unshaped", "--fail-on", "max_tool_contour_um>1"]) == 1
    assert "gate failed: max_tool_contour_um of unshaped" in capfd.readouterr().err
    assert run(["simulate", "part.nc", "--cases", "shaped", "--fail-on", "max_tool_contour_um>1e6"]) == 0


def test_simulate_reads_standard_input(place):
    done = subprocess.run(
        [sys.executable, "-m", "cnc_shape", "simulate", "-", "--json", "--cases", "unshaped"],
        input=PROGRAM, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["program"] == "stdin"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["simulate", "absent.nc"], "absent.nc: error: cannot read"),
        (["simulate", "."], "error: cannot read: is a directory"),
        (["simulate", "part.nc", "--cases", "shaped,nonsense"], "no case called 'nonsense'"),
        (["simulate", "part.nc", "--cases", "shaped,unshaped,shaped"], "the case 'shaped' is named twice"),
        (["simulate", "part.nc", "--fail-on", "max_contour_um"], "is no condition"),
        (["simulate", "part.nc", "--fail-on", "speed>3"], "no measure 'speed'"),
        (["simulate", "part.nc", "--figures", "gif"], "svg, png, pdf, not 'gif'"),
        (["simulate", "part.nc", "--dialect", "heidenhain"], "unknown dialect"),
        (["simulate", "part.nc", "-m", "absent.yaml"], "absent.yaml: error"),
        (["simulate", "part.nc", "--nonsense"], "no such option"),
        (["apply"], "missing argument"),
        (["apply", "part.nc", "-o", "out"], "a file without suffix"),
        (["apply", "part.nc", "-o", "part.nc"], "is the input itself"),
        (["apply", "part.nc", "-o", "absent/out.csv"], "the folder absent does not exist"),
        (["design", "zw", "--frequency-hz", "30"], "unknown shaper 'zw'"),
        (["design", "zv"], "zv is for one mode, not 2"),
        (["design", "zv", "--frequency-hz", "-3"], "frequency must be positive, not -3.0 Hz"),
        (["design", "zv", "--frequency-hz", "nan"], "frequency must be positive"),
        (["design", "zv", "--frequency-hz", "1e-308"], "between 0.001 and 100000 Hz"),
        (["design", "zv", "--frequency-hz", "1e308"], "between 0.001 and 100000 Hz"),
        (
            ["design", "cascade", *(w for f in range(25) for w in ("--frequency-hz", str(7 + f)))],
            "more than 2048",
        ),
        (["design", "zv", "--frequency-hz", "30", "--damping-ratio", "1"], "below 1, not 1.0"),
        (["design", "zv", "--frequency-hz", "30", "--frequency-hz", "40"], "zv is for one mode, not 2"),
        (
            ["design", "zv", "--frequency-hz", "3", "--damping-ratio", "0", "--damping-ratio", "0"],
            "1 frequencies but 2",
        ),
        (["design", "cascade", "--frequency-hz", "3", "--of", "sd"], "not 'sd'"),
        (["design", "zv", "--frequency-hz", "3", "--vibration-tolerance", "2"], "between 0 and 1, not 2.0"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_wrong_use_is_one_line_and_a_hint(place, capfd, words, message):
    before = sorted(place.rglob("*"))
    assert message in refused(capfd, *words).lower() or message in refused(capfd, *words)
    assert sorted(place.rglob("*")) == before


@pytest.mark.parametrize(
    ("text", "place_", "message"),
    [
        ("G1 X10 F100\nG1 Xnan\n", "bad.nc:2:", "error"),
        ("G1 X10 F100\nG5 X1 Y1\n", "bad.nc:2:", "not built yet"),
        ("\x00\x01\x02", "bad.nc:1:", "NUL"),
        ("", "bad.nc: error", "empty"),
        ("G1 X10\n", "bad.nc:1:", "feed"),
        ("G2 X10 Y0 F100\n", "bad.nc:1:", "error"),
        ("M2\n", "bad.nc", "moves nothing"),
    ],
)
def test_a_bad_program_is_refused_at_its_place_and_nothing_is_written(place, capfd, text, place_, message):
    (place / "bad.nc").write_text(text)
    for words in (["simulate", "bad.nc", "--report"], ["apply", "bad.nc", "-o", "out.csv"]):
        said = refused(capfd, *words)
        assert place_ in said
        assert message in said
    assert sorted(path.name for path in place.iterdir()) == ["bad.nc", "part.nc"]


def test_a_move_out_of_travel_is_refused_at_its_line(place, capfd):
    (place / "small.yaml").write_text(
        "name: small\naxes:\n  x:\n    limits: {velocity_mm_s: 100, acceleration_mm_s2: 1000, travel_mm: [-5, 15]}\n"
    )
    said = refused(capfd, "simulate", "part.nc", "-m", "small.yaml")
    assert "part.nc:2: error: X reaches 20 mm, beyond its travel of -5 to 15 mm" in said


def test_an_unstable_machine_is_told_before_it_is_simulated(place, capfd):
    (place / "wild.yaml").write_text(
        "name: wild\naxes:\n  x:\n    limits: {velocity_mm_s: 100, acceleration_mm_s2: 1000}\n"
        "    drive: {type: first_order_lag, time_constant_s: 0.0142}\ncontrol: {position_gain_per_s: 3000}\n"
    )
    assert "unstable" in refused(capfd, "simulate", "part.nc", "-m", "wild.yaml")


def test_a_report_does_not_replace_a_folder_without_force(place, capfd):
    assert run(["simulate", "part.nc", "--cases", "unshaped", "-o", "run"]) == 0
    capfd.readouterr()
    assert "run exists" in refused(capfd, "simulate", "part.nc", "--cases", "unshaped", "-o", "run")
    assert run(["simulate", "part.nc", "--cases", "unshaped", "-o", "run", "--force"]) == 0


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_cannot_be_written_is_named(place, capfd):
    (place / "locked").mkdir(mode=0o500)
    assert "cannot write" in refused(capfd, "apply", "part.nc", "-o", "locked/out.csv")


# --- apply ----------------------------------------------------------------------------------------


def test_apply_answers_the_contract_and_its_file_reads_back(place, capfd):
    result = answer(capfd, "apply", "part.nc", "-o", "out.csv")
    assert set(result) == {
        "schema", "cycle_time_s", "shaped_time_s", "samples", "sample_time_s", "axes", "command_contour_rms_um",
        "command_contour_max_um", "worst_limit_violation", "shaped_acceleration_ratio", "limits", "output",
    }  # fmt: skip
    assert result["worst_limit_violation"] <= 1e-6
    assert result["shaped_acceleration_ratio"] <= 1.2  # of contour shaping
    table = np.loadtxt(place / "out.csv", delimiter=",", skiprows=1)
    assert (place / "out.csv").read_text().splitlines()[0] == "time_s,x_mm,y_mm,z_mm"
    assert table.shape == (result["samples"], 4)
    assert_allclose(table[0], 0.0, atol=1e-12)
    assert_allclose(table[-1, 1:], 0.0, atol=1e-9)
    assert 0.0 <= table[-1, 0] - result["shaped_time_s"] < 2 * result["sample_time_s"]


def test_apply_says_what_simulate_says(place, capfd):
    shaped = answer(capfd, "simulate", "part.nc", "--cases", "shaped")["cases"][0]
    applied = answer(capfd, "apply", "part.nc", "-o", "out.npz")
    assert_allclose(applied["command_contour_max_um"], shaped["command_contour_max_um"], rtol=1e-9)
    assert_allclose(applied["shaped_time_s"], shaped["cycle_time_s"], rtol=1e-12)
    archive = arrays_of(place / "out.npz")
    assert next(iter(archive)) in ("time_s", "linear_axes")
    assert archive["position_mm"].shape == (applied["samples"], 3)


def test_a_shaped_file_is_a_trajectory_that_simulates(place, capfd):
    answer(capfd, "apply", "part.nc", "-o", "shaped.csv")
    result = answer(capfd, "simulate", "shaped.csv", "--cases", "unshaped")
    assert result["cases"][0]["residual_vibration_um"]["x"] < 2.0
    assert result["cases"][0]["command_contour_max_um"] < 1e-6


def test_apply_never_overwrites(place, capfd):
    (place / "points.csv").write_text("x_mm,y_mm\n0,0\n10,0\n10,10\n")
    assert "input itself" in refused(capfd, "apply", "points.csv", "-o", "points.csv", "--force")
    assert run(["apply", "points.csv"]) == 0
    assert (place / "points.shaped.csv").is_file()
    capfd.readouterr()
    assert "exists" in refused(capfd, "apply", "points.csv")
    assert run(["apply", "points.csv", "--force"]) == 0


def test_samples_and_json_do_not_share_standard_output(place, capfd):
    assert (
        "both want standard output"
        in answer(capfd, "apply", "part.nc", "-o", "-", code=2)["error"]["message"]
    )


def test_apply_writes_to_standard_output(place, capfd):
    assert run(["apply", "part.nc", "-o", "-"]) == 0
    lines = capfd.readouterr().out.splitlines()
    assert lines[0] == "time_s,x_mm,y_mm,z_mm"
    assert len(lines) > 1000


def test_gates_are_read_or_refused():
    gate = parse_gate(" max_contour_um >= 2.5e1 ")
    assert (gate.measure, gate.comparison, gate.bound) == ("max_contour_um", ">=", 25.0)
    for text in ("max_contour_um>1e999", "max_contour_um>nan", "max_contour_um=3", ">3"):
        with pytest.raises(OptionError):
            parse_gate(text)


def test_a_loop_of_almost_no_gain_is_measured_in_bounded_memory(place, capfd):
    (place / "slow.yaml").write_text(
        "name: slow\naxes:\n  x:\n    limits: {velocity_mm_s: 100, acceleration_mm_s2: 1000}\n"
        "    drive: {type: first_order_lag, time_constant_s: 0.01}\ncontrol: {position_gain_per_s: 1e-9}\n"
    )
    result = answer(capfd, "simulate", "part.nc", "-m", "slow.yaml")
    assert result["cases"][0]["contour_max_um"] > 1000.0  # the axis hardly moves at all


@pytest.mark.parametrize(("signal", "code"), [(KeyboardInterrupt, 130), (Terminated, 143)])
def test_a_signal_in_compiled_code_is_an_interruption_and_no_bug(signal, code, capfd):
    def wrapped() -> None:
        try:
            raise signal
        except BaseException as inner:
            raise SystemError("a compiled function returned a result with an exception set") from inner

    assert guarded(wrapped, json=False) == code
    assert "bug" not in capfd.readouterr().err
