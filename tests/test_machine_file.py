"""The machine file: every key of the contract, every value at its place, nothing unknown, nothing ignored."""

from __future__ import annotations

import errno
import os
import pickle
from math import inf
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from cnc_shape.config import bundled, check_machine, dump_machine, load_machine
from cnc_shape.config.dump import to_degrees
from cnc_shape.config.machine_file import parse_machine
from cnc_shape.config.models import MachineModel
from cnc_shape.config.setup import Planning, Setup, ShaperChoice, Shaping
from cnc_shape.config.shaper_options import MODELS
from cnc_shape.config.strict import Strict
from cnc_shape.config.template import machine_template
from cnc_shape.controllers import Control, CrossCoupling, Estimator, Feedforward, Form
from cnc_shape.errors import CncShapeError, ConfigError, OptionError
from cnc_shape.limits import Limits, PathLimits
from cnc_shape.machine import Axis, FirstOrderLag, IdealDrive, Machine
from cnc_shape.modes import Mode
from cnc_shape.shapers import SHAPERS, cascade, zv, zvd
from cnc_shape.tools import Tool
from cnc_shape.units import DEGREE

BUNDLED = sorted((Path(__file__).resolve().parent.parent / "configs").glob("*.yaml"))

EVERY_KEY = """\
name: XY stage with two modes
kinematics: {type: cartesian}
axes:
  x:
    limits: {velocity_mm_s: 500, acceleration_mm_s2: 5000, jerk_mm_s3: 250000, travel_mm: [-200, 200]}
    drive: {type: first_order_lag, time_constant_s: 0.0153, gain: 0.9930}
    modes: [{frequency_hz: 30, damping_ratio: 0.02, frequency_uncertainty: 0.03}, {frequency_hz: 100, damping_ratio: 0.01, participation: 0.2}]
    shaper: {type: cascade, of: zvd}
  a:
    limits: {velocity_deg_s: 90, acceleration_deg_s2: 900, jerk_deg_s3: 9e4, travel_deg: [-120, 30.1]}
    drive: {type: ideal}
    shaper: {type: impulses, times_s: [0, 0.01], amplitudes: [0.6, 0.4]}
planning: {path_tolerance_mm: 0.02, shaping: none}
control:
  sample_time_s: 5e-4
  position_gain_per_s: 30
  delay_samples: 2
  feedforward: {velocity: 1, acceleration: 0.9, model_time_constant_s: 0.0148, model_gain: 1.0}
  cross_coupling: {estimator: circle, proportional_per_s: 80, integral_per_s2: 800, derivative: 1.16, form: scalar, orientation_per_s: 0}
  jacobian_every: 10
tools: [{number: 1, length_mm: 50, diameter_mm: 6}]
"""

SMALL = "axes: {x: {limits: {velocity_mm_s: 100, acceleration_mm_s2: 1000}}}\n"


def parse(text: str) -> Setup:
    return parse_machine(text.encode(), "machine.yaml")


def refusal(text: str) -> ConfigError:
    with pytest.raises(ConfigError) as caught:
        parse(text)
    error = caught.value
    assert error.hint
    assert "\n" not in error.reason + error.hint
    assert (error.source, error.code) == ("machine.yaml", "machine")
    return error


def with_axis(text: str) -> str:
    """A machine whose x axis also has the keys in `text`, which begins on line 3, column 5."""
    return f"axes:\n  x:\n    {text}\n    limits: {{velocity_mm_s: 100, acceleration_mm_s2: 1000}}\n"


