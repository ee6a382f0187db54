"""Servo motors, what their controllers do about loads, and the loads: every key, every refusal, every row."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from math import inf
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from test_machine_file import key_places, outcome_of, parse, refusal

from cnc_shape.cases import default_cases, pick_cases
from cnc_shape.cli import run
from cnc_shape.config import bundled, check_machine, dump_machine, load_machine
from cnc_shape.config.compensation_models import (
    DisturbanceObserverModel,
    FrictionFeedforwardModel,
    InertiaCompensationModel,
    InertiaIdentificationModel,
)
from cnc_shape.config.disturbance_models import (
    MAX_ROWS,
    EncoderNoiseModel,
    LoadTorqueModel,
    PulsesModel,
    SineBurstModel,
    StepsModel,
    TableModel,
)
from cnc_shape.config.drive_models import ServoMotorModel, VelocityLoopModel
from cnc_shape.config.setup import Setup
from cnc_shape.config.strict import Strict
from cnc_shape.config.template import machine_template
from cnc_shape.controllers import (
    Control,
    DisturbanceObserver,
    FrictionFeedforward,
    GainLaw,
    InertiaCompensation,
    InertiaIdentification,
)
from cnc_shape.disturbances import (
    UNDISTURBED,
    Disturbances,
    EncoderNoise,
    LoadTorque,
    PathDirection,
    ProfileTable,
    Pulses,
    SineBurst,
    Steps,
)
from cnc_shape.errors import CncShapeError, ConfigError, OptionError
from cnc_shape.machine import IdealDrive, ServoMotor, VelocityLoop
from cnc_shape.units import DEGREE

MOTOR = """\
      type: servo_motor
      inertia_kg_m2: 4.6e-4
      nominal_inertia_kg_m2: 5.0e-4
      torque_limit_nm: 7.1
      viscous_nm_s: 5.0e-4
      coulomb_nm: 0.08
      current_time_constant_s: 2.0e-4
      lead_mm_per_rev: 10
      encoder_counts_per_rev: 131072
      velocity_loop: {bandwidth_rad_s: 300, integral_time_s: 0.02, sample_time_s: 5.0e-4}
"""
AXES = (
    "axes:\n  x:\n    limits: {velocity_mm_s: 100, acceleration_mm_s2: 1000}\n    drive:\n" + MOTOR
)  # the motor begins on line 5
TERMS = """\
control:
  disturbance_observer: {bandwidth_rad_s: 150, feedforward: 0.8}
  inertia_compensation: {max_gain_ratio: 3, deadband_nm: 0.1, regularisation_rad_s2: 200, window_s: 0.03, attack_s: 0.02, release_s: 2, forgetting: 0.99, law: triggered, scale_integral_time: true, threshold_um: 7, torque_speed_slope_rad_s_nm: 3}
  friction_feedforward: {coulomb: 0.9, viscous: 0.5}
  inertia_identification: {forgetting_time_s: 2, excitation_rad_s2: 100, smallest_ratio: 0.5, largest_ratio: 3}
"""
LOADS = """\
disturbances:
  - {type: load_torque, direction: path_normal, peak_nm: 2.5, profile: {type: sine_burst, frequency_hz: 0.514, length_s: 6.91, centre_s: 9.4}}
  - {type: load_torque, direction: path_tangent, peak_nm: -1, profile: {type: pulses, start_s: 2, rise_s: 0.459, hold_s: 1, gap_s: 1.5, peaks: [1, 0.958, 0.958]}}
  - {type: load_torque, direction: x, peak_nm: 1.5, profile: {type: steps, times_s: [0, 1], levels: [1, -0.5]}}
  - {type: load_torque, direction: path_binormal, profile: {type: table, times_s: [0, 0.5, 2], torques_nm: [0, 1.1, 0.3]}}
  - {type: encoder_noise, standard_deviation_counts: 0.5, seed: 7}
