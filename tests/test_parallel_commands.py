"""Commands on machines whose joints are not axes: what they say, and what they refuse."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from answers import answer, refused
from numpy.testing import assert_allclose

from cnc_shape.cli import run
from cnc_shape.config.bundled import bundled
from cnc_shape.motion import moving

SQUARE = "G21 G90 G64 P0.01\nG1 X20 F1200\nY20\nX0\nY0\nM2\n"


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("CNC_SHAPE_MACHINE", raising=False)
    text = bundled("cubic_parallel.yaml").read_text()
    (tmp_path / "cubic.yaml").write_text(text)
    (tmp_path / "wide.yaml").write_text(text.replace("travel_mm: [-60, 60]", "travel_mm: [-900, 900]"))
    (tmp_path / "square.nc").write_text(SQUARE)
    return tmp_path


def test_following_errors_are_the_joints_and_orientation_is_told_apart(place, capfd):
    told = answer(capfd, "simulate", "square.nc", "-m", "cubic.yaml")
    assert [case["name"] for case in told["cases"]] == ["independent", "cross_coupled"]
    independent, coupled = told["cases"]
    assert list(independent["following_rms_um"]) == ["q1", "q2", "q3", "q4", "q5", "q6"]
    assert list(independent["residual_vibration_um"]) == ["x", "y", "z"]
    assert independent["orientation_max_mdeg"] > independent["orientation_rms_mdeg"] > 0.0
    assert coupled["contour_rms_um"] < 0.6 * independent["contour_rms_um"]
    assert_allclose(coupled["tool_contour_rms_um"], coupled["contour_rms_um"])


def test_a_cartesian_machine_tells_no_orientation(place, capfd):
    told = answer(capfd, "simulate", "square.nc", "--cases", "unshaped")
    assert not any(key.startswith("orientation") for key in told["cases"][0])


@pytest.mark.parametrize("command", [("simulate",), ("apply", "-o", "out.csv")], ids=lambda words: words[0])
def test_a_pose_beyond_the_legs_is_refused_with_its_line(place, capfd, command):
    (place / "far.nc").write_text("G21 G90 G64 P0.01\nG1 X20 F6000\nX40\nY10\nX700\nX0\nM2\n")
    message = refused(capfd, *command, "far.nc", "-m", "wide.yaml")
    assert any(line.startswith("far.nc:5: error: ") for line in message.splitlines())
    assert "singular" in message or "cannot reach" in message
    assert not (place / "out.csv").exists()


@pytest.mark.parametrize(("gain", "code"), [(640, 0), (960, 2)])
def test_delay_ends_the_gain(place, capfd, gain, code):
    """One sample of delay leaves some 660 1/s across the path."""
    text = (place / "cubic.yaml").read_text()
    text = text.replace("position_gain_per_s: 20", "position_gain_per_s: 20\n  delay_samples: 1")
    (place / "late.yaml").write_text(text.replace("proportional_per_s: 80", f"proportional_per_s: {gain}"))
    assert run(["simulate", "square.nc", "-m", "late.yaml", "--json"]) == code
    told = capfd.readouterr()
    if code:
        message = json.loads(told.out)["error"]["message"]
        assert "unstable across the path" in message
        largest = float(message.split("stable below ")[1].split()[0])
        assert_allclose(largest, 660.0, rtol=0.02)


@pytest.mark.parametrize(
    ("name", "linear", "turning"),
    [("printer_corexy.yaml", "q1 q2 q3", ""), ("trunnion_ac.yaml", "x y z", "a c")],
)
def test_bundled_machines_run_a_program(place, capfd, name, linear, turning):
    told = answer(capfd, "simulate", "square.nc", "-m", str(bundled(name)))
    for case in told["cases"]:
        assert 0.0 < case["contour_rms_um"] < 100.0
        assert list(case["following_rms_um"]) == linear.split()
        assert list(case.get("following_rms_mdeg", {})) == turning.split()
        assert ("orientation_max_mdeg" in case) == bool(turning)


def test_a_pose_on_the_way_of_rotary_axes_alone_has_its_own_line(place, capfd):
    (place / "turn.nc").write_text("G21 G90 F1200\nG1 X10\nA5\nA-5\nA170\nX0\nM2\n")
    message = refused(capfd, "simulate", "turn.nc", "-m", "wide.yaml")
    assert message.startswith("turn.nc:5: error: the pose is singular")


def test_an_unstable_loop_is_told_where_its_gains_stand_or_where_the_program_meets_it(place, capfd):
    text = (place / "wide.yaml").read_text()
    line = text[: text.index("  sample_time_s")].count("\n") + 1
    (place / "wild.yaml").write_text(text.replace("position_gain_per_s: 20", "position_gain_per_s: 2500"))
    message = refused(capfd, "simulate", "square.nc", "-m", "wild.yaml")
    assert message.startswith(f"wild.yaml:{line}:3: error: the loop of joint q1 is unstable")
    (place / "wild.yaml").write_text(text.replace("proportional_per_s: 80", "proportional_per_s: 2500"))
    message = refused(capfd, "simulate", "square.nc", "-m", "wild.yaml")
    assert message.startswith("square.nc:2: error: the loop is unstable across the path at X 0")


def test_the_way_through_a_singular_pose_is_seen_across_blocks(place, capfd, monkeypatch):
    """At 1000 deg/s no sample comes near the singularity: it lies between two of them, and of two blocks."""

    def one_by_one(*given):
        for block in moving(*given):
            if not len(block.command):
                yield block
            for k in range(len(block.command)):
                last = block.last and k == len(block.command) - 1
                toolpath = block.toolpath if k == 0 else None
                yield replace(block, toolpath=toolpath, command=block.command.cut(slice(k, k + 1)), last=last)

    text = (place / "wide.yaml").read_text()
    turning = "  a: {limits: {velocity_deg_s: 1000, acceleration_deg_s2: 100000}}\n"
    (place / "quick.yaml").write_text(text.replace("\njoints:", turning + "\njoints:"))
    (place / "turn.nc").write_text("G21 G90 F60000\nG1 X10\nA170\nX0\nM2\n")
    whole = refused(capfd, "simulate", "turn.nc", "-m", "quick.yaml")
    assert whole.startswith("turn.nc:3: error: the way to the pose leads through a singular one")
    monkeypatch.setattr("cnc_shape.opening.moving", one_by_one)
    assert refused(capfd, "apply", "turn.nc", "-m", "quick.yaml", "-o", "out.csv") == whole
