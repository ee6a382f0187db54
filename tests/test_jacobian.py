"""``cnc-shape check --jacobian``: both formulas, their agreement, and the numbers themselves."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from test_machine_file_kinematics import AXES, STEWART

from cnc_shape.cli import run
from cnc_shape.config import bundled, load_machine
from cnc_shape.config.jacobian import check_jacobian
from cnc_shape.config.kinematics import rails_of
from cnc_shape.errors import InfeasibleError, OptionError
from cnc_shape.kinematics.cubic_parallel import reciprocal_jacobian
from cnc_shape.kinematics.cubic_parallel_screws import screw_jacobian_as_printed

CUBE = str(bundled("cubic_parallel.yaml"))
DELTA = "{type: linear_delta, tower_radius_mm: 150, link_length_mm: 300}"


def ask(capsys: pytest.CaptureFixture[str], *words: str) -> dict:
    assert run(["check", *words, "--jacobian", "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def written(tmp_path: Path, kinematics: str) -> str:
    path = tmp_path / "machine.yaml"
    path.write_text(f"{AXES}kinematics: {kinematics}\n")
    return str(path)


def test_the_cube_at_home(capsys):
    """Its six legs along x, y and z hold the platform's points, 60 mm off; the tool hangs 60 mm below."""
    said = ask(capsys, "-m", CUBE)
    assert said["schema"] == "cnc-shape/check/1"
    assert (said["kinematics"], said["dialect"]) == ("cubic_parallel", "machine")
    assert said["axes"] == ["x", "y", "z", "a", "b", "c"]
    assert said["joints"] == ["q1", "q2", "q3", "q4", "q5", "q6"]
    assert said["pose"] == dict.fromkeys(said["axes"], 0.0)
    assert_allclose(list(said["joint_positions"].values()), 0.0, atol=1e-12)
    held = [
        [1, 0, 0, 0, 60, -60], [1, 0, 0, 0, 60, 60], [0, 1, 0, -120, 0, 0],
        [0, 1, 0, 0, 0, 0], [0, 0, 1, 0, -60, 0], [0, 0, 1, 0, 60, 0],
    ]  # fmt: skip
    assert_allclose(said["inverse_jacobian"], held, atol=1e-12)
    for name in ("screws", "reciprocal_screws"):
        assert_allclose(said["formulas"][name], np.linalg.inv(held), atol=1e-12)
    assert said["formulas"]["largest_relative_difference"] < 1e-14
    assert said["condition_number"] == pytest.approx((3.0 + np.sqrt(5.0)) / 2.0)
    assert said["radian_mm"] == 60.0


def test_both_formulas_agree_at_any_pose(capsys):
    pose = "20,-15,30,5,-8,12"
    said = ask(capsys, "-m", CUBE, "--pose", pose)
    assert list(said["pose"].values()) == pytest.approx([float(word) for word in pose.split(",")])
    assert said["formulas"]["largest_relative_difference"] < 1e-13
    assert said["central_difference_error"] < 1e-8
    assert 2.0 < said["condition_number"] < 5.0
    found = np.array(said["formulas"]["screws"])
    rails = rails_of(load_machine(CUBE).kinematics_choice)
    assert rails is not None
    printed = screw_jacobian_as_printed(rails, np.array([20.0, -15.0, 30.0]), np.eye(3))
    assert np.abs(printed - found).max() > 0.5


def test_axis_rates_are_twists_where_nothing_is_turned_and_differ_where_it_is(capsys):
    at_rest = ask(capsys, "-m", CUBE, "--pose", "10,20")
    assert_allclose(at_rest["jacobian"], at_rest["formulas"]["screws"], atol=1e-10)
    turned = ask(capsys, "-m", CUBE, "--pose", "10,20,0,10,20,30")
    assert np.abs(np.array(turned["jacobian"]) - turned["formulas"]["screws"]).max() > 1e-3
    assert_allclose(np.array(turned["jacobian"]) @ turned["inverse_jacobian"], np.eye(6), atol=1e-12)


def test_a_delta_at_home_is_held_by_three_links_alike(tmp_path, capsys):
    said = ask(capsys, "-m", written(tmp_path, DELTA))
    slope = 150.0 / np.sqrt(300.0**2 - 150.0**2)
    angles = np.radians([90.0, 210.0, 330.0])
    rates = np.stack([slope * np.cos(angles), slope * np.sin(angles), np.ones(3)], axis=1)
    assert_allclose(said["inverse_jacobian"], rates, atol=1e-12)
    assert said["central_difference_error"] < 1e-8
    assert (said["formulas"], said["radian_mm"]) == (None, None)