"""
EVERYTHING = AXES + TERMS + LOADS
MACHINE = ServoMotor(
    4.6e-4, 7.1, 10.0, 5e-4, 0.08, 2e-4, 131072, VelocityLoop(300.0, 0.02, 5e-4), nominal_inertia=5e-4
)


def test_every_key_of_motors_and_loads_arrives() -> None:
    setup = parse(EVERYTHING)
    assert setup.machine.axes[0].drive == MACHINE
    assert setup.control == Control(
        disturbance_observer=DisturbanceObserver(150.0, 0.8),
        inertia_compensation=InertiaCompensation(
            3.0, 0.1, 200.0, 0.03, 0.02, 2.0, 0.99, GainLaw.TRIGGERED, True, 7e-3, 3.0
        ),
        friction_feedforward=FrictionFeedforward(0.9, 0.5),
        inertia_identification=InertiaIdentification(2.0, 100.0, 0.5, 3.0),
    )
    assert setup.disturbances == Disturbances(
        (
            LoadTorque(PathDirection.NORMAL, 2.5, SineBurst(0.514, 6.91, 9.4)),
            LoadTorque(PathDirection.TANGENT, -1.0, Pulses(2.0, 0.459, 1.0, 1.5, (1.0, 0.958, 0.958))),
            LoadTorque("x", 1.5, Steps((0.0, 1.0), (1.0, -0.5))),
            LoadTorque(PathDirection.BINORMAL, 1.0, ProfileTable((0.0, 0.5, 2.0), (0.0, 1.1, 0.3))),
        ),
        EncoderNoise(0.5, 7),
    )


def test_what_a_motor_leaves_out_has_its_default() -> None:
    least = "{type: servo_motor, inertia_kg_m2: 1e-3, torque_limit_nm: 2, lead_mm_per_rev: 5}"
    setup = parse(f"axes: {{x: {{limits: {{velocity_mm_s: 1, acceleration_mm_s2: 1}}, drive: {least}}}}}\n")
    assert setup.machine.axes[0].drive == ServoMotor(1e-3, 2.0, 5.0)
    assert setup.control == Control()
    assert setup.disturbances == UNDISTURBED
    terms = "control: {disturbance_observer: {}, inertia_compensation: {}, friction_feedforward: {}, inertia_identification: {}}"
    assert parse(AXES + terms).control == Control(
        disturbance_observer=DisturbanceObserver(300.0, 1.0),
        inertia_compensation=InertiaCompensation(),
        friction_feedforward=FrictionFeedforward(1.0, 1.0),
        inertia_identification=InertiaIdentification(1.0, 200.0),
    )


@pytest.mark.parametrize(
    ("given_as", "share"), [("true", 1.0), ("false", 0.0), ("0.5", 0.5), ("-1", -1.0), ("1", 1.0)]
)
def test_feedforward_of_the_observer_is_a_word_or_a_share(given_as: str, share: float) -> None:
    setup = parse(AXES + f"control: {{disturbance_observer: {{feedforward: {given_as}}}}}\n")
    assert setup.control.disturbance_observer == DisturbanceObserver(300.0, share)
    assert parse(dump_machine(setup)) == setup


@pytest.mark.parametrize("law", GainLaw)
def test_every_law_of_the_gain_has_a_word(law: GainLaw) -> None:
    setup = parse(AXES + f"control: {{inertia_compensation: {{law: {law.name.lower()}}}}}\n")
    assert setup.control.inertia_compensation == InertiaCompensation(law=law)
    assert parse(dump_machine(setup)) == setup


def test_a_rotary_axis_has_its_lead_in_degrees() -> None:
    rotary = MOTOR.replace("lead_mm_per_rev: 10", "lead_deg_per_rev: 3.6")
    setup = parse(
        "axes:\n  a:\n    limits: {velocity_deg_s: 9, acceleration_deg_s2: 9}\n    drive:\n" + rotary
    )
    drive = setup.machine.axes[0].drive
    assert isinstance(drive, ServoMotor)
    assert drive.lead == 3.6 * DEGREE
    assert "lead_deg_per_rev: 3.6\n" in dump_machine(setup)
    assert parse(dump_machine(setup)) == setup


def test_a_velocity_loop_without_an_integral_has_no_end_of_integral_time() -> None:
    setup = parse(AXES.replace("integral_time_s: 0.02", "integral_time_s: .inf"))
    drive = setup.machine.axes[0].drive
    assert isinstance(drive, ServoMotor)
    assert drive.velocity_loop.integral_time == inf
    assert parse(dump_machine(setup)) == setup


JOINT = "{type: servo_motor, inertia_kg_m2: 1e-3, torque_limit_nm: 2, lead_mm_per_rev: 5}"
TURNED = JOINT.replace("lead_mm", "lead_deg")
TABLE_LIMITS = "{velocity_mm_s: 1, acceleration_mm_s2: 1}"


def test_joints_have_servo_motors_with_the_lead_of_what_they_move() -> None:
    trunnion = "kinematics: {type: trunnion_ac, pivot_mm: [0, 0, -50]}\n"
    drives = [JOINT] * 3 + [TURNED] * 2
    joints = "joints:\n" + "".join(f"  - drive: {drive}\n" for drive in drives)
    setup = parse(f"axes: {{x: {{limits: {TABLE_LIMITS}}}}}\n{trunnion}{joints}")
    motors = setup.machine.joints
    assert all(isinstance(motor, ServoMotor) for motor in motors)
    assert [motor.lead for motor in motors if isinstance(motor, ServoMotor)] == [5.0] * 3 + [5.0 * DEGREE] * 2
    assert parse(dump_machine(setup)) == setup
    wrong = joints.replace(TURNED, JOINT, 1)
    error = refusal(f"axes: {{x: {{limits: {TABLE_LIMITS}}}}}\n{trunnion}{wrong}")
    assert error.reason == "joints[3].drive.lead_mm_per_rev: a moves in degrees"
    assert (error.line, error.hint) == (7, "give lead_deg_per_rev")


@pytest.mark.parametrize("text", [EVERYTHING, AXES, AXES + LOADS, AXES + TERMS])
def test_a_setup_survives_being_written_and_read(text: str) -> None:
    setup = parse(text)
    again = parse(dump_machine(setup))
    assert again == setup
    assert dump_machine(again) == dump_machine(setup)


MEANT = st.floats(1e-6, 1e3)


@settings(deadline=None, max_examples=100, derandomize=True)
@given(
    threshold=st.floats(1e-6, 1e6), lead=MEANT, peak=st.floats(-1e3, 1e3), levels=st.lists(MEANT, min_size=2)
)
def test_numbers_survive_exactly(threshold: float, lead: float, peak: float, levels: list[float]) -> None:
    times = list(range(len(levels)))
    table = f"{{type: table, times_s: {times}, torques_nm: {levels}}}"
    setup = parse(
        AXES.replace("lead_mm_per_rev: 10", f"lead_mm_per_rev: {lead!r}")
        + f"control: {{inertia_compensation: {{law: triggered, threshold_um: {threshold!r}}}}}\n"
        + f"disturbances: [{{type: load_torque, direction: x, peak_nm: {peak!r}, profile: {table}}}]\n"
    )
    assert parse(dump_machine(setup)) == setup


# --- refusals


@pytest.mark.parametrize("path", key_places(yaml.safe_load(EVERYTHING)), ids=lambda p: ".".join(map(str, p)))
def test_every_misspelt_key_is_refused_where_it_stands(path: tuple[object, ...]) -> None:
    document = yaml.safe_load(EVERYTHING)
    owner = document
    for step in path[:-1]:
        owner = owner[step]
    wrong = f"{path[-1]}_"
    renamed = {(wrong if key == path[-1] else key): value for key, value in owner.items()}
    owner.clear()
    owner.update(renamed)
    text = yaml.safe_dump(document, sort_keys=False)
    error = refusal(text)
    if path[-1] == "type":
        assert error.reason.endswith("type is missing")
        return
    line = text.splitlines()[(error.line or 0) - 1]
    assert error.reason.endswith(f"{wrong}: unknown key")
    assert line[(error.column or 0) - 1 :].startswith(wrong)
    assert str(path[-1]) in (error.hint or "")


@pytest.mark.parametrize(
    ("key", "value", "reason"),
    [
        ("inertia_kg_m2: 4.6e-4", "inertia_kg_m2: 0", "must be at least 1e-09, not 0"),
        ("inertia_kg_m2: 4.6e-4", "inertia_kg_m2: 4.6e+6", "must be at most 10000"),
        ("nominal_inertia_kg_m2: 5.0e-4", "nominal_inertia_kg_m2: -1", "must be at least 1e-09, not -1"),
        ("torque_limit_nm: 7.1", "torque_limit_nm: 0", "must be at least 1e-06, not 0"),
        ("viscous_nm_s: 5.0e-4", "viscous_nm_s: -1", "must be at least 0, not -1"),
        ("coulomb_nm: 0.08", "coulomb_nm: -0.08", "must be at least 0, not -0.08"),
        ("coulomb_nm: 0.08", "coulomb_nm: 7.1", "friction of 7.1 N m holds a motor of 7.1 N m for ever"),
        ("current_time_constant_s: 2.0e-4", "current_time_constant_s: 2", "must be at most 1, not 2"),
        ("lead_mm_per_rev: 10", "lead_mm_per_rev: 0", "must be at least 1e-06, not 0"),
        ("lead_mm_per_rev: 10", "lead_mm_per_rev: -10", "must be at least 1e-06, not -10"),
        ("encoder_counts_per_rev: 131072", "encoder_counts_per_rev: -1", "must be at least 0, not -1"),
        ("encoder_counts_per_rev: 131072", "encoder_counts_per_rev: 0.5", "must be a whole number"),
        ("bandwidth_rad_s: 300", "bandwidth_rad_s: 0", "must be at least 0.001, not 0"),
        ("integral_time_s: 0.02", "integral_time_s: 0", "must be at least 1e-06, not 0"),
        ("integral_time_s: 0.02", "integral_time_s: .nan", "integral_time_s: must be"),
        (
            "sample_time_s: 5.0e-4",
            "sample_time_s: 3.0e-4",
            "0.001 s is not a whole number of ticks of 0.0003 s",
        ),
        (
            "sample_time_s: 5.0e-4",
            "sample_time_s: 2.0e-3",
            "0.001 s is not a whole number of ticks of 0.002 s",
        ),
        ("sample_time_s: 5.0e-4", "sample_time_s: 1.0", "0.001 s is not a whole number of ticks of 1 s"),
    ],
)
def test_what_a_motor_cannot_be_is_refused_at_its_place(key: str, value: str, reason: str) -> None:
    text = AXES.replace(key, value)
    assert text != AXES
    error = refusal(text)
    assert reason in error.reason
    number = value.split(": ")[1]
    line = text.splitlines()[(error.line or 0) - 1]
    assert line[(error.column or 0) - 1 :].startswith(number)
    assert value.split(":")[0] in error.reason


def test_a_motor_needs_its_lead() -> None:
    error = refusal(AXES.replace("      lead_mm_per_rev: 10\n", ""))
    assert error.reason == "axes.x.drive: lead_mm_per_rev is missing"
    assert (error.line, error.column) == (5, 7)
    error = refusal(AXES.replace("lead_mm_per_rev", "lead_deg_per_rev"))
    assert error.reason == "axes.x.drive.lead_deg_per_rev: x moves in mm"
    assert (error.line, error.column) == (12, 7)


def test_too_many_ticks_in_a_sample_are_refused() -> None:
    error = refusal(AXES.replace("5.0e-4}", "1.0e-5}") + "control: {sample_time_s: 0.1}\n")
    assert "10000 ticks of 1e-05 s in a sample of 0.1 s" in error.reason
    assert error.line == 14


@pytest.mark.parametrize("sample", ["3e-4", "0.0007", "1e-3"])
def test_a_whole_number_of_ticks_is_one_in_decimals(sample: str) -> None:
    text = AXES.replace("sample_time_s: 5.0e-4", "sample_time_s: 1.0e-4")
    assert parse(text + f"control: {{sample_time_s: {sample}}}\n").control.sample_time == float(sample)


def test_motors_whose_loops_tick_apart_are_refused_at_the_second() -> None:
    other = AXES.replace("axes:\n", "").replace("  x:", "  y:").replace("5.0e-4}", "2.5e-4}")
    error = refusal(AXES + other)
    assert "velocity_loop.sample_time_s: ticks every 0.00025 s, that of axes.x.drive every" in error.reason
    assert error.line == 27
    assert parse(AXES + other.replace("2.5e-4}", "5.0e-4}"))


def test_identification_remembers_enough_samples_to_tell_three_numbers_apart() -> None:
    short = "control: {sample_time_s: 0.001, inertia_identification: {forgetting_time_s: %s}}\n"
    with pytest.raises(ConfigError, match=r"0\.01 s are 10 samples, too few") as refused:
        parse(AXES + short % "0.01")
    assert refused.value.hint == "remember 50 samples or more: 0.05 s"
    line, column = refused.value.line, refused.value.column
    assert (AXES + short).splitlines()[line - 1][column - 1 :].startswith("%s")
    parse(AXES + short % "0.05")


def test_the_file_of_a_load_is_neither_a_pipe_nor_standard_input(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    load = "disturbances: [{type: load_torque, direction: x, profile: {type: table, file: %s}}]\n"
    (tmp_path / "input.yaml").write_text(AXES + load % '"-"')
    with pytest.raises(ConfigError, match="no such file"):
        load_machine("input.yaml")
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "pipe.yaml").write_text(AXES + load % "pipe.csv")
    with pytest.raises(ConfigError, match=r"pipe\.csv: is a pipe or a device"):
        load_machine("pipe.yaml")


NONE = "axes: {x: {limits: {velocity_mm_s: 100, acceleration_mm_s2: 1000}}}\n"


@pytest.mark.parametrize(
    ("text", "place", "reason"),
    [
        (
            "control: {disturbance_observer: {}}",
            (2, 11),
            "control.disturbance_observer: acts on servo motors",
        ),
        (
            "control: {inertia_compensation: {}}",
            (2, 11),
            "control.inertia_compensation: acts on servo motors",
        ),
        (
            "control: {friction_feedforward: {}}",
            (2, 11),
            "control.friction_feedforward: acts on servo motors",
        ),
        ("control: {inertia_identification: {}}", (2, 11), "control.inertia_identification: acts on servo"),
        (
            "disturbances: [{type: encoder_noise, standard_deviation_counts: 1}]",
            (2, 16),
            "encoder_noise acts on",
        ),
    ],
)
def test_what_acts_on_motors_needs_one(text: str, place: tuple[int, int], reason: str) -> None:
    error = refusal(NONE + text)
    assert reason in error.reason
    assert error.reason.endswith("and the machine has none")
    assert (error.line, error.column) == place


def test_no_disturbance_needs_no_motor() -> None:
    assert parse(NONE + "disturbances: []").disturbances == UNDISTURBED


def load(more: str) -> str:
    """A machine under one load, on line 15."""
    return AXES + f"disturbances: [{{type: load_torque, {more}}}]\n"


BURST = "profile: {type: sine_burst, frequency_hz: 1, length_s: 1, centre_s: 1}"


@pytest.mark.parametrize(
    ("more", "at", "reason"),
    [
        (f"peak_nm: 1, {BURST}", "{type: load", "direction is missing"),
        (f"direction: x, {BURST}", "{type: load", "peak_nm is missing"),
        (f"direction: w, peak_nm: 1, {BURST}", "w, ", "direction: must be path_normal, path_tangent, path_binormal, x,"),
        (f"direction: y, peak_nm: 1, {BURST}", "y, ", "direction: the machine has no axis y"),
        (f"direction: x, peak_nm: 1e7, {BURST}", "1e7", "peak_nm: must be at most 1e+06"),
        (f"direction: x, peak_nm: .nan, {BURST}", ".nan", "peak_nm: must be finite, not nan"),
        ("direction: x, peak_nm: 1, profile: {type: sine}", "sine}", "must be sine_burst, pulses, steps or table"),
        ("direction: x, peak_nm: 1, profile: {type: sine_burst, frequency_hz: 0, length_s: 1, centre_s: 1}", "0, l", "at least"),
        ("direction: x, peak_nm: 1, profile: {type: sine_burst, frequency_hz: 1, length_s: 0, centre_s: 1}", "0, c", "at least"),
        ("direction: x, peak_nm: 1, profile: {type: pulses, start_s: 1, rise_s: 0, hold_s: 1, gap_s: 1, peaks: [1]}", "0, h", "at least"),
        ("direction: x, peak_nm: 1, profile: {type: pulses, start_s: 1, rise_s: 1, hold_s: 1, gap_s: 1, peaks: []}", "[]", "at least 1"),
        ("direction: x, peak_nm: 1, profile: {type: pulses, start_s: 1, rise_s: 1, hold_s: 1, gap_s: 1, peaks: [99]}", "99", "at most 10"),
        ("direction: x, peak_nm: 1, profile: {type: steps, times_s: [1, 3, 3], levels: [1, 2, 3]}", "3], l", "times_s[2]: 3 s is not after 3 s"),
        ("direction: x, peak_nm: 1, profile: {type: steps, times_s: [1, 3], levels: [1, 2, 3]}", "[1, 2", "levels: 3 values at 2 times"),
        ("direction: x, profile: {type: table, times_s: [1, 3], torques_nm: [1, 2, 3]}", "[1, 2", "torques_nm: 3 values at 2 times"),
        ("direction: x, profile: {type: table, times_s: [2, 1], torques_nm: [1, 2]}", "1], t", "times_s[1]: 1 s is not after 2 s"),
        ("direction: x, profile: {type: table, times_s: [2, 3]}", "{type: table", "profile: torques_nm is missing"),
        ("direction: x, profile: {type: table}", "{type: table", "profile: file is missing"),
        ("direction: x, profile: {type: table, file: l.csv, times_s: [1, 2]}", "times_s", "times_s: the table is in a file"),
        ("direction: x, peak_nm: 3, profile: {type: table, times_s: [1, 2], torques_nm: [0, 0]}", "3, p", "zeros has no peak"),
        ("direction: x, profile: {type: table, file: gone.csv}", "gone.csv", "profile.file: gone.csv: cannot read: no such file"),
    ],
)  # fmt: skip
def test_what_a_load_cannot_be_is_refused_at_its_place(more: str, at: str, reason: str) -> None:
    text = load(more)
    error = refusal(text)
    assert reason in error.reason
    assert error.line == 15
    assert text.splitlines()[14][(error.column or 0) - 1 :].startswith(at)


def test_a_load_along_an_axis_without_a_motor_is_refused() -> None:
    text = load(f"direction: y, peak_nm: 1, {BURST}").replace(
        "axes:\n", f"axes:\n  y: {{limits: {TABLE_LIMITS}}}\n"
    )
    error = refusal(text)
    assert error.reason == "disturbances[0].direction: axis y has no servo motor to feel it"
    assert error.line == 16


def test_noise_is_given_once_and_needs_an_encoder_that_counts() -> None:
    noise = "{type: encoder_noise, standard_deviation_counts: 1}"
    error = refusal(AXES + f"disturbances: [{noise}, {noise}]\n")
    assert error.reason == "disturbances[1]: a second encoder_noise"
    assert (error.line, error.column) == (15, 17 + len(noise) + 1)
    exact = AXES.replace("      encoder_counts_per_rev: 131072\n", "")
    assert "no motor has an encoder that counts" in refusal(exact + f"disturbances: [{noise}]\n").reason


# --- the file of a load


def with_table(folder: Path, text: str | bytes, more: str = "") -> Path:
    """A machine whose load is the table `text`, in a folder of its own beside it."""
    (folder / "loads").mkdir()
    data = text if isinstance(text, bytes) else text.encode()
    (folder / "loads" / "load.csv").write_bytes(data)
    machine = folder / "machine.yaml"
    machine.write_text(load(f"direction: x, {more}profile: {{type: table, file: loads/load.csv}}"))
    return machine


@pytest.mark.parametrize(
    "text",
    [
        "time_s,torque_nm\n0,0\n0.5,1.1\n2,-0.3\n",
        "\ufeff torque_nm , time_s\r\n\r\n 0 ,0\r\n1.1,5e-1\r\n-.3,2.\r\n",
    ],
)
def test_a_load_is_read_from_a_file_beside_the_machine_and_written_into_it(tmp_path: Path, text: str) -> None:
    setup = load_machine(with_table(tmp_path, text))
    want = ProfileTable((0.0, 0.5, 2.0), (0.0, 1.1, -0.3))
    assert setup.disturbances.loads == (LoadTorque("x", 1.0, want),)
    alone = dump_machine(setup)
    assert "load.csv" not in alone
    assert parse(alone) == setup


def test_a_peak_scales_a_table(tmp_path: Path) -> None:
    setup = load_machine(with_table(tmp_path, "time_s,torque_nm\n0,0\n1,3\n2,-4\n", "peak_nm: 2, "))
    assert setup.disturbances.loads[0] == LoadTorque(
        "x", 2.0, ProfileTable((0.0, 1.0, 2.0), (0.0, 0.75, -1.0))
    )
    assert parse(dump_machine(setup)) == setup


@pytest.mark.parametrize(
    ("text", "place", "reason"),
    [
        ("", (15, None), "the file is empty"),
        ("\n\n", (1, 1), "the table is empty"),
        ("time_s,torque_nm\n0,0\n", (2, 1), "a table needs two rows"),
        ("time_s\n0\n1\n", (1, 1), "no column torque_nm"),
        ("time_s,torque\n0,0\n1,1\n", (1, 8), "unknown column 'torque'"),
        ("time_s,torque_nm,time_s\n0,0,0\n1,1,1\n", (1, 18), "a second column time_s"),
        ("0,0\n1,1\n", (1, 1), "unknown column '0'"),
        ("time_s,torque_nm\n0,0\n1\n", (3, 1), "1 cells, the header has 2"),
        ("time_s,torque_nm\n0,0\n1,2,3\n", (3, 1), "3 cells, the header has 2"),
        ("time_s,torque_nm\n0,0\n1, nan\n", (3, 4), "'nan' is no number for torque_nm"),
        ("time_s,torque_nm\n0,0\n1,1e999\n", (3, 3), "torque_nm is beyond the limit of 1e+06"),
        ("time_s,torque_nm\n0,0\n1,-2e6\n", (3, 3), "torque_nm is beyond the limit of 1e+06"),
        ("time_s,torque_nm\n0,0\none,1\n", (3, 1), "'one' is no number for time_s"),
        ("time_s,torque_nm\n0,0\n\n0,1\n", (4, 1), "0 s is not after 0 s"),
        ("time_s,torque_nm\n0,0\n1,\0\n", (3, 3), "NUL byte"),
        ("time_s,torque_nm\n0,0\n".encode("utf-16"), (1, 1), "UTF-16"),
    ],
)
def test_a_fault_in_the_file_of_a_load_is_told_at_its_own_line(
    tmp_path: Path, text: str | bytes, place: tuple[int, int | None], reason: str
) -> None:
    machine = with_table(tmp_path, text)
    with pytest.raises(ConfigError) as caught:
        load_machine(machine)
    error = caught.value
    assert reason in error.reason
    assert error.hint
    where = machine if place[1] is None else tmp_path / "loads" / "load.csv"
    assert error.source == str(where)
    assert error.line == place[0]
    if place[1] is not None:
        assert error.column == place[1]


def test_tables_as_large_as_they_may_be_survive_being_written_and_read(tmp_path: Path) -> None:
    rows = "".join(f"{i / 1000},{i / 7!r}\n" for i in range(MAX_ROWS))
    machine = with_table(tmp_path, "time_s,torque_nm\n" + rows)
    setup = load_machine(machine)
    assert parse(dump_machine(setup)) == setup
    (tmp_path / "loads" / "load.csv").write_text("time_s,torque_nm\n" + rows + "99,0\n")
    with pytest.raises(ConfigError, match=f"more than {MAX_ROWS} rows") as caught:
        load_machine(machine)
    assert caught.value.line == MAX_ROWS + 2


def test_tables_may_not_be_larger_together(tmp_path: Path) -> None:
    rows = "".join(f"{i},{i}\n" for i in range(MAX_ROWS // 2 + 1))
    machine = with_table(tmp_path, "time_s,torque_nm\n" + rows)
    one = "  - {type: load_torque, direction: x, profile: {type: table, file: loads/load.csv}}\n"
    machine.write_text(AXES + "disturbances:\n" + one + one)
    with pytest.raises(ConfigError, match="have at most 10000 rows together, not 10002") as caught:
        load_machine(machine)
    assert caught.value.line == 17


# --- the rows of a machine's table


def names(setup: Setup) -> list[str]:
    return [case.name for case in default_cases(setup)]


def test_a_row_more_for_every_term_and_each_of_them_disturbed() -> None:
    setup = parse(AXES + TERMS)
    assert names(setup) == [
        "independent",
        "disturbance_observer",
        "disturbance_observer+inertia_compensation",
    ]
    coupled = parse(AXES + TERMS + "  cross_coupling: {proportional_per_s: 20}\n")
    assert names(coupled) == [
        "independent", "cross_coupled", "cross_coupled+disturbance_observer",
        "cross_coupled+disturbance_observer+inertia_compensation",
    ]  # fmt: skip
    assert names(parse(AXES + LOADS)) == ["independent", "independent+disturbed"]
    assert names(parse(EVERYTHING))[1::2] == [name + "+disturbed" for name in names(setup)]
    assert names(parse(EVERYTHING))[::2] == names(setup)


def test_rows_of_a_machine_with_shapers() -> None:
    stage = load_machine(bundled("xy_stage.yaml"))
    control = replace(stage.control, disturbance_observer=DisturbanceObserver())
    setup = replace(stage, control=control, disturbances=Disturbances(noise=EncoderNoise(1.0)))
    assert names(setup)[::2] == [
        "unshaped", "shaped", "shaped+cross_coupled", "shaped+cross_coupled+disturbance_observer",
    ]  # fmt: skip
    more = ["shaped+disturbance_observer", "axis_shaped+disturbed", "shaped-feedforward+disturbed"]
    assert [case.name for case in pick_cases(setup, more)] == more


def test_every_subset_of_the_terms_is_known() -> None:
    setup = parse(EVERYTHING + "planning: {shaping: none}\n")
    watching = DisturbanceObserver(150.0, 0.0)
    compensation = setup.control.inertia_compensation
    for name, observer, compensated in [
        ("independent", watching, None),  # identification needs it in every row
        ("disturbance_observer", DisturbanceObserver(150.0, 0.8), None),
        ("inertia_compensation", watching, compensation),
        ("disturbance_observer+inertia_compensation", DisturbanceObserver(150.0, 0.8), compensation),
    ]:
        calm, disturbed = pick_cases(setup, [name, name + "+disturbed"])
        assert calm.control.disturbance_observer == observer
        assert calm.control.inertia_compensation == compensated
        assert calm.control.friction_feedforward == setup.control.friction_feedforward
        assert calm.control.inertia_identification == setup.control.inertia_identification
        assert (calm.disturbances, disturbed.disturbances) == (UNDISTURBED, setup.disturbances)
        assert disturbed.control == calm.control
    with pytest.raises(OptionError, match="no case called 'inertia_compensation\\+disturbance_observer'"):
        pick_cases(setup, ["inertia_compensation+disturbance_observer"])


def test_compensation_watches_the_load_even_where_no_observer_is_asked_for() -> None:
    setup = parse(AXES + "control: {inertia_compensation: {}}\n")
    plain, compensated = default_cases(setup)
    assert (plain.name, compensated.name) == ("independent", "inertia_compensation")
    assert plain.control.disturbance_observer is None
    assert compensated.control.disturbance_observer == DisturbanceObserver(300.0, 0.0)


# --- the bundled machine, and check


def test_the_servo_machine_is_that_of_paper_003() -> None:
    setup = load_machine(bundled("servo_three_axis.yaml"))
    motor = ServoMotor(4.6e-4, 7.1, 10.0, 5e-4, 0.0808, 2e-4, 131072, VelocityLoop(400.0, 0.01, 2.5e-4))
    assert [(axis.name, axis.drive) for axis in setup.machine.axes] == [(name, motor) for name in "xyz"]
    assert setup.control == Control(
        sample_time=1e-3,
        position_gain=44.67,
        disturbance_observer=DisturbanceObserver(300.0, 1.0),
        inertia_compensation=InertiaCompensation(2.5, 0.12, 261.0, 0.02, 0.01, 1.0, 0.995),
    )
    burst = SineBurst(0.514, 6.91, 9.4)
    assert setup.disturbances == Disturbances((LoadTorque(PathDirection.NORMAL, 2.5, burst),))


def test_check_tells_motors_terms_and_disturbances(tmp_path: Path) -> None:
    path = tmp_path / "machine.yaml"
    path.write_text(EVERYTHING)
    found = check_machine(path)
    assert found["joints"] == {"x": "servo_motor"}
    assert found["motor_terms"] == [
        "disturbance_observer", "inertia_compensation", "friction_feedforward", "inertia_identification",
    ]  # fmt: skip
    keys = ("type", "direction", "largest_torque_nm", "profile")
    rows = [
        ("load_torque", "path_normal", 2.5, "sine_burst"),
        ("load_torque", "path_tangent", 1.0, "pulses"),
        ("load_torque", "x", 1.5, "steps"),
        ("load_torque", "path_binormal", 1.1, "table"),
    ]
    noise = {"type": "encoder_noise", "standard_deviation_counts": 0.5}
    assert found["disturbances"] == [*(dict(zip(keys, row, strict=True)) for row in rows), noise]


# --- fuzz

LEAVES = st.one_of(
    st.none(), st.booleans(), st.integers(-3, 10**9), st.floats(), st.just([]), st.just({}),
    st.lists(st.floats(-2.0, 2.0), max_size=4),
    st.sampled_from(["servo_motor", "ideal", "x", "y", "table", "path_normal", "fixed", "load.csv", 0, 5e-4, 1e-3]),
)  # fmt: skip


@settings(max_examples=300, deadline=None)
@given(st.sampled_from(key_places(yaml.safe_load(EVERYTHING))), LEAVES)
def test_any_value_anywhere_makes_a_setup_or_one_line(path: tuple[object, ...], value: object) -> None:
    document = yaml.safe_load(EVERYTHING)
    owner = document
    for step in path[:-1]:
        owner = owner[step]
    owner[path[-1]] = value
    outcome = outcome_of(yaml.safe_dump(document).encode())
    if isinstance(outcome, CncShapeError):
        assert outcome.line
        assert outcome.hint
        assert "\n" not in outcome.reason
    else:
        assert parse(dump_machine(outcome)) == outcome
        assert outcome.machine.axes[0].drive != IdealDrive() or not outcome.disturbances


# --- what is written about it


def uncommented(text: str) -> str:
    """The template with its examples of motors, terms and loads in place."""
    begin = ("    # drive:", "  # disturbance_observer:", "# disturbances:")
    lines, acting = list[str](), False
    for line in text.replace("    drive: {type: first_order_lag, time_constant_s: 0.012}\n", "").splitlines():
        acting = line.lstrip().startswith("#") and (acting or line.startswith(begin))
        lines.append(line.replace("# ", "", 1) if acting else line)
    return "\n".join(lines)


def test_the_examples_in_the_template_are_good() -> None:
    setup = parse(uncommented(machine_template()))
    assert isinstance(setup.machine.axis("z").drive, ServoMotor)
    assert setup.control.disturbance_observer == DisturbanceObserver(300.0, 1.0)
    assert setup.control.inertia_compensation == InertiaCompensation(2.5, 0.12, 261.0)
    assert setup.control.friction_feedforward == FrictionFeedforward()
    assert setup.control.inertia_identification == InertiaIdentification()
    assert len(setup.disturbances.loads) == 1
    assert setup.disturbances.noise == EncoderNoise(0.5, 1)


SERVO_MODELS = [
    ServoMotorModel, VelocityLoopModel, DisturbanceObserverModel, InertiaCompensationModel, FrictionFeedforwardModel,
    InertiaIdentificationModel, LoadTorqueModel, EncoderNoiseModel, SineBurstModel, PulsesModel, StepsModel,
    TableModel,
]  # fmt: skip


@pytest.mark.parametrize("model", SERVO_MODELS, ids=lambda model: model.__name__)
def test_every_key_is_explained(model: type[Strict]) -> None:
    pages = Path(__file__).resolve().parent.parent / "docs" / "machine-file.md"
    told = pages.read_text(encoding="utf-8")
    for key in model.model_fields:
        assert key in told


# --- from the command line


def test_a_fault_in_the_file_of_a_load_ends_the_command_with_its_place(tmp_path: Path, capfd) -> None:
    machine = with_table(tmp_path, "time_s,torque_nm\n0,0\n1, nan\n")
    assert run(["check", str(machine)]) == 2
    told = capfd.readouterr().err
    assert f"{tmp_path}/loads/load.csv:3:4: error: 'nan' is no number for torque_nm\n" in told
    assert "hint: write it as 1.5 or 1e-3" in told


def test_a_load_from_a_file_reaches_the_motor(tmp_path: Path, capfd) -> None:
    machine = with_table(tmp_path, "time_s,torque_nm\n0,0\n0.05,1\n0.3,1\n")
    program = tmp_path / "line.nc"
    program.write_text("G21 G90\nG1 X2 F600\nM2\n")
    assert run(["simulate", str(program), "-m", str(machine), "--json"]) == 0
    calm, disturbed = json.loads(capfd.readouterr().out)["cases"]
    assert (calm["name"], disturbed["name"]) == ("independent", "independent+disturbed")
    assert disturbed["following_rms_um"]["x"] > 1.02 * calm["following_rms_um"]["x"]
    assert disturbed["following_rms_um"]["y"] == calm["following_rms_um"]["y"] == 0.0