def test_every_key_of_the_contract_arrives() -> None:
    modes = (Mode(30.0, 0.02, 0.8, 0.03), Mode(100.0, 0.01, 0.2))
    setup = parse(EVERY_KEY)
    assert setup == Setup(
        machine=Machine(
            "XY stage with two modes",
            (
                Axis(
                    "x", Limits(500.0, 5000.0, 250000.0, (-200.0, 200.0)), FirstOrderLag(0.0153, 0.993), modes
                ),
                Axis(
                    "a",
                    Limits(90.0 * DEGREE, 900.0 * DEGREE, 9e4 * DEGREE, (-120.0 * DEGREE, 30.1 * DEGREE)),
                ),
            ),
        ),
        planning=Planning(0.02, Shaping.NONE),
        control=Control(
            5e-4,
            30.0,
            2,
            Feedforward(1.0, 0.9, 0.0148, 1.0),
            CrossCoupling(80.0, Estimator.CIRCLE, 800.0, 1.16, Form.SCALAR),
            jacobian_every=10,
        ),
        tools=(Tool(1, 50.0, 6.0),),
        choices={
            "x": ShaperChoice("cascade", {"of": "zvd"}),
            "a": ShaperChoice("impulses", {"times_s": [0.0, 0.01], "amplitudes": [0.6, 0.4]}),
        },
    )
    assert_allclose(setup.shapers["x"].times, cascade(modes, zvd).times)
    assert_allclose(setup.shapers["a"].amplitudes, [0.6, 0.4])


def test_what_a_file_leaves_out_has_the_defaults_of_the_contract() -> None:
    setup = parse(SMALL)
    assert setup == Setup(Machine("machine", (Axis("x", Limits(100.0, 1000.0)),)))
    assert setup.planning == Planning(path_tolerance=0.01, shaping=Shaping.CONTOUR)
    assert setup.control == Control(sample_time=1e-3, position_gain=20.0)
    assert setup.machine.axes[0].drive == IdealDrive()
    assert setup.machine.axes[0].limits.travel == (-inf, inf)
    assert (setup.shapers, setup.tools, setup.warnings) == ({}, (), ())


@pytest.mark.parametrize(
    ("given_shares", "shares"),
    [
        ([None], [1.0]),
        ([None, None], [0.5, 0.5]),
        ([None, 0.2, None], [0.4, 0.2, 0.4]),
        ([0.7, 0.7], [0.7, 0.7]),
        ([-0.5, None], [-0.5, 1.5]),
    ],
)
def test_modes_without_a_participation_share_what_is_left_of_one(
    given_shares: list[float | None], shares: list[float]
) -> None:
    modes = [
        f"{{frequency_hz: {10 + i}, damping_ratio: 0{'' if share is None else f', participation: {share}'}}}"
        for i, share in enumerate(given_shares)
    ]
    setup = parse(with_axis(f"modes: [{', '.join(modes)}]"))
    assert_allclose([mode.participation for mode in setup.machine.axes[0].modes], shares)


def test_a_single_mode_shaper_takes_the_first_mode_and_says_so() -> None:
    modes = "modes: [{frequency_hz: 30, damping_ratio: 0.02}, {frequency_hz: 100, damping_ratio: 0.01}]"
    setup = parse(with_axis(modes + "\n    shaper: {type: zv}"))
    assert_allclose(setup.shapers["x"].times, zv(Mode(30.0, 0.02)).times)
    assert setup.warnings == ("machine.yaml:4: warning: axis x: zv cancels one mode, the first of 2 (30 Hz)",)


def test_a_shaper_of_type_none_is_no_shaper() -> None:
    assert parse(with_axis("shaper: {type: none}")).shapers == {}


def test_a_jerk_limit_is_the_axis_s() -> None:
    limits = "limits: {velocity_mm_s: 1, acceleration_mm_s2: 1, jerk_mm_s3: 5}"
    setup = parse(f"axes:\n  x: {{{limits}}}\n  y: {{{limits}}}\n")
    assert setup.machine.axes[1].limits.jerk == 5.0
    assert setup.warnings == ()


@pytest.mark.parametrize(
    ("keys", "limits"),
    [
        ("path_acceleration_mm_s2: 160", PathLimits(160.0)),
        ("interpolation_period_s: 0.008, chord_error_mm: 0.001", PathLimits(inf, 0.008, 0.001)),
        (
            "path_acceleration_mm_s2: 160, interpolation_period_s: 8e-3, chord_error_mm: 1e-3",
            PathLimits(160.0, 0.008, 0.001),
        ),
    ],
)
def test_limits_along_the_path_arrive_and_come_back(keys: str, limits: PathLimits) -> None:
    setup = parse(SMALL + f"planning: {{{keys}}}")
    assert setup.planning == Planning(path_limits=limits)
    assert parse(dump_machine(setup)) == setup


# --- refusals


