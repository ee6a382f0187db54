"""Kinematics and joints in the machine file: every key, every refusal at its place, round trips."""

from __future__ import annotations

import json

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from test_machine_file import key_places, outcome_of, parse, refusal

from cnc_shape.cli import run
from cnc_shape.config import bundled, dump_machine, load_machine
from cnc_shape.config.kinematics import kinematics_of, rails_of
from cnc_shape.config.setup import KinematicsChoice, Setup
from cnc_shape.controllers import CrossCoupling, Estimator, Feedforward
from cnc_shape.errors import CncShapeError, OptionError
from cnc_shape.experiments.contour_control.rigs import PLANTS
from cnc_shape.kinematics import KINEMATICS
from cnc_shape.machine import FirstOrderLag, IdealDrive

AXES = "axes: {x: {limits: {velocity_mm_s: 100, acceleration_mm_s2: 1000}}}\n"
CUBE = "{type: cubic_parallel, half_width_mm: 60, link_length_mm: 300, tool_offset_mm: [0, 0, -60]}"
RAILS = """\
  type: cubic_parallel
  rails:
    - {direction: [1, 0, 0], platform_point_mm: [0, 60, 0], origin_mm: [-300, 60, 60]}
    - {direction: [2, 0, 0], platform_point_mm: [0, -60, 0], origin_mm: [-300, -60, 60]}
    - {direction: [0, 1, 0], platform_point_mm: [0, 0, 60], origin_mm: [0, -300, 120]}
    - {direction: [0, 1, 0], platform_point_mm: [0, 0, -60], origin_mm: [0, -310, 0], link_length_mm: 310}
    - {direction: [0, 0, 1], platform_point_mm: [60, 0, 0], origin_mm: [60, 0, -240]}
    - {direction: [0, 0, 1], platform_point_mm: [-60, 0, 0], origin_mm: [-60, 0, -240]}
  link_length_mm: 300
  tool_offset_mm: [0, 0, -60]
"""
STEWART = """\
  type: stewart
  legs:
    - {base_mm: [190, 50, -300], platform_mm: [60, 50, 0]}
    - {base_mm: [-50, 190, -300], platform_mm: [10, 80, 0]}
    - {base_mm: [-140, 140, -300], platform_mm: [-75, 25, 0]}
    - {base_mm: [-140, -140, -300], platform_mm: [-75, -25, 0]}
    - {base_mm: [-50, -190, -300], platform_mm: [10, -80, 0]}
    - {base_mm: [190, -50, -300], platform_mm: [60, -50, 0]}
  tool_offset_mm: [0, 0, 40]
"""
DELTA = "{type: linear_delta, tower_radius_mm: 150, link_length_mm: 300, tower_angles_deg: [80, 210, 330]}"
EVERY_KINEMATICS = {
    "cartesian": "{type: cartesian}",
    "corexy": "{type: corexy}",
    "linear_delta": DELTA,
    "cubic_parallel": CUBE,
    "rails": "\n" + RAILS,
    "stewart": "\n" + STEWART,
    "trunnion_ac": "{type: trunnion_ac, pivot_mm: [1, 2, -50]}",
}


def machine(kinematics: str, more: str = "") -> str:
    """A machine file whose kinematics stands on line 2, or begins on line 3."""
    return f"{AXES}kinematics: {kinematics.rstrip()}\n{more}"


def drives(count: int) -> str:
    lags = (f"{{drive: {{type: first_order_lag, time_constant_s: 0.01{i}}}}}" for i in range(count))
    return f"joints: [{', '.join(lags)}]\n"


def test_every_kinematics_is_in_a_file_here() -> None:
    assert set(EVERY_KINEMATICS) - {"rails"} == set(KINEMATICS)


