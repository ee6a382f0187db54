"""Limits that hold after shaping: the motion is planned anew within lower ones, until they do.

Shaped, an axis's velocity and acceleration reach at most ``sum |A_i|`` times what was planned: with positive
impulses no more than that, with negative ones more; contour shaping adds a little on curves. How much depends
on where the impulses meet, so it is measured, and the planner's limits of that axis go down by it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from cnc_shape.applying import Application, Load
from cnc_shape.config.setup import Setup
from cnc_shape.errors import InfeasibleError, OptionError
from cnc_shape.machine import Axis, Machine
from cnc_shape.opening import open_motion
from cnc_shape.readers import ReadingOptions
from cnc_shape.readers.source import STANDARD_INPUT
from cnc_shape.timing import Timing

PLANS = 6  # tried at most
KEPT = 1.0 + 1e-9  # -, of a limit: rounding
CAUTION = 0.002  # -, below the measured excess at first; four times as much each time


@dataclass(frozen=True, slots=True)
class Respect:
    """A machine to plan with, so that the shaped command keeps the limits of the true one."""

    machine: Machine
    plans: int  # that were tried, the last good
    cycle_time: float  # s, of the motion planned at the limits themselves

    def shares(self, machine: Machine) -> dict[str, Load]:
        """What of the limits of `machine` the planner may use, axis by axis."""
        return {
            axis.name: Load(
                axis.limits.velocity / machine.axis(axis.name).limits.velocity,
                axis.limits.acceleration / machine.axis(axis.name).limits.acceleration,
            )
            for axis in self.machine.axes
        }


def respect_limits(path: str, setup: Setup, options: ReadingOptions, timing: Timing) -> Respect:
    """Find limits for the planner with which the shaped command keeps the machine's; timed as `timing` says.

    Raises
    ------
    OptionError
        Standard input cannot be read again; a time trajectory is not planned.
    InfeasibleError
        No plan kept them.
    """
    if path == STANDARD_INPUT:
        raise OptionError(
            "--respect-limits reads the program more than once, and standard input is gone after the first",
            hint="write the program to a file",
        )
    machine, shaping = setup.machine, setup.command_shaping(setup.planning.shaping)
    cycle_time: float | None = None
    caution, worst = CAUTION, 0.0
    for plans in range(1, PLANS + 1):
        with open_motion(path, setup, options, [timing], planner=machine) as motion:
            if motion.timed:
                raise OptionError(
                    f"{path} tells its own times: there is nothing to plan within lower limits",
                    hint="leave --respect-limits out, or give way-points without time_s",
                )
            work = Application(motion.blocks, setup.machine, shaping, setup.control.sample_time)
            for _ in work.blocks():
                pass
            done = work.summary()
        cycle_time = done.cycle_time if cycle_time is None else cycle_time
        worst = max(load.worst for load in done.loads.values())
        if worst <= KEPT:
            return Respect(machine, plans, cycle_time)
        machine = lowered(machine, done.loads, caution)
        caution *= 4.0
    raise InfeasibleError(
        f"shaped, the motion still takes {worst:.4g} times a limit after {PLANS} plans",
        hint="choose a shaper with smaller impulses: see sum |A| in cnc-shape design",
        source=path,
    )


def lowered(machine: Machine, loads: Mapping[str, Load], caution: float) -> Machine:
    """Lower the limits that a shaped command has exceeded, each by its excess and `caution` more."""
    axes = [_lowered(machine.axis(name), load, caution) for name, load in loads.items()]
    rest = [axis for axis in machine.axes if axis.name not in loads]
    return replace(machine, axes=(*axes, *rest))


def _lowered(axis: Axis, load: Load, caution: float) -> Axis:
    limits = axis.limits
    if load.velocity > KEPT:
        limits = replace(limits, velocity=limits.velocity * (1.0 - caution) / load.velocity)
    if load.acceleration > KEPT:
        limits = replace(limits, acceleration=limits.acceleration * (1.0 - caution) / load.acceleration)
    return replace(axis, limits=limits)