def models(model: type[Strict]) -> set[type[Strict]]:
    """Every model below a machine file's."""
    found: set[type[Strict]] = set()
    waiting: list[type[Strict]] = [model, *MODELS]
    while waiting:
        now = waiting.pop()
        if now in found:
            continue
        found.add(now)
        hints: list[object] = [field.annotation for field in now.model_fields.values()]
        while hints:
            hint = hints.pop()
            hints += getattr(hint, "__args__", ())
            if isinstance(hint, type) and issubclass(hint, Strict):
                waiting.append(hint)
    return found


EVERY_MODEL = sorted(models(MachineModel), key=lambda model: model.__name__)


@pytest.mark.parametrize("model", EVERY_MODEL, ids=lambda model: model.__name__)
def test_every_model_is_strict(model: type[Strict]) -> None:
    config = model.model_config
    assert (config.get("strict"), config.get("extra"), config.get("allow_inf_nan")) == (True, "forbid", False)


def key_places(tree: object, path: tuple[object, ...] = ()) -> list[tuple[object, ...]]:
    if isinstance(tree, dict):
        return [p for key, value in tree.items() for p in [(*path, key), *key_places(value, (*path, key))]]
    if isinstance(tree, list):
        return [p for i, value in enumerate(tree) for p in key_places(value, (*path, i))]
    return []


def _misspelt(path: tuple[object, ...]) -> tuple[str, str]:
    """The complete machine file with the key at `path` misspelt, and that misspelling."""
    document = yaml.safe_load(EVERY_KEY.replace("5e-4", "0.0005").replace("9e4", "90000.0"))
    owner = document
    for step in path[:-1]:
        owner = owner[step]
    wrong = f"{path[-1]}_"
    renamed = {(wrong if key == path[-1] else key): value for key, value in owner.items()}
    owner.clear()
    owner.update(renamed)
    return yaml.safe_dump(document, sort_keys=False), wrong


@pytest.mark.parametrize(
    "path",
    key_places(yaml.safe_load(EVERY_KEY)),
    ids=lambda path: ".".join(map(str, path)),
)
def test_every_misspelt_key_is_refused_where_it_stands(path: tuple[object, ...]) -> None:
    text, wrong = _misspelt(path)
    error = refusal(text)
    line = text.splitlines()[(error.line or 0) - 1]
    if path[-1] == "type" and path[-2] in (
        "drive",
        "shaper",
        "kinematics",
    ):  # what the other keys mean hangs on it
        assert error.reason.endswith("type is missing")
        return
    assert error.reason.endswith(f"{wrong}: unknown key")
    assert line[(error.column or 0) - 1 :].startswith(wrong)
    meant = str(path[-1])
    assert error.hint in (f"did you mean {meant}?",) or meant in (error.hint or "")


@pytest.mark.parametrize(
    ("key", "meant"),
    [
        ("modes: [{frequncy_hz: 30, damping_ratio: 0}]", "frequency_hz"),
        ("modes: [{frequency: 30, damping_ratio: 0}]", "frequency_hz"),
        ("modes: [{Damping_Ratio: 0, frequency_hz: 30}]", "damping_ratio"),
        ("shapper: {type: zv}", "shaper"),
        ("drive: {type: first_order_lag, time_constant: 0.1}", "time_constant_s"),
    ],
)
def test_an_unknown_key_suggests_the_one_that_was_meant(key: str, meant: str) -> None:
    assert refusal(with_axis(key)).hint == f"did you mean {meant}?"


def test_an_error_prints_as_one_line_with_its_place() -> None:
    error = refusal("axes:\n  y:\n    modes: [{frequncy_hz: 30, damping_ratio: 0.1}]\n    limits: {}\n")
    assert str(error) == "machine.yaml:3:14: error: axes.y.modes[0].frequncy_hz: unknown key"


