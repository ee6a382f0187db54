"""The two-mode stage under both shapers of two modes: one ZV for each mode, or three impulses for both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

from cnc_shape.config.bundled import bundled
from cnc_shape.config.machine_file import load_machine
from cnc_shape.experiments.experiment import Row, Table
from cnc_shape.opening import open_motion
from cnc_shape.pipeline import Case, CaseSummary, Run, run
from cnc_shape.shapers import Shaper, cascade, multi_mode
from cnc_shape.shapers.command_shaping import CommandShaping

MACHINE, PROGRAM = "xy_stage.yaml", "bracket.nc"


@cache
def stage_run() -> Run:
    """The bracket on the stage: unshaped, one ZV for each mode, three impulses for both."""
    setup = load_machine(bundled(MACHINE))
    flexible = {axis.name: axis.modes for axis in setup.machine.axes if axis.modes}
    shapers: Mapping[str, Mapping[str, Shaper]] = {
        "unshaped": {},
        "cascade": {name: cascade(modes) for name, modes in flexible.items()},
        "multi_mode": {name: multi_mode(modes) for name, modes in flexible.items()},
    }
    alone = replace(setup.control, cross_coupling=None)
    cases = [Case(name, CommandShaping(of), alone) for name, of in shapers.items()]
    with open_motion(str(bundled(PROGRAM)), setup) as motion:
        return run(motion.blocks, setup, cases, motion.name, record=True)


def stage_table() -> Table:
    """Contour error, cycle time and vibration of the three."""
    found = stage_run().summary
    rows = [row for case in found.cases for row in _rows(case, found.cycle_time)]
    return Table(
        "Beyond the paper: a stage with modes at 30 and 100 Hz",
        tuple(rows),
        f"The program {PROGRAM} on the machine {MACHINE}, through planning, shaping, drives and structure. "
        "The "
        "modes are damped (0.02 and 0.01), which the search takes as it takes undamped ones. Three impulses "
        "are shorter than the four of one ZV for each mode, so the shaped motion is done sooner and its "
        "corners "
        "are cut less.",
    )


def _rows(case: CaseSummary, unshaped: float) -> tuple[Row, ...]:
    name, how = case.name, "simulated through the whole chain"
    return (
        Row(f"{name}: contour error of the tool, RMS", "µm", None, 1e3 * case.tool.rms, 0.0, how),
        Row(f"{name}: contour error of the tool, largest", "µm", None, 1e3 * case.tool.max, 0.0, how),
        Row(f"{name}: vibration after the end", "µm", None,
            1e3 * max(case.residual_vibration.values()), 0.0, f"{how}; the worst axis"),
        Row(f"{name}: cycle time above unshaped", "ms", None, 1e3 * (case.cycle_time - unshaped), 0.0,
            f"{how}; the unshaped cycle takes {unshaped:.3f} s"),
    )  # fmt: skip