@pytest.mark.parametrize("name", EVERY_KINEMATICS)
def test_every_kinematics_arrives_and_survives_being_written_and_read(name: str) -> None:
    setup = parse(machine(EVERY_KINEMATICS[name]))
    assert setup.kinematics.name == {"rails": "cubic_parallel"}.get(name, name)
    assert setup.kinematics_choice.type == setup.kinematics.name
    again = parse(dump_machine(setup))
    assert again == setup
    assert dump_machine(again) == dump_machine(setup)
    pose = np.full((1, len(setup.kinematics.axes)), 0.1)
    assert (again.kinematics.inverse(pose) == setup.kinematics.inverse(pose)).all()
    assert (kinematics_of(setup.kinematics_choice).inverse(pose) == setup.kinematics.inverse(pose)).all()


def test_a_file_without_kinematics_is_cartesian() -> None:
    setup = parse(AXES)
    assert setup.kinematics_choice == KinematicsChoice()
    assert (setup.kinematics.name, setup.machine.joints) == ("cartesian", ())


def test_a_kinematics_keeps_what_the_file_says_of_it() -> None:
    assert parse(machine(DELTA)).kinematics_choice == KinematicsChoice(
        "linear_delta",
        {"tower_radius_mm": 150.0, "link_length_mm": 300.0, "tower_angles_deg": [80.0, 210.0, 330.0]},
    )
    one, other = (parse(machine(EVERY_KINEMATICS[name])) for name in ("cubic_parallel", "rails"))
    assert one != other


def test_the_towers_of_a_delta_stand_where_the_file_says() -> None:
    setup = parse(machine("{type: linear_delta, tower_radius_mm: 150, link_length_mm: 300}"))
    x, y, z = 20.0, -30.0, 5.0
    angles = np.radians([90.0, 210.0, 330.0])
    apart = (x - 150.0 * np.cos(angles)) ** 2 + (y - 150.0 * np.sin(angles)) ** 2
    assert_allclose(setup.kinematics.inverse(np.array([[x, y, z]]))[0], z + np.sqrt(300.0**2 - apart))


def test_rails_one_by_one_may_be_those_of_the_cube() -> None:
    equal = RAILS.replace("-310", "-300").replace(", link_length_mm: 310", "")
    one, other = parse(machine(CUBE)).kinematics, parse(machine("\n" + equal)).kinematics
    pose = np.array([[20.0, -15.0, 30.0, 0.1, -0.2, 0.05]])
    assert_allclose(other.inverse(pose), one.inverse(pose), atol=1e-12)


def test_a_rail_has_a_unit_direction_and_its_own_link_length_where_it_says_so() -> None:
    rails = rails_of(parse(machine("\n" + RAILS)).kinematics_choice)
    assert rails is not None
    assert_allclose(np.linalg.norm(rails.direction, axis=1), 1.0)
    assert rails.link_length.tolist() == [300.0, 300.0, 300.0, 310.0, 300.0, 300.0]
    assert rails_of(KinematicsChoice()) is None


def test_a_stewart_platform_measures_its_legs() -> None:
    setup = parse(machine(EVERY_KINEMATICS["stewart"]))
    base, platform = np.array([190.0, 50.0, -300.0]), np.array([60.0, 50.0, 0.0])
    first = np.linalg.norm(platform - [0.0, 0.0, 40.0] - base)
    assert_allclose(setup.kinematics.inverse(np.zeros((1, 6)))[0, 0], first)


def test_the_trunnion_turns_about_its_pivot() -> None:
    setup = parse(machine(EVERY_KINEMATICS["trunnion_ac"]))
    pose = np.array([[1.0, 2.0, -50.0, 0.7, -0.4]])
    assert_allclose(setup.kinematics.inverse(pose), pose)