@pytest.mark.parametrize(
    ("text", "column", "reason"),
    [
        ("modes: [{frequency_hz: 0, damping_ratio: 0}]", 28, "must be at least 0.001, not 0"),
        ("modes: [{frequency_hz: -3, damping_ratio: 0}]", 28, "must be at least 0.001, not -3"),
        ("modes: [{frequency_hz: 1e999, damping_ratio: 0}]", 28, "must be finite, not inf"),
        ("modes: [{frequency_hz: .nan, damping_ratio: 0}]", 28, "must be finite, not nan"),
        ("modes: [{frequency_hz: 0xFFFFFFFFFFFFFFFF, damping_ratio: 0}]", 28, "must be"),
        (f"modes: [{{frequency_hz: {'9' * 5000}, damping_ratio: 0}}]", 28, "must be finite"),
        ("modes: [{frequency_hz: fast, damping_ratio: 0}]", 28, "must be a number, not the text 'fast'"),
        ("modes: [{frequency_hz: 1_0, damping_ratio: 0}]", 28, "must be a number, not the text '1_0'"),
        ("modes: [{frequency_hz: 30 Hz, damping_ratio: 0}]", 28, "must be a number, not the text '30 Hz'"),
        ("modes: [{frequency_hz: '30', damping_ratio: 0}]", 28, "must be a number, not the text '30'"),
        ("modes: [{frequency_hz: true, damping_ratio: 0}]", 28, "must be a number, not true"),
        ("modes: [{frequency_hz: [30], damping_ratio: 0}]", 28, "must be a number, not a list"),
        ("modes: [{frequency_hz: {a: 1}, damping_ratio: 0}]", 28, "must be a number, not keys with values"),
        ("modes: [{frequency_hz: 3, damping_ratio: 1}]", 46, "must be less than 1, not 1"),
        ("modes: [{frequency_hz: 3}]", 13, "axes.x.modes[0]: damping_ratio is missing"),
        ("modes: {frequency_hz: 3}", 12, "axes.x.modes: must be a list"),
        ("modes: [30]", 13, "axes.x.modes[0]: must be keys with values, not 30"),
        ("drive: fast", 12, "axes.x.drive: must be keys with values, not the text 'fast'"),
        ("drive: {}", 12, "axes.x.drive: type is missing"),
        ("drive: {type: lag}", 19, "axes.x.drive.type: must be ideal, first_order_lag or servo_motor, not the text 'lag'"),
        ("drive: {type: 3}", 19, "axes.x.drive.type: must be ideal, first_order_lag or servo_motor, not 3"),
        ("drive: {type: [zv]}", 19, "axes.x.drive.type: must be"),
        ("drive: {type: first_order_lag}", 12, "axes.x.drive: time_constant_s is missing"),
        ("drive: {type: first_order_lag, time_constant_s: 0}", 53, "time_constant_s: must be at least 1e-06"),
        ("shaper: {type: zv}", 13, "axes.x.shaper: zv needs a mode"),
        ("shaper: {type: zv, of: zvd}", 24, "axes.x.shaper.of: unknown key"),
        ("shaper: {type: cascade, cascade: 1}", 29, "axes.x.shaper.cascade: unknown key"),
        ("shaper: {type: cascade, of: cascade}", 33, "axes.x.shaper.of: must be"),
        ("shaper: {type: cascad}", 20, "axes.x.shaper.type: must be none, zv, zvd"),
        ("shaper: {type: impulses, times_s: [0, 1]}", 13, "axes.x.shaper: amplitudes is missing"),
        ("shaper: {type: impulses, times_s: [], amplitudes: []}", 39, "needs at least 1 values, not 0"),
        ("shaper: {type: impulses, times_s: [0, 1], amplitudes: [1]}", 13, "as many times as amplitudes"),
        ("shaper: {type: impulses, times_s: [0, 1], amplitudes: [1, 1]}", 13, "must add up to 1, not 2"),
        ("shaper: {type: impulses, times_s: [0, .inf], amplitudes: [1, 0]}", 43, "[1]: must be finite"),
    ],
)  # fmt: skip
def test_what_an_axis_cannot_be_is_refused_at_its_place(text: str, column: int, reason: str) -> None:
    error = refusal(with_axis(text))
    assert reason in error.reason
    assert (error.line, error.column) == (3, column)


