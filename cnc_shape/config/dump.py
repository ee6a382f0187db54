"""Setup -> machine file: what a run was made with, to be read back to the same values."""

from __future__ import annotations

from math import isfinite

import yaml

from cnc_shape.config.dump_motors import compensation_keys, disturbance_list, motor_keys
from cnc_shape.config.mode_tables import dump_mode_table
from cnc_shape.config.setup import Planning, Setup
from cnc_shape.config.spelling import to_degrees
from cnc_shape.controllers import Control, CrossCoupling
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, Drive, FirstOrderLag, IdealDrive, ServoMotor
from cnc_shape.modes import Mode
from cnc_shape.program import ROTARY

LINE_LENGTH = 110


class _Dumper(yaml.SafeDumper):
    """Text in quotes: what is no number to one reader of YAML may be one to another."""


def _quoted(dumper: _Dumper, text: str) -> yaml.Node:
    plain = text.isidentifier() and text not in ("y", "n")
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=None if plain else '"')


_Dumper.add_representer(str, _quoted)


def dump_machine(setup: Setup) -> str:
    """Return `setup` as a machine file; loading it gives an equal setup."""
    document: dict[str, object] = {
        "name": setup.machine.name,
        "kinematics": {"type": setup.kinematics_choice.type, **setup.kinematics_choice.options},
        "axes": {axis.name: _axis(axis, setup) for axis in setup.machine.axes},
        "planning": _planning(setup.planning),
        "control": _control(setup.control),
    }
    if setup.machine.joints:
        names = setup.kinematics.joints
        drives = zip(setup.machine.joints, names, strict=True)
        document["joints"] = [{"drive": _drive(drive, name)} for drive, name in drives]
    if setup.disturbances:
        document["disturbances"] = disturbance_list(setup.disturbances)
    if setup.tools:
        document["tools"] = [
            {"number": tool.number, "length_mm": tool.length, "diameter_mm": tool.diameter}
            for tool in setup.tools
        ]
    return yaml.dump(
        document,
        Dumper=_Dumper,
        sort_keys=False,
        default_flow_style=None,
        allow_unicode=True,
        width=LINE_LENGTH,
    )


def _planning(planning: Planning) -> dict[str, object]:
    keys: dict[str, object] = {
        "path_tolerance_mm": planning.path_tolerance,
        "shaping": planning.shaping.value,
        "stop_dwell_shaper_durations": planning.stop_dwell,
        "align": planning.aligned,
    }
    if planning.tool_tolerance is not None:
        keys["tool_tolerance_mm"] = planning.tool_tolerance
    if isfinite(planning.path_limits.acceleration):
        keys["path_acceleration_mm_s2"] = planning.path_limits.acceleration
    if chord := planning.path_limits.chord:
        keys["interpolation_period_s"], keys["chord_error_mm"] = chord
    return keys


def _axis(axis: Axis, setup: Setup) -> dict[str, object]:
    keys: dict[str, object] = {
        "limits": _degrees(axis.limits) if axis.name in ROTARY else _millimetres(axis.limits)
    }
    if axis.drive != IdealDrive():
        keys["drive"] = _drive(axis.drive, axis.name)
    if axis.modes:
        keys["modes"] = [_mode(mode) for mode in axis.modes]
    if choice := setup.choices.get(axis.name):
        keys["shaper"] = {"type": choice.type, **choice.options}
    return keys


def _drive(drive: Drive, moved: str) -> dict[str, object]:
    if isinstance(drive, FirstOrderLag):
        return {"type": "first_order_lag", "time_constant_s": drive.time_constant, "gain": drive.gain}
    if isinstance(drive, ServoMotor):
        return motor_keys(drive, moved)
    return {"type": "ideal"}


def _millimetres(limits: Limits) -> dict[str, object]:
    keys: dict[str, object] = {
        "velocity_mm_s": limits.velocity,
        "acceleration_mm_s2": limits.acceleration,
    }
    if isfinite(limits.jerk):
        keys["jerk_mm_s3"] = limits.jerk
    if isfinite(limits.travel[0]):
        keys["travel_mm"] = list(limits.travel)
    return keys


def _degrees(limits: Limits) -> dict[str, object]:
    travel = (to_degrees(limits.travel[0]), to_degrees(limits.travel[1]))
    keys = _millimetres(
        Limits(to_degrees(limits.velocity), to_degrees(limits.acceleration), to_degrees(limits.jerk), travel)
    )
    return {key.replace("_mm", "_deg"): value for key, value in keys.items()}


def _mode(mode: Mode) -> dict[str, object]:
    keys: dict[str, object] = {
        "frequency_hz": mode.natural_frequency,
        "damping_ratio": mode.damping_ratio,
        "participation": mode.participation,
    }
    if mode.frequency_uncertainty:
        keys["frequency_uncertainty"] = mode.frequency_uncertainty
    if mode.damping_uncertainty:
        keys["damping_uncertainty"] = mode.damping_uncertainty
    if mode.table is not None:
        keys["over_position"] = dump_mode_table(mode.table)
    return keys


def _control(control: Control) -> dict[str, object]:
    keys: dict[str, object] = {
        "sample_time_s": control.sample_time,
        "position_gain_per_s": control.position_gain,
        "delay_samples": control.delay_samples,
    }
    if feed := control.feedforward:
        shares = {"velocity": feed.velocity, "acceleration": feed.acceleration}
        model = {"model_time_constant_s": feed.model_time_constant, "model_gain": feed.model_gain}
        keys["feedforward"] = shares | {key: value for key, value in model.items() if value is not None}
    if couple := control.cross_coupling:
        keys["cross_coupling"] = _cross_coupling(couple)
    if control.jacobian_every != 1:
        keys["jacobian_every"] = control.jacobian_every
    return keys | compensation_keys(control)


def _cross_coupling(couple: CrossCoupling) -> dict[str, object]:
    gains = {
        "integral_per_s2": couple.integral,
        "derivative": couple.derivative,
        "orientation_per_s": couple.orientation,
    }
    return {
        "estimator": couple.estimator.name.lower(),
        "proportional_per_s": couple.proportional,
        "form": couple.form.name.lower(),
        **{key: gain for key, gain in gains.items() if gain},
    }
