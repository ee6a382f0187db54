"""cnc-shape: from a G-code program to its contour error.

What the commands do is a few lines of Python::

    import cnc_shape as cs

    setup = cs.load_machine("machine.yaml")
    run = cs.simulate_program("part.nc", setup)
    print(run.summary.cases[1].tool.max)
    cs.write_report(run, "report", setup)

and every stage on its own: `read_program`, `build_toolpath`, `smooth`, `plan`, `sample`, `shape` (axis by
axis) or `shape_command` (as ``setup.command_shaping(kind)`` says), `simulate`, `contour_error`. Shapers are
designed by the functions of `cnc_shape.design`. Names are imported when they are first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from cnc_shape import shapers as design
    from cnc_shape.api import plot, simulate_program, write_report
    from cnc_shape.config.machine_file import load_machine
    from cnc_shape.contour import contour_error
    from cnc_shape.controllers import Control, CrossCoupling, Feedforward
    from cnc_shape.modes import Mode
    from cnc_shape.planning import plan
    from cnc_shape.readers import read_program
    from cnc_shape.shapers.command_shaping import shape_command
    from cnc_shape.shapers.shaping import shape
    from cnc_shape.simulation import simulate
    from cnc_shape.smoothing import Smoothing, smooth
    from cnc_shape.toolpath import build_toolpath
    from cnc_shape.trajectory import sample
    from cnc_shape.windows import foot_windows

_HOMES = {
    "Control": "controllers",
    "CrossCoupling": "controllers",
    "Feedforward": "controllers",
    "Mode": "modes",
    "Smoothing": "smoothing",
    "build_toolpath": "toolpath",
    "contour_error": "contour",
    "foot_windows": "windows",
    "load_machine": "config.machine_file",
    "plan": "planning",
    "plot": "api",
    "read_program": "readers",
    "sample": "trajectory",
    "shape": "shapers.shaping",
    "shape_command": "shapers.command_shaping",
    "simulate": "simulation",
    "simulate_program": "api",
    "smooth": "smoothing",
    "write_report": "api",
}

__all__ = [
    "Control", "CrossCoupling", "Feedforward", "Mode", "Smoothing", "__version__", "build_toolpath",
    "contour_error", "design", "foot_windows", "load_machine", "plan", "plot", "read_program", "sample",
    "shape", "shape_command", "simulate", "simulate_program", "smooth", "write_report",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name == "design":
        return import_module("cnc_shape.shapers")
    if name in _HOMES:
        return getattr(import_module(f"cnc_shape.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'cnc_shape' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