@pytest.mark.parametrize(
    ("text", "place", "reason"),
    [
        ("just text", (1, 1), "the file: must be keys with values, not the text 'just text'"),
        ("[1, 2]", (1, 1), "the file: must be keys with values, not a list"),
        ("name: x", (1, 1), "axes is missing"),
        ("axes: {}", (1, 7), "a machine needs an axis"),
        ("axes: {X: {}}", (1, 8), "axes.X: unknown key"),
        ("axes: {x: {}}", (1, 11), "axes.x: limits is missing"),
        ("axes: {x: {limits: {velocity_mm_s: 1}}}", (1, 20), "acceleration_mm_s2 is missing"),
        ("axes: {a: {limits: {velocity_mm_s: 1}}}", (1, 21), "axes.a.limits.velocity_mm_s: unknown key"),
        (SMALL + "name: 3", (2, 7), "name: must be text, not 3"),
        (SMALL + "name: ''", (2, 7), "name: "),
        (SMALL + 'name: "a\\nb"', (2, 7), "name: must be one printable line"),
        (SMALL + 'name: "\\ud800"', (2, 7), "name: must be one printable line"),
        (SMALL + "planning: {shaping: axes}", (2, 21), "planning.shaping: must be contour, axis, path or none"),
        (SMALL + "planning: {chord_error_mm: 0.001}", (2, 28), "only together with interpolation_period_s"),
        (SMALL + "planning: {interpolation_period_s: 0.008}", (2, 36), "only together with chord_error_mm"),
        (SMALL + "planning: {interpolation_period_s: 0, chord_error_mm: 1}", (2, 36), "at least 1e-06, not 0"),
        (SMALL + "planning: {path_acceleration_mm_s2: 0}", (2, 37), "must be at least 0.001, not 0"),
        (SMALL + "planning: {path_acceleration_mm_s2: 1e-300}", (2, 37), "must be at least 0.001, not 1e-300"),
        (SMALL + "planning: {tool_tolerance_mm: 0}", (2, 31), "planning.tool_tolerance_mm: must be at least"),
        (SMALL + "planning: {path_tolerance_mm: 0}", (2, 31), "must be at least 1e-06, not 0"),
        (SMALL + "control: {sample_time_s: 0}", (2, 26), "must be at least 1e-06, not 0"),
        (SMALL + "control: {sample_time_s: 1e-300}", (2, 26), "must be at least 1e-06"),
        (SMALL + "control: {delay_samples: 1.5}", (2, 26), "must be a whole number, not 1.5"),
        (SMALL + "control: {delay_samples: -1}", (2, 26), "must be at least 0, not -1"),
        (SMALL + "control: {delay_samples: 1e3}", (2, 26), "must be a whole number"),
        (SMALL + "control: {jacobian_every: 0}", (2, 27), "control.jacobian_every: must be at least 1, not 0"),
        (SMALL + "control: {jacobian_every: 1.5}", (2, 27), "jacobian_every: must be a whole number"),
        (SMALL + "control: {cross_coupling: {}}", (2, 27), "proportional_per_s is missing"),
        (SMALL + "control: {cross_coupling: {proportional_per_s: 8, estimator: normal}}", (2, 62),
         "cross_coupling.estimator: must be tangent, foot_point or circle, not the text 'normal'"),
        (SMALL + "control: {cross_coupling: {proportional_per_s: -8}}", (2, 48), "must be at least 0, not -8"),
        (SMALL + "control: {cross_coupling: {proportional_per_s: 8, integral_per_s2: -5}}", (2, 68),
         "control.cross_coupling.integral_per_s2: must be at least 0, not -5"),
        (SMALL + "control: {cross_coupling: {proportional_per_s: 8, derivative: -1}}", (2, 63),
         "control.cross_coupling.derivative: must be at least 0, not -1"),
        (SMALL + "control: {cross_coupling: {proportional_per_s: 8, form: matrix}}", (2, 57),
         "control.cross_coupling.form: must be vector or scalar, not the text 'matrix'"),
        (SMALL + "control: {cross_coupling: {proportional_per_s: 8, orientation_per_s: 1}}", (2, 70),
         "control.cross_coupling.orientation_per_s: the tool of a cartesian machine does not turn"),
        (SMALL + "control: {cross_coupling: {proportional_per_s: 8, orientation_per_s: -1}}", (2, 70),
         "control.cross_coupling.orientation_per_s: must be at least 0, not -1"),
        (SMALL + "tools: [{number: 1}, {number: 1}]", (2, 31), "tools[1].number: tool 1 is given twice"),
        (SMALL + "tools: [{number: -1}]", (2, 18), "must be at least 0"),
        ("axes: {x: {limits: {velocity_mm_s: 1, acceleration_mm_s2: 1, travel_mm: [3, 3]}}}", (1, 73),
         "the lower end 3 is not below the upper end 3"),
        ("axes: {x: {limits: {velocity_mm_s: 1, acceleration_mm_s2: 1, travel_mm: [3]}}}", (1, 73),
         "needs at least 2 values, not 1"),
    ],
)  # fmt: skip
def test_what_a_machine_cannot_be_is_refused_at_its_place(
    text: str, place: tuple[int, int], reason: str
) -> None:
    error = refusal(text)
    assert reason in error.reason
    assert (error.line, error.column) == place


