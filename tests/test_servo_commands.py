"""A machine with servo motors under load, as a user runs it: rows, warnings, and the run folder run again."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from answers import answer
from archives import arrays_of

import cnc_shape as cs
from cnc_shape.cli import run
from cnc_shape.config.bundled import bundled

PROGRAM = "G21 G90\nG2 X0 Y0 I10 J0 F2400\nM2\n"
MOTOR = {
    "joint", "peak_torque_nm", "rms_torque_nm", "peak_load_nm", "peak_gain_ratio", "saturated_share",
    "identified_inertia_kg_m2",
}  # fmt: skip


@pytest.fixture
def place(tmp_path, monkeypatch) -> Path:
    """A fresh working folder with a circle, a machine that is loaded on it, and the same one with weak motors."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "part.nc").write_text(PROGRAM)
    text = bundled("servo_three_axis.yaml").read_text()
    early = text.replace("length_s: 6.91, centre_s: 9.4", "length_s: 1.2, centre_s: 0.8")
    assert early != text
    (tmp_path / "strong.yaml").write_text(early)
    (tmp_path / "weak.yaml").write_text(early.replace("torque_limit_nm: 7.1", "torque_limit_nm: 1.2"))
    return tmp_path


def test_every_row_tells_what_its_motors_did(place, capfd):
    rows = answer(capfd, "simulate", "part.nc", "-m", "strong.yaml")["cases"]
    assert [row["name"] for row in rows[:2]] == ["independent", "independent+disturbed"]
    for row in rows:
        assert {motor["joint"] for motor in row["motors"]} <= {"x", "y", "z"}
        for motor in row["motors"]:
            assert set(motor) == MOTOR
            assert motor["saturated_share"] == 0.0
            assert (motor["peak_load_nm"] > 0.5) == (
                row["name"].endswith("+disturbed") and motor["joint"] != "z"
            )


def test_a_motor_at_its_limit_is_told_on_stderr_and_on_the_page(place, capfd):
    picked = ("--cases", "independent,independent+disturbed")
    assert run(["simulate", "part.nc", "-m", "weak.yaml", *picked, "-o", "out"]) == 0
    told = capfd.readouterr()
    (warning,) = [line for line in told.err.splitlines() if "torque limit" in line]
    rows = json.loads((place / "out" / "results.json").read_text())["cases"]
    shares = {motor["joint"]: motor["saturated_share"] for motor in rows[1]["motors"]}
    assert warning.startswith("independent+disturbed: torque limit reached by motor X for ")
    assert f"motor X for {100.0 * shares['x']:.3g} %" in warning
    assert "torque limit" not in told.out
    assert warning in (place / "out" / "report.html").read_text()
    assert warning in json.loads((place / "out" / "run.json").read_text())["warnings"]
    assert run(["simulate", "part.nc", "-m", "weak.yaml", *picked, "--quiet"]) == 0
    assert "torque limit" not in capfd.readouterr().err


def test_a_load_beyond_every_motor_is_blamed_where_the_loop_diverges(place, capfd):
    text = (place / "strong.yaml").read_text()
    crushing = text.replace("peak_nm: 2.5", "peak_nm: 1000000")
    assert crushing != text
    (place / "crushed.yaml").write_text(crushing)
    case = ("--cases", "independent+disturbed")
    assert run(["simulate", "part.nc", "-m", "crushed.yaml", *case]) == 2
    told = capfd.readouterr().err
    assert "the loop diverged: axis " in told
    assert "torque_limit_nm" in told


def test_a_load_along_an_axis_that_the_program_leaves_out_is_told(place, capfd):
    text = (place / "strong.yaml").read_text()
    turning = """  c:
    limits: {velocity_deg_s: 360, acceleration_deg_s2: 5000}
    drive: {type: servo_motor, inertia_kg_m2: 4.6e-4, torque_limit_nm: 7.1, lead_deg_per_rev: 3.6}
"""
    loaded = text.replace("planning:", turning + "planning:", 1).replace("path_normal", "c")
    (place / "turning.yaml").write_text(loaded)
    both = ("-m", "turning.yaml", "--cases")
    assert run(["simulate", "part.nc", *both, "independent,independent+disturbed", "-o", "out"]) == 0
    warning = "the load along C pushes nothing: the program does not name that axis"
    assert warning in capfd.readouterr().err
    assert warning in (place / "out" / "run.json").read_text()
    assert run(["simulate", "part.nc", *both, "independent"]) == 0
    assert "pushes nothing" not in capfd.readouterr().err
    (place / "turned.nc").write_text(PROGRAM.replace("F2400", "C90 F2400"))
    assert run(["simulate", "turned.nc", *both, "independent+disturbed"]) == 0
    assert "pushes nothing" not in capfd.readouterr().err


def test_a_report_from_python_has_the_same_warning(place):
    setup = cs.load_machine("weak.yaml")
    told = cs.simulate_program("part.nc", setup, ["independent+disturbed"])
    assert "torque limit reached by motor X" in cs.write_report(told, place / "out", setup).read_text()


def test_the_machine_of_a_run_folder_runs_it_again_bit_for_bit(place, capfd):
    answer(capfd, "simulate", "part.nc", "-m", "strong.yaml", "-o", "one")
    answer(capfd, "simulate", "part.nc", "-m", "one/machine.yaml", "-o", "two")
    for name in ("results.json", "signals.npz", "tables.csv", "machine.yaml", "report.html"):
        assert (place / "one" / name).read_bytes() == (place / "two" / name).read_bytes(), name
    signals = arrays_of(place / "one" / "signals.npz")
    rows = json.loads((place / "one" / "results.json").read_text())["cases"]
    for row in rows:
        for motor in row["motors"]:
            torque = signals[f"{row['name']}/torque_{motor['joint']}_nm"]
            assert abs(torque).max() == motor["peak_torque_nm"]


def test_the_gate_looks_at_the_last_row_that_is_at_the_machine_under_load(place, capfd):
    gate = ("--fail-on", "max_contour_um>0.001")
    assert run(["simulate", "part.nc", "-m", "strong.yaml", *gate]) == 1
    assert "+disturbed is " in capfd.readouterr().err


@pytest.mark.parametrize("limit", [7.1, 4.9], ids=["held", "beyond the torque limit"])
def test_a_load_along_the_path_is_no_contour_error_however_far_it_pushes(place, capfd, limit):
    text = bundled("servo_three_axis.yaml").read_text().replace("lead_mm_per_rev: 10", "lead_mm_per_rev: 40")
    text = text[: text.index("disturbances:")].replace(
        "torque_limit_nm: 7.1", f"torque_limit_nm: {limit}"
    ) + (
        "disturbances:\n  - {type: load_torque, direction: path_tangent, peak_nm: 5,"
        " profile: {type: steps, times_s: [2, 2.15], levels: [1, 0]}}\n"
    )
    (place / "coarse.yaml").write_text(text)
    (place / "line.nc").write_text("G21 G90\nG1 X40 F6000\nX50 F100\nM2\n")
    told = answer(
        capfd, "simulate", "line.nc", "-m", "coarse.yaml", "--cases", "independent,independent+disturbed"
    )
    plain, pushed = told["cases"]
    assert pushed["following_rms_um"]["x"] > plain["following_rms_um"]["x"]
    assert pushed["contour_max_um"] < 1e-6