@pytest.mark.parametrize(
    ("kinematics", "place", "reason"),
    [
        ("{}", (2, 13), "kinematics: type is missing"),
        ("corexy", (2, 13), "kinematics: must be keys with values, not the text 'corexy'"),
        ("{type: polar}", (2, 20), "kinematics.type: must be cartesian, corexy, linear_delta, cubic_parallel, stewart or"),
        ("{type: corexy, pivot_mm: [0, 0, 0]}", (2, 28), "kinematics.pivot_mm: unknown key"),
        ("{type: trunnion_ac}", (2, 13), "kinematics: pivot_mm is missing"),
        ("{type: trunnion_ac, pivot_mm: [0, 0]}", (2, 43), "kinematics.pivot_mm: needs at least 3 values, not 2"),
        ("{type: trunnion_ac, pivot_mm: [0, x, 0]}", (2, 47), "kinematics.pivot_mm[1]: must be a number"),
        ("{type: linear_delta, link_length_mm: 300}", (2, 13), "tower_radius_mm is missing"),
        ("{type: linear_delta, tower_radius_mm: 150}", (2, 13), "link_length_mm is missing"),
        ("{type: linear_delta, tower_radius_mm: 0, link_length_mm: 300}", (2, 51), "must be at least 0.001, not 0"),
        ("{type: linear_delta, tower_radius_mm: 150, link_length_mm: 150}", (2, 72),
         "kinematics.link_length_mm: links of 150 mm do not reach the centre"),
        ("{type: linear_delta, tower_radius_mm: 150, link_length_mm: 300, tower_angles_deg: [90, 90, 330]}", (2, 95),
         "kinematics.tower_angles_deg: three towers in one line"),
        ("{type: linear_delta, tower_radius_mm: 0.01, link_length_mm: 300}", (2, 13),
         "kinematics: the machine is singular at x = y = z = 0: condition number"),
        ("{type: cubic_parallel, link_length_mm: 300}", (2, 13), "kinematics: needs half_width_mm or rails"),
        ("{type: cubic_parallel, half_width_mm: 60}", (2, 13), "kinematics: link_length_mm is missing"),
        ("{type: cubic_parallel, half_width_mm: -60, link_length_mm: 300}", (2, 51), "half_width_mm: must be at least"),
        ("{type: cubic_parallel, rails: []}", (2, 43), "kinematics.rails: needs at least 6 values, not 0"),
        ("{type: stewart, legs: [{base_mm: [0, 0, 0]}]}", (2, 36), "kinematics.legs[0]: platform_mm is missing"),
        ("{type: stewart, legs: []}", (2, 35), "kinematics.legs: needs at least 6 values, not 0"),
    ],
)  # fmt: skip
def test_what_a_kinematics_cannot_be_is_refused_at_its_place(
    kinematics: str, place: tuple[int, int], reason: str
) -> None:
    error = refusal(machine(kinematics))
    assert reason in error.reason
    assert (error.line, error.column) == place


@pytest.mark.parametrize(
    ("text", "change", "place", "reason", "hint"),
    [
        (RAILS, ("direction: [2, 0, 0]", "direction: [0, 0, 0]"), (6, 19),
         "kinematics.rails[1].direction: a rail needs a direction, not 0", "the way it runs"),
        (RAILS, ("  link_length_mm: 300", "  half_width_mm: 60\n  link_length_mm: 300"), (4, 3),
         "kinematics.rails: half_width_mm says where the rails are", "remove one of the two"),
        (RAILS, ("  link_length_mm: 300\n", ""), (5, 7),
         "kinematics.rails[0]: link_length_mm is missing", "add link_length_mm: with its value"),
        (RAILS, ("origin_mm: [60, 0, -240]", "origin_mm: [60, 400, -240]"), (9, 7),
         "kinematics.rails[4]: its leg does not reach the platform at x = y = z = 0: it is 100 mm short", "lengthen"),
        (RAILS, ("platform_point_mm: [-60, 0, 0], origin_mm: [-60, 0, -240]",
                 "platform_point_mm: [60, 0, 0], origin_mm: [60, 0, -200]"), (10, 7),
         "kinematics.rails[5]: legs q5 and q6 hold the platform alike at x = y = z = 0", "give q6 a place of its own"),
        (RAILS, ("{direction: [0, 1, 0], platform_point_mm: [0, 0, -60], origin_mm: [0, -310, 0], link_length_mm: 310}",
                 "{direction: [0, 1, 0], platform_point_mm: [30, 0, 60], origin_mm: [30, -300, 120]}"), (5, 5),
         "kinematics.rails: the machine is singular at x = y = z = 0: no inverse", "move a rail"),
        (STEWART, ("base_mm: [-50, 190, -300], platform_mm: [10, 80, 0]",
                   "base_mm: [190, 50, -300], platform_mm: [60, 50, 0]"), (6, 7),
         "kinematics.legs[1]: legs q1 and q2 hold the platform alike", "give q2 a place of its own"),
        (STEWART, ("-300", "-40"), (5, 5),
         "kinematics.legs: the machine is singular at x = y = z = 0", "move base_mm so that"),
        (STEWART, ("base_mm: [190, 50, -300]", "base_mm: [60, 50, -40]"), (5, 7),
         "kinematics.legs[0]: leg q1 cannot reach x = y = z = 0", "move base_mm so that"),
    ],
)  # fmt: skip
def test_a_geometry_that_holds_no_tool_is_refused_at_its_place(
    text: str, change: tuple[str, str], place: tuple[int, int], reason: str, hint: str
) -> None:
    assert change[0] in text
    error = refusal(machine("\n" + text.replace(*change)))
    assert reason in error.reason
    assert hint in str(error.hint)
    assert (error.line, error.column) == place