EVERY_SHAPER = [
    *(f"type: {name}" for name in sorted(SHAPERS) if name not in ("sd", "virtual_mode", "impulses")),
    "type: zv, derivatives: 4",
    "type: mzv, impulses: 4, duration_periods: 1.0",
    "type: ei, vibration_tolerance: 0.02",
    "type: virtual_mode, virtual_frequency_hz: 150",
    "type: sd, duration_periods: 1.3, metric: margin",
    "type: sd, duration_s: 0.012, max_amplitude: 1.2, min_gap_s: 0.001",
    "type: multi_mode, derivatives: [1], positive: true",
    "type: optimal, min_running_sum: -1, max_running_sum: 1.0",
    "type: cascade, of: ei",
    "type: impulses, times_s: [0, 0.01], amplitudes: [0.5, 0.5]",
]


@pytest.mark.parametrize("shaper", EVERY_SHAPER)
def test_a_machine_file_takes_every_shaper_with_its_options(shaper: str) -> None:
    text = (
        "axes:\n  x:\n    limits: {velocity_mm_s: 1, acceleration_mm_s2: 1}\n"
        f"    modes: [{{frequency_hz: 30, damping_ratio: 0}}]\n    shaper: {{{shaper}}}\n"
    )
    setup = parse_machine(text.encode(), "m.yaml")
    assert abs(setup.shapers["x"].amplitudes.sum() - 1.0) < 1e-12
    assert parse_machine(dump_machine(setup).encode(), "m.yaml") == setup


@pytest.mark.parametrize(
    ("shaper", "column", "reason"),
    [
        ("type: sd, duration_periods: 0.2, max_amplitude: 1.5", 62, "shaper.max_amplitude: 0.2 damped periods are too"),
        ("type: sd, duration_periods: -1", 42, "shaper.duration_periods: the duration must be positive"),
        ("type: sd", 13, "shaper: sd takes one duration, not none"),
        ("type: sd, duration_periods: 1, metric: width", 53, "metric: must be insensitivity or margin"),
        ("type: virtual_mode, virtual_frequency_hz: -3", 56, "shaper.virtual_frequency_hz: the virtual frequency"),
        ("type: multi_mode, derivatives: 1", 45, "derivatives: must be a list"),
        ("type: zv, derivatives: 1.5", 37, "derivatives: must be a whole number"),
    ],
)  # fmt: skip
def test_a_shaper_that_does_not_exist_is_refused_at_its_option(shaper: str, column: int, reason: str) -> None:
    text = (
        "axes:\n  x:\n    limits: {velocity_mm_s: 1, acceleration_mm_s2: 1}\n"
        f"    modes: [{{frequency_hz: 30, damping_ratio: 0}}]\n    shaper: {{{shaper}}}\n"
    )
    error = refusal(text)
    assert reason in error.reason
    assert (error.line, error.column) == (5, column)


def test_modes_that_leave_nothing_of_one_are_refused() -> None:
    modes = (
        "modes: [{frequency_hz: 3, damping_ratio: 0, participation: 1}, {frequency_hz: 4, damping_ratio: 0}]"
    )
    error = refusal(with_axis(modes))
    assert (error.line, error.column) == (3, 68)
    assert "leave nothing of 1" in error.reason