def test_a_stewart_platform_agrees_with_central_differences(tmp_path, capsys):
    said = ask(capsys, "-m", written(tmp_path, "\n" + STEWART), "--pose", "10,-20,15,3,-4,6")
    assert said["central_difference_error"] < 1e-8
    assert np.shape(said["inverse_jacobian"]) == (6, 6)


def test_a_corexy_printer(capsys):
    said = ask(capsys, "-m", str(bundled("printer_corexy.yaml")))
    assert said["inverse_jacobian"] == [[1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 0.0, 1.0]]
    assert said["jacobian"] == [[0.5, 0.5, 0.0], [0.5, -0.5, 0.0], [0.0, 0.0, 1.0]]
    assert said["condition_number"] == pytest.approx(np.sqrt(2.0))


def test_a_trunnion_tells_what_turning_costs_the_linear_drives(capsys):
    said = ask(capsys, "-m", str(bundled("trunnion_ac.yaml")), "--pose", "30,20,-50")
    assert_allclose(
        said["inverse_jacobian"],
        [[1, 0, 0, 0, -20], [0, 1, 0, 0, 30], [0, 0, 1, 20, 0], [0, 0, 0, 1, 0], [0, 0, 0, 0, 1]],
        atol=1e-12,
    )  # c turns (30, 20) to (-20, 30), a lifts y = 20 by 20 mm a radian


def test_the_bundled_stage_is_its_own(capsys, monkeypatch):
    monkeypatch.delenv("CNC_SHAPE_MACHINE", raising=False)
    said = ask(capsys)
    assert said["jacobian"] == said["inverse_jacobian"] == np.eye(3).tolist()
    assert said["condition_number"] == 1.0


def test_a_machine_file_may_be_the_file(capsys):
    assert ask(capsys, CUBE) == ask(capsys, "-m", CUBE)


def test_the_table_for_the_eye(capsys):
    assert run(["check", "-m", CUBE, "--jacobian"]) == 0
    said = capsys.readouterr()
    assert "by screws: A - B D^-1 C" in said.out
    assert "by reciprocal screws" in said.out
    assert "condition number: 2.618, a radian as 60 mm" in said.out
    assert "-0.00833333" in said.out
    assert said.err == ""
    assert run(["check", "-m", str(bundled("printer_corexy.yaml")), "--jacobian"]) == 0
    assert "axis rates per joint rates" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "message", "hint"),
    [
        (["-m", CUBE, "--jacobian", "--pose", "1,2,3,4,5,6,7"], "a pose of this machine has 6 numbers, not 7", "X,Y,Z,A,B,C"),
        (["-m", CUBE, "--jacobian", "--pose", "1,two"], "--pose is not '1,two'", "--pose 20,15,0"),
        (["-m", CUBE, "--jacobian", "--pose", "nan"], "--pose is not 'nan'", "--pose 20,15,0"),
        (["-m", CUBE, "--jacobian", "--pose", ""], "--pose is not ''", "--pose 20,15,0"),
        (["-m", CUBE, "--jacobian", "--pose", "0,900"], "cannot reach", "inside"),
        (["-m", CUBE, "--jacobian", CUBE], "--jacobian takes one machine", "name it with -m"),
        (["--jacobian", CUBE, CUBE], "--jacobian takes one machine", "name it with -m"),
        (["-m", CUBE], "check needs a FILE", "--jacobian"),
        ([CUBE, "--pose", "1"], "--pose goes with --jacobian", "--jacobian"),
    ],
)  # fmt: skip
def test_what_cannot_be_asked_is_refused(words, message, hint, capsys, monkeypatch):
    monkeypatch.delenv("CNC_SHAPE_MACHINE", raising=False)
    assert run(["check", *words, "--json"]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert message in error["message"]
    assert hint in error["hint"]


def test_the_library_raises_what_the_command_tells():
    setup = load_machine(CUBE)
    with pytest.raises(InfeasibleError, match=r"pose: legs? q"):
        check_jacobian(setup, [1000.0])
    with pytest.raises(OptionError, match="6 numbers"):
        check_jacobian(setup, [0.0] * 7)


def test_a_radian_counts_as_its_millimetres_between_the_formulas(monkeypatch):
    """At home the largest entry is 1 mm per mm; 1e-3 rad/mm, at 60 mm a radian, are 6 % of it."""

    def off(rails, position, rotation):
        found = np.linalg.inv(reciprocal_jacobian(rails, position, rotation))
        found[4, 2] += 1e-3
        return found

    monkeypatch.setattr("cnc_shape.config.jacobian.screw_jacobian", off)
    formulas = check_jacobian(load_machine(CUBE))["formulas"]
    assert isinstance(formulas, dict)
    assert formulas["largest_relative_difference"] == pytest.approx(0.06)
