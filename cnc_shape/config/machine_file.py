"""Machine file -> Setup: read, checked key by key, turned into plain values."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from pydantic import ValidationError

from cnc_shape.config.bundled import bundled
from cnc_shape.config.complaints import complaint, locate, refuse_at
from cnc_shape.config.control import read_control
from cnc_shape.config.disturbances import read_disturbances
from cnc_shape.config.drives import Drives, check_ticks, drive_of
from cnc_shape.config.joints import AxisModels, read_joints, read_kinematics
from cnc_shape.config.mode_tables import read_mode_table
from cnc_shape.config.models import (
    AxesModel,
    LinearAxisModel,
    MachineModel,
    ModeModel,
    RotaryAxisModel,
)
from cnc_shape.config.planning import planning_of
from cnc_shape.config.position_notes import position_notes
from cnc_shape.config.setup import Setup, ShaperChoice, Shaping
from cnc_shape.config.shaper_options import NONE, design, key_of
from cnc_shape.config.yaml_tree import MAX_BYTES, Tree, read_tree, refuse
from cnc_shape.errors import ConfigError, InfeasibleError, OptionError
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, Machine
from cnc_shape.modes import Mode, ModeTable
from cnc_shape.program import Note
from cnc_shape.shapers import SINGLE_MODE, Shaper
from cnc_shape.tools import Tool
from cnc_shape.units import DEGREE

VARIABLE: Final = "CNC_SHAPE_MACHINE"
DEFAULT: Final = "xy_stage.yaml"
STDIN: Final = "-"


def machine_path(given: Path | str | None) -> Path:
    """Return the machine file to use: `given`, else what CNC_SHAPE_MACHINE names, else the bundled one."""
    if given is not None:
        return Path(given)
    return Path(named) if (named := os.environ.get(VARIABLE)) else bundled(DEFAULT)


def load_machine(path: Path | str | None = None) -> Setup:
    """Read a machine file.

    Parameters
    ----------
    path
        The file, or ``-`` for standard input; None for what CNC_SHAPE_MACHINE names, or the bundled machine.

    Raises
    ------
    ConfigError
        A file that cannot be read, or that does not describe a machine: names line, column and key.
    """
    source, data = read_content(machine_path(path))
    return parse_machine(data, source)


def parse_machine(data: bytes, source: str) -> Setup:
    """Read a machine file's content; errors call it `source`.

    Raises
    ------
    ConfigError
        As `load_machine`.
    """
    return read_machine(data, source)[0]


def read_machine(data: bytes, source: str) -> tuple[Setup, tuple[Note, ...], Tree]:
    """Return the setup, what to warn of and where, and the places of all keys.

    Raises
    ------
    ConfigError
        As `load_machine`.
    """
    tree = read_tree(source, data)
    try:
        model = MachineModel.model_validate(tree.value)
    except ValidationError as error:
        raise complaint(source, tree, error) from None
    axes = _axis_models(model.axes)
    kind, kinematics = read_kinematics(model)
    machine = Machine(
        name=_name(model, source, tree),
        axes=tuple(_axis(source, tree, name, axis) for name, axis in axes.items()),
        joints=read_joints(source, tree, model, axes, kinematics),
    )
    if not axes:
        refuse(source, locate(tree, ("axes",))[0], "axes: a machine needs an axis", "add x: with its limits")
    check_ticks(source, tree, _drives(machine), model.control.sample_time_s)
    choices = {name: choice for name, axis in axes.items() if (choice := _choice(axis))}
    planning = planning_of(source, tree, model.planning)
    shapers = {name: _shaper(source, tree, machine.axis(name), c) for name, c in choices.items()}
    acting = {} if planning.shaping is Shaping.NONE else shapers
    notes = (
        *_single_mode_notes(tree, machine, choices),
        *position_notes(tree, machine, acting, choices),
    )
    setup = Setup(
        machine=machine,
        planning=planning,
        control=read_control(source, tree, model.control, machine, kinematics),
        disturbances=read_disturbances(source, tree, model.disturbances, machine, kinematics),
        tools=_tools(source, tree, model),
        choices=choices,
        shapers=shapers,
        kinematics_choice=kind,
        kinematics=kinematics,
        loop_place=_loop_place(tree),
        warnings=tuple(f"{source}:{note.line}: warning: {note.message}" for note in notes),
        source=source,
    )
    return setup, notes, tree


def read_content(path: Path | str) -> tuple[str, bytes]:
    """Return what errors call the file, and its content, or as much of it as shows that it is too large.

    Raises
    ------
    ConfigError
        It cannot be read.
    """
    file = Path(path)
    try:
        if str(file) == STDIN:
            return "<stdin>", sys.stdin.buffer.read(MAX_BYTES + 1)
        with file.open("rb") as stream:
            return str(file), stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as fault:  # ValueError: a NUL in the name
        raise _unreadable(file, fault) from None


def _unreadable(file: Path, fault: Exception) -> ConfigError:
    hints: list[tuple[type[Exception], str]] = [
        (FileNotFoundError, "check the name, or write one with cnc-shape init"),
        (IsADirectoryError, "name the machine file in it"),
        (PermissionError, "allow yourself to read it: chmod u+r"),
    ]
    hint = next((hint for kind, hint in hints if isinstance(fault, kind)), "name a file that can be read")
    if os.environ.get(VARIABLE) == str(file):
        hint += f" ({VARIABLE} names this file)"
    reason = (fault.strerror or str(fault)) if isinstance(fault, OSError) else str(fault)
    return ConfigError(str(file), None, None, f"cannot be read: {reason.lower()}", hint=hint)


def _name(model: MachineModel, source: str, tree: Tree) -> str:
    if model.name is None:
        return Path(source).stem or "machine"
    if not model.name.isprintable():
        refuse(source, locate(tree, ("name",))[0], "name: must be one printable line", "write plain text")
    return model.name


def _axis_models(axes: AxesModel) -> AxisModels:
    every = {"x": axes.x, "y": axes.y, "z": axes.z, "a": axes.a, "b": axes.b, "c": axes.c}
    return {name: axis for name, axis in every.items() if axis is not None}


def _axis(source: str, tree: Tree, name: str, model: LinearAxisModel | RotaryAxisModel) -> Axis:
    if isinstance(model, LinearAxisModel):
        limits, unit = model.limits, 1.0
        velocity, acceleration = limits.velocity_mm_s, limits.acceleration_mm_s2
        jerk, travel = limits.jerk_mm_s3, limits.travel_mm
    else:
        limits, unit = model.limits, DEGREE
        velocity, acceleration = limits.velocity_deg_s, limits.acceleration_deg_s2
        jerk, travel = limits.jerk_deg_s3, limits.travel_deg
    plain = Limits(velocity * unit, acceleration * unit)
    if jerk is not None:
        plain = Limits(plain.velocity, plain.acceleration, jerk * unit)
    if travel is not None:
        plain = Limits(plain.velocity, plain.acceleration, plain.jerk, (travel[0] * unit, travel[1] * unit))
    drive = drive_of(source, tree, ("axes", name, "drive"), model.drive, name)
    return Axis(name, plain, drive, _modes(source, tree, name, model.modes))


def _drives(machine: Machine) -> Drives:
    """Every drive by where it stands in the file."""
    joints: Drives = {("joints", index, "drive"): drive for index, drive in enumerate(machine.joints)}
    return {**joints, **{("axes", axis.name, "drive"): axis.drive for axis in machine.axes}}


def _modes(source: str, tree: Tree, axis: str, models: list[ModeModel]) -> tuple[Mode, ...]:
    """Modes of an axis; those without a participation share what the others leave of 1."""
    given = sum(model.participation for model in models if model.participation is not None)
    without = [index for index, model in enumerate(models) if model.participation is None]
    if without and given >= 1.0:
        place, _ = locate(tree, ("axes", axis, "modes", without[0]))
        reason = f"axes.{axis}.modes[{without[0]}]: the other participations leave nothing of 1: {given:g}"
        refuse(source, place, reason, "give this mode a participation: of its own")
    share = (1.0 - given) / len(without) if without else 0.0
    return tuple(
        Mode(
            model.frequency_hz,
            model.damping_ratio,
            share if model.participation is None else model.participation,
            model.frequency_uncertainty,
            model.damping_uncertainty,
            _table(source, tree, axis, index, model),
        )
        for index, model in enumerate(models)
    )


def _table(source: str, tree: Tree, axis: str, index: int, model: ModeModel) -> ModeTable | None:
    if model.over_position is None:
        return None
    path = ("axes", axis, "modes", index, "over_position")
    return read_mode_table(source, tree, path, model.over_position, axis, model.damping_ratio)


def _choice(model: LinearAxisModel | RotaryAxisModel) -> ShaperChoice | None:
    if model.shaper is None or model.shaper.type == NONE:
        return None
    options = model.shaper.model_dump(exclude={"type"}, exclude_unset=True)
    return ShaperChoice(model.shaper.type, options)


def _shaper(source: str, tree: Tree, axis: Axis, choice: ShaperChoice) -> Shaper:
    path = ("axes", axis.name, "shaper")
    place, _ = locate(tree, path)
    if choice.type != "impulses" and not axis.modes:
        reason = f"axes.{axis.name}.shaper: {choice.type} needs a mode of the axis to cancel"
        refuse(source, place, reason, "add modes: to the axis, or remove the shaper")
    try:
        return design(choice, axis.modes)
    except (OptionError, InfeasibleError) as error:
        key = key_of(error.argument)
        refuse_at(source, tree, path if key is None else (*path, key), error.reason, error.hint)


def _loop_place(tree: Tree) -> tuple[int, int]:
    place, _ = locate(tree, ("control",))
    return place.line, place.column


def _tools(source: str, tree: Tree, model: MachineModel) -> tuple[Tool, ...]:
    tools: dict[int, Tool] = {}
    for index, tool in enumerate(model.tools):
        if tool.number in tools:
            place, _ = locate(tree, ("tools", index, "number"))
            reason = f"tools[{index}].number: tool {tool.number} is given twice"
            refuse(source, place, reason, "give every tool a number of its own")
        tools[tool.number] = Tool(tool.number, tool.length_mm, tool.diameter_mm)
    return tuple(tools.values())


def _single_mode_notes(tree: Tree, machine: Machine, choices: Mapping[str, ShaperChoice]) -> tuple[Note, ...]:
    notes: list[Note] = []
    for name, choice in choices.items():
        modes = machine.axis(name).modes
        if choice.type in SINGLE_MODE and len(modes) > 1:
            place, _ = locate(tree, ("axes", name, "shaper"))
            first = f"{modes[0].natural_frequency:g} Hz"
            message = f"axis {name}: {choice.type} cancels one mode, the first of {len(modes)} ({first})"
            notes.append(Note(place.line, message))
    return tuple(notes)