def test_a_choice_that_is_none_is_refused_without_a_file() -> None:
    for choice in (
        KinematicsChoice("polar"),
        KinematicsChoice("corexy", {"pivot_mm": [0.0, 0.0, 0.0]}),
        KinematicsChoice("linear_delta", {"tower_radius_mm": 150.0, "link_length_mm": 100.0}),
    ):
        with pytest.raises(OptionError, match="kinematics") as caught:
            kinematics_of(choice)
        assert caught.value.hint


# --- joints


@pytest.mark.parametrize(
    ("name", "count"),
    [("corexy", 3), ("linear_delta", 3), ("cubic_parallel", 6), ("stewart", 6), ("trunnion_ac", 5)],
)
def test_every_joint_has_its_drive(name: str, count: int) -> None:
    setup = parse(machine(EVERY_KINEMATICS[name], drives(count)))
    assert setup.machine.joints == tuple(FirstOrderLag(float(f"0.01{i}")) for i in range(count))
    assert len(setup.kinematics.joints) == count
    assert parse(dump_machine(setup)) == setup


def test_joints_without_a_drive_are_ideal() -> None:
    assert parse(machine("{type: corexy}")).machine.joints == (IdealDrive(),) * 3
    some = "joints: [{}, {drive: {type: ideal}}, {drive: {type: first_order_lag, time_constant_s: 0.01}}]\n"
    setup = parse(machine("{type: corexy}", some))
    assert setup.machine.joints == (IdealDrive(), IdealDrive(), FirstOrderLag(0.01))
    assert parse(dump_machine(setup)) == setup


@pytest.mark.parametrize(
    ("kinematics", "joints", "place", "reason", "hint"),
    [
        ("{type: cartesian}", drives(1), (3, 1), "joints: the joints of a cartesian machine are its axes", "its drive:"),
        ("{type: cartesian}", "joints: []\n", (3, 1), "joints: the joints of a cartesian machine", "its drive:"),
        ("{type: corexy}", drives(2), (3, 9), "joints: corexy has 3 of them, not 2", "one each for q1, q2, q3,"),
        ("{type: corexy}", "joints: []\n", (3, 9), "joints: corexy has 3 of them, not 0", "q1, q2, q3"),
        (CUBE, drives(7), (3, 9), "joints: cubic_parallel has 6 of them, not 7", "q1, q2, q3, q4, q5, q6"),
        ("{type: trunnion_ac, pivot_mm: [0, 0, 0]}", drives(3), (3, 9), "trunnion_ac has 5", "for x, y, z, a, c,"),
        ("{type: corexy}", "joints: [{drive: {type: servo_motor}}, {}, {}]\n", (3, 18), "joints[0].drive: inertia_kg_m2 is missing", "add"),
        ("{type: corexy}", "joints: [{dirve: {}}, {}, {}]\n", (3, 11), "joints[0].dirve: unknown key", "did you mean drive?"),
        ("{type: corexy}", "joints: {q1: {}}\n", (3, 9), "joints: must be a list", ""),
    ],
)  # fmt: skip
def test_joints_that_do_not_fit_are_refused_at_their_place(
    kinematics: str, joints: str, place: tuple[int, int], reason: str, hint: str
) -> None:
    error = refusal(machine(kinematics, joints))
    assert reason in error.reason
    assert hint in str(error.hint)
    assert (error.line, error.column) == place