def test_the_first_of_several_mistakes_is_told() -> None:
    error = refusal("control: {delay_samples: x}\naxes: {x: {limits: {velocity_mm_s: -1}}}\nname: 3\n")
    assert (error.line, error.column) == (1, 26)


# --- files


def test_a_missing_file_says_how_to_make_one(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no such file") as caught:
        load_machine(tmp_path / "no.yaml")
    assert "cnc-shape init" in str(caught.value.hint)


@pytest.mark.parametrize("name", ["", ".", "a\0b", "x" * 5000])
def test_a_name_that_is_no_file_is_refused(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError, match="cannot be read") as caught:
        load_machine(name)
    assert caught.value.hint


def test_a_file_that_may_not_be_read_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def deny(*_: object) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(Path, "open", deny)  # a real one would not stop the superuser
    with pytest.raises(ConfigError, match="cannot be read: permission denied") as caught:
        load_machine("m.yaml")
    assert "chmod u+r" in str(caught.value.hint)


def test_the_environment_names_a_machine_and_the_argument_wins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("CNC_SHAPE_MACHINE", raising=False)
    assert load_machine().source == str(bundled("xy_stage.yaml"))
    named, given_file = tmp_path / "named.yaml", tmp_path / "given.yaml"
    named.write_text(SMALL)
    given_file.write_text(SMALL)
    monkeypatch.setenv("CNC_SHAPE_MACHINE", str(named))
    assert load_machine().machine.name == "named"
    assert load_machine(given_file).machine.name == "given"
    monkeypatch.setenv("CNC_SHAPE_MACHINE", str(tmp_path / "gone.yaml"))
    with pytest.raises(ConfigError) as caught:
        load_machine()
    assert "CNC_SHAPE_MACHINE names this file" in str(caught.value.hint)
    monkeypatch.setenv("CNC_SHAPE_MACHINE", "")
    assert load_machine().machine.name == "XY stage with two modes"


def test_only_what_is_bundled_is_found() -> None:
    assert bundled("xy_stage.yaml").parent.name == "configs"
    for name in ("nothing.yaml", "../pyproject.toml", "", "configs"):
        with pytest.raises(OptionError, match="no bundled file"):
            bundled(name)


@pytest.mark.parametrize("path", BUNDLED, ids=lambda path: path.stem)
def test_every_bundled_machine_passes_check(path: Path) -> None:
    found = check_machine(path)
    assert found["dialect"] == "machine"
    assert found["warnings"] == []


def test_the_default_machine_is_the_one_of_the_contract() -> None:
    setup = load_machine(bundled("xy_stage.yaml"))
    for name in ("x", "y"):
        axis = setup.machine.axis(name)
        assert [mode.natural_frequency for mode in axis.modes] == [30.0, 100.0]
        assert axis.limits == Limits(500.0, 5000.0)
        assert setup.choices[name] == ShaperChoice("cascade", {})
    assert setup.control.feedforward == Feedforward(1.0, 1.0)
    assert setup.control.cross_coupling is not None


def test_an_unstable_loop_is_told_by_check(tmp_path: Path) -> None:
    path = tmp_path / "m.yaml"
    lag = "drive: {type: first_order_lag, time_constant_s: 0.01}"
    path.write_text(with_axis(lag) + "control: {position_gain_per_s: 5000}\n")
    with pytest.raises(ConfigError, match="the loop of axis x is unstable") as caught:
        check_machine(path)
    assert (caught.value.line, caught.value.column) == (5, 10)


# --- round trips


@pytest.mark.parametrize("text", [EVERY_KEY, SMALL, machine_template(), *(p.read_text() for p in BUNDLED)])
def test_a_setup_survives_being_written_and_read(text: str) -> None:
    setup = parse(text)
    again = parse(dump_machine(setup))
    assert again == setup
    assert dump_machine(again) == dump_machine(setup)
    for axis, shaper in setup.shapers.items():
        assert (again.shapers[axis].times == shaper.times).all()


NAMES = st.text(st.characters(exclude_categories=["C", "Z"], include_characters=" "), min_size=1, max_size=30)


@given(name=NAMES, velocity=st.floats(1e-300, 1e9), tau=st.floats(1e-6, 1e3), share=st.floats(-100.0, 100.0))
def test_names_and_numbers_survive_exactly(name: str, velocity: float, tau: float, share: float) -> None:
    modes = (Mode(30.0, 0.0, share), Mode(31.0, 0.5, 1.0 - share if abs(share) < 99.0 else 0.0))
    axis = Axis("y", Limits(velocity, 1.0), FirstOrderLag(tau), modes)
    setup = Setup(Machine(name, (axis,)), choices={"y": ShaperChoice("zvd", {})})
    assert parse(dump_machine(setup)) == setup


@pytest.mark.parametrize(
    "name", ["1e-3", "010", "true", "null", "yes", "y", "- x", "a: b", "#", "'", "µ{m}", "="]
)
def test_a_name_that_looks_like_something_else_survives(name: str) -> None:
    setup = Setup(Machine(name, (Axis("x", Limits(1.0, 1.0)),)))
    assert parse(dump_machine(setup)) == setup


@given(st.floats(-1e9, 1e9))
def test_degrees_survive_exactly(degrees: float) -> None:
    assert to_degrees(degrees * DEGREE) * DEGREE == degrees * DEGREE


@given(st.integers(-360_000, 360_000))
def test_degrees_are_written_as_a_person_would(thousandths: int) -> None:
    degrees = thousandths / 1000.0
    assert to_degrees(degrees * DEGREE) == degrees


def test_a_setup_travels_between_processes() -> None:
    setup = parse(EVERY_KEY)
    assert pickle.loads(pickle.dumps(setup)) == setup


# --- fuzz

FRAGMENTS = (
    "{", "}", "[", "]", ": ", ", ", "- ", "\n", "  ", "\t", "'", '"', "&a ", "*a", "!!int ", "|\n", "? ", "#",
    "---\n", "%YAML 1.2\n", "~", ".nan", "1e999", "-1", "0", "true", "type", "axes", "modes", "1e308",
    "\x00", "\ufeff", "\u2028", "é", "<<: ", "9" * 400,
)  # fmt: skip


@st.composite
def mutations(draw: st.DrawFn) -> bytes:
    """A machine file after a few accidents."""
    data = draw(st.sampled_from([EVERY_KEY, SMALL, machine_template()])).encode()
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(data)))
        kind = draw(st.sampled_from(["insert", "delete", "swap", "bytes"]))
        if kind == "insert":
            data = data[:at] + draw(st.sampled_from(FRAGMENTS)).encode() + data[at:]
        elif kind == "delete":
            data = data[:at] + data[at + draw(st.integers(1, 40)) :]
        elif kind == "swap":
            other = draw(st.integers(0, len(data)))
            low, high = min(at, other), max(at, other)
            data = data[high:] + data[low:high] + data[:low]
        else:
            data = data[:at] + draw(st.binary(max_size=6)) + data[at + 1 :]
    return data


