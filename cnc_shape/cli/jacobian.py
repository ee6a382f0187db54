"""``cnc-shape check --jacobian``: how a machine's joints and axes hold on to each other at a pose."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Any, Final

NOISE: Final = 1e-9  # what is less is what rounding left of 0


def show_jacobian(machine: str | None, files: Sequence[str], pose: str | None, *, json: bool) -> None:
    """Print the Jacobian of `machine`, or of the one machine file among `files`, at `pose`."""
    from cnc_shape.cli.output import print_json
    from cnc_shape.config.jacobian import check_jacobian
    from cnc_shape.config.machine_file import load_machine

    found = check_jacobian(load_machine(_machine(machine, files)), _numbers(pose))
    if json:
        print_json("check", found)
    else:
        _show(found)


def _machine(machine: str | None, files: Sequence[str]) -> str | None:
    from cnc_shape.errors import OptionError

    if not files:
        return machine
    if len(files) > 1 or machine is not None:
        raise OptionError("--jacobian takes one machine", hint="name it with -m, and no FILE")
    return files[0]


def _numbers(pose: str | None) -> list[float]:
    from cnc_shape.errors import OptionError

    if pose is None:
        return []
    try:
        numbers = [float(word) for word in pose.split(",")]
    except ValueError:
        numbers = []
    if not numbers or not all(map(isfinite, numbers)):
        hint = "write numbers in mm and degrees: --pose 20,15,0"
        raise OptionError(f"--pose is not {pose!r}", hint=hint, argument="pose")
    return numbers


def _show(found: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.text import Text

    console = Console(highlight=False)
    console.print(Text(f"{found['name']} ({found['kinematics']})", style="bold"))
    for name in ("pose", "joint_positions"):
        told = "  ".join(f"{axis.upper()} {_number(value)}" for axis, value in found[name].items())
        console.print(Text(f"{name.replace('_', ' ')}: {told}"))
    joints, axes = found["joints"], found["axes"]
    if formulas := found["formulas"]:
        twist = ["vx", "vy", "vz", "wx", "wy", "wz"]
        what = "twist of the tool per joint rates"
        _matrix(console, f"{what}, by screws: A - B D^-1 C", formulas["screws"], twist, joints)
        _matrix(console, f"{what}, by reciprocal screws", formulas["reciprocal_screws"], twist, joints)
        apart = formulas["largest_relative_difference"]
        console.print(Text(f"largest relative difference: {apart:.2g}"))
    else:
        _matrix(console, "axis rates per joint rates", found["jacobian"], axes, joints)
    _matrix(console, "joint rates per axis rates", found["inverse_jacobian"], joints, axes)
    weight = "" if found["radian_mm"] is None else f", a radian as {found['radian_mm']:g} mm"
    console.print(Text(f"against central differences: {found['central_difference_error']:.2g}"))
    console.print(Text(f"condition number: {found['condition_number']:.4g}{weight}"))


def _matrix(console: Any, title: str, rows: list[list[float]], down: list[str], across: list[str]) -> None:
    from rich.table import Table
    from rich.text import Text

    console.print(Text(title))
    table = Table(box=None)
    table.add_column("", style="dim")
    for name in across:
        table.add_column(Text(name, style="dim"), justify="right", no_wrap=True)
    for name, row in zip(down, rows, strict=True):
        table.add_row(name, *map(_number, row))
    console.print(table)


def _number(value: float) -> str:
    return f"{value:.6g}" if abs(value) >= NOISE else "0"