def test_the_drives_of_axes_that_joints_move_are_refused() -> None:
    limits = "limits: {velocity_mm_s: 1, acceleration_mm_s2: 1}"
    error = refusal(f"kinematics: {{type: corexy}}\naxes:\n  y:\n    {limits}\n    drive: {{type: ideal}}\n")
    assert error.reason == "axes.y.drive: the drives of a corexy machine belong to its joints"
    assert error.hint == "list them below joints:, one each for q1, q2, q3"
    assert (error.line, error.column) == (5, 5)


def test_an_axis_that_no_joint_moves_keeps_its_drive() -> None:
    turning = "a: {limits: {velocity_deg_s: 1, acceleration_deg_s2: 1}, drive: {type: first_order_lag, time_constant_s: 0.01}}"
    setup = parse(f"kinematics: {{type: corexy}}\naxes: {{{turning}}}\n")
    assert setup.machine.axis("a").drive == FirstOrderLag(0.01)
    assert parse(dump_machine(setup)) == setup
    error = refusal(f"kinematics: {EVERY_KINEMATICS['trunnion_ac']}\naxes: {{{turning}}}\n")
    assert "axes.a.drive: the drives of a trunnion_ac machine" in error.reason


# --- the loop


@pytest.mark.parametrize("estimator", ["tangent", "foot_point", "circle"])
@pytest.mark.parametrize("form", ["vector", "scalar"])
def test_cross_coupling_arrives_and_survives(estimator: str, form: str) -> None:
    couple = f"{{estimator: {estimator}, form: {form}, proportional_per_s: 8, integral_per_s2: 3, derivative: 1.5}}"
    setup = parse(AXES + f"control: {{cross_coupling: {couple}, jacobian_every: 7}}\n")
    found = setup.control.cross_coupling
    assert found is not None
    assert (found.estimator.name.lower(), found.form.name.lower()) == (estimator, form)
    assert (found.proportional, found.integral, found.derivative, found.orientation) == (8.0, 3.0, 1.5, 0.0)
    assert setup.control.jacobian_every == 7
    assert parse(dump_machine(setup)) == setup


def test_cross_coupling_looks_for_the_foot_point_unless_told_otherwise() -> None:
    setup = parse(AXES + "control: {cross_coupling: {proportional_per_s: 8}}\n")
    assert setup.control.cross_coupling == CrossCoupling(8.0, Estimator.FOOT_POINT)


@pytest.mark.parametrize("name", ["cubic_parallel", "stewart", "trunnion_ac"])
def test_a_tool_that_turns_has_a_gain_for_its_orientation(name: str) -> None:
    control = "control: {cross_coupling: {proportional_per_s: 8, orientation_per_s: 20}}\n"
    setup = parse(machine(EVERY_KINEMATICS[name], control))
    assert setup.control.cross_coupling == CrossCoupling(8.0, Estimator.FOOT_POINT, orientation=20.0)
    assert parse(dump_machine(setup)) == setup


@pytest.mark.parametrize("name", ["corexy", "linear_delta"])
def test_a_tool_that_does_not_turn_has_none(name: str) -> None:
    couple = "control: {cross_coupling: {proportional_per_s: 8, orientation_per_s: "
    assert parse(machine(EVERY_KINEMATICS[name], couple + "0}}\n"))
    error = refusal(machine(EVERY_KINEMATICS[name], couple + "1}}\n"))
    assert error.reason.endswith(f"orientation_per_s: the tool of a {name} machine does not turn")
    assert (error.line, error.column) == (3, 70)