@settings(max_examples=1000)
@given(mutations())
def test_any_text_makes_a_setup_or_one_line_with_place_and_remedy(data: bytes) -> None:
    outcome = outcome_of(data)
    if isinstance(outcome, CncShapeError):
        assert outcome.source == "m.yaml"
        assert outcome.line
        assert outcome.column
        assert outcome.hint
    else:
        assert parse(dump_machine(outcome)) == outcome


def outcome_of(data: bytes) -> Setup | CncShapeError:
    try:
        return parse_machine(data, "m.yaml")
    except CncShapeError as error:
        return error


LEAVES = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8), st.just([]), st.just({}),
    st.sampled_from(["zv", "cascade", "servo_motor", "x", "type", "first_order_lag", "tangent"]),
)  # fmt: skip


@settings(max_examples=300)
@given(st.sampled_from(key_places(yaml.safe_load(EVERY_KEY))), LEAVES)
def test_any_value_anywhere_makes_a_setup_or_one_line(path: tuple[object, ...], value: object) -> None:
    document = yaml.safe_load(EVERY_KEY.replace("5e-4", "0.0005").replace("9e4", "90000.0"))
    owner = document
    for step in path[:-1]:
        owner = owner[step]
    owner[path[-1]] = value
    outcome = outcome_of(yaml.safe_dump(document, allow_unicode=True).encode())
    if isinstance(outcome, CncShapeError):
        assert outcome.line
        assert outcome.hint