# --- bundled machines


def test_the_cubic_machine_is_that_of_paper_004() -> None:
    setup = load_machine(bundled("cubic_parallel.yaml"))
    tau = [0.0153, 0.0142, 0.0160, 0.0126, 0.0138, 0.0151]
    gain = [0.9930, 0.9982, 0.9755, 1.0029, 1.0004, 0.9901]
    assert setup.machine.joints == PLANTS == tuple(map(FirstOrderLag, tau, gain))
    assert setup.kinematics_choice.options == {
        "half_width_mm": 60.0, "link_length_mm": 300.0, "tool_offset_mm": [0.0, 0.0, -60.0],
    }  # fmt: skip
    assert [axis.name for axis in setup.machine.axes] == ["x", "y", "z"]
    for axis in setup.machine.axes:
        assert (axis.limits.velocity, axis.limits.acceleration) == (200.0, 2000.0)
        assert axis.limits.travel == (-60.0, 60.0)
    assert setup.control.position_gain == 20.0
    assert setup.control.feedforward == Feedforward(1.0, 1.0, 0.0148, 1.0)
    assert setup.control.cross_coupling == CrossCoupling(80.0, Estimator.FOOT_POINT)


@pytest.mark.parametrize(
    ("name", "kinematics", "joints"),
    [
        ("cubic_parallel", "cubic_parallel", ["q1", "q2", "q3", "q4", "q5", "q6"]),
        ("printer_corexy", "corexy", ["q1", "q2", "q3"]),
        ("trunnion_ac", "trunnion_ac", ["x", "y", "z", "a", "c"]),
        ("xy_stage", "cartesian", ["x", "y", "z"]),
    ],
)
def test_check_names_kinematics_and_joints(name: str, kinematics: str, joints: list[str], capsys) -> None:
    file = str(bundled(f"{name}.yaml"))
    assert run(["check", file, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["kinematics"], list(found["joints"])) == (kinematics, joints)
    assert set(found["joints"].values()) == {"first_order_lag"}
    assert run(["check", file]) == 0
    told = capsys.readouterr().out
    assert kinematics in told
    assert " ".join(joints) + " first_order_lag" in told


def test_check_tells_an_unstable_joint(tmp_path, capsys) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(machine("{type: corexy}", drives(3) + "control: {position_gain_per_s: 5000}\n"))
    assert run(["check", str(path), "--json"]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert "q1 is unstable" in error["message"]
    assert (error["line"], error["column"]) == (4, 10)


# --- fuzz

FILES = [
    machine(text, drives(n)) for text, n in ((EVERY_KINEMATICS["rails"], 6), (DELTA, 3), ("\n" + STEWART, 6))
]
PLACES = [(file, path) for file in FILES for path in key_places(yaml.safe_load(file))]
LEAVES = st.one_of(
    st.none(), st.integers(), st.floats(), st.sampled_from([[], {}, "corexy", "stewart", 0.0, 1e-3, 1e6, 300.0]),
    st.lists(st.sampled_from([0.0, 1.0, -1e6, 1e-300]), min_size=3, max_size=3),
)  # fmt: skip


@settings(max_examples=300, deadline=None)
@given(st.sampled_from(PLACES), LEAVES)
def test_any_value_anywhere_makes_a_setup_or_one_line(place: tuple[str, tuple], value: object) -> None:
    document = yaml.safe_load(place[0])
    owner = document
    for step in place[1][:-1]:
        owner = owner[step]
    owner[place[1][-1]] = value
    outcome = outcome_of(yaml.safe_dump(document).encode())
    if isinstance(outcome, CncShapeError):
        assert outcome.line
        assert outcome.hint
        assert "\n" not in outcome.reason
    else:
        assert isinstance(outcome, Setup)
        assert parse(dump_machine(outcome)) == outcome
