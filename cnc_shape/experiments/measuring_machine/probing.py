"""The probing cycle of a coordinate measuring machine: gross move, pause, approach, retract.

The paper shows the cycle without numbers; these are ours, for a machine of its kind, and so is the model: the
probe hangs on a column that swings at 25 Hz. ``samples/probing.nc`` on ``configs/cmm.yaml`` is the same cycle
as a program.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.config.bundled import bundled
from cnc_shape.config.machine_file import load_machine
from cnc_shape.experiments.straight_motion import StraightMotion, joined, move, settled
from cnc_shape.modes import Mode
from cnc_shape.opening import open_motion
from cnc_shape.pipeline import Case, Run, run
from cnc_shape.shapers import NONE, Shaper, ei, sd, zv, zvd
from cnc_shape.shapers.command_shaping import CommandShaping

COLUMN = Mode(natural_frequency=25.0, damping_ratio=0.02)
TOO_HIGH = Mode(natural_frequency=27.5, damping_ratio=0.02)  # a model that is 10 % off
GROSS = move(50.0, 100.0, 1000.0)
APPROACH, RETRACT = (4.0, 8.0, 400.0), (-4.0, 60.0, 1000.0)  # mm, mm/s, mm/s^2
PAUSE = 0.060  # s
SETTLED = 2e-3  # mm, how still the probe must hang
STEADY = 1e-3  # mm, how still it must be during the approach
STEP = 2e-5  # s, at which it is looked at
WATCHED = 2.0  # s
MACHINE, PROGRAM = "cmm.yaml", "probing.nc"


def shapers() -> Mapping[str, Shaper]:
    """Shapers of the cycle, with a model that is right and one that is 10 % off."""
    return {
        "unshaped": NONE,
        "ZV": zv(COLUMN),
        "SD, 0.8 periods": sd(COLUMN, duration_periods=0.8),
        "ZVD": zvd(COLUMN),
        "EI": ei(COLUMN),
        "ZV, model 10 % high": zv(TOO_HIGH),
        "ZVD, model 10 % high": zvd(TOO_HIGH),
        "EI, model 10 % high": ei(TOO_HIGH),
    }


@dataclass(frozen=True, slots=True)
class Cycle:
    """What the probe does under one shaper."""

    ring: float  # mm, after the gross move
    settling: float  # s, until the probe hangs within `SETTLED`, from the end of the unshaped gross move
    approach: float  # s, from the start of the approach until the probe moves steadily within `STEADY`


def cycle(shaper: Shaper) -> Cycle:
    """Measure the cycle under a shaper."""
    gross = GROSS.shaped(shaper)
    time = GROSS.end + np.arange(0.0, WATCHED, STEP)
    settling = settled(gross.deflection([COLUMN], time), time, SETTLED) - GROSS.end
    return Cycle(gross.ring(COLUMN), settling, approach_time(shaper, STEADY))


def approach_time(shaper: Shaper, tolerance: float) -> float:
    """Time from the start of the approach until the deflection stays within `tolerance`, s.

    The approach is taken as going on: a touch ends it, sooner or later.
    """
    gross, start = GROSS.shaped(shaper), approach_start(shaper)
    distance, speed, acceleration = APPROACH
    approach = move(1e3 * distance, speed, acceleration, start)
    time = start + np.arange(0.0, WATCHED, STEP)
    bent = joined([gross, approach.shaped(shaper)]).deflection([COLUMN], time)
    return settled(bent, time, tolerance) - start


def approach_start(shaper: Shaper) -> float:
    """When the approach begins, s: a pause after the end of the shaped gross move."""
    return GROSS.end + shaper.duration + PAUSE


def whole_cycle(shaper: Shaper) -> StraightMotion:
    """Gross move, pause, approach and retract, shaped; each begins when the one before has ended."""
    approach = move(*APPROACH, start=approach_start(shaper))
    retract = move(*RETRACT, start=approach.end + shaper.duration)
    return joined([part.shaped(shaper) for part in (GROSS, approach, retract)])


@cache
def machine_run() -> Run:
    """The cycle as a program, through planning, shaping and structure at the machine's sample time."""
    setup = load_machine(bundled(MACHINE))
    flexible = {axis.name: axis.modes[0] for axis in setup.machine.axes if axis.modes}
    alone = replace(setup.control, cross_coupling=None)
    made: Mapping[str, Mapping[str, Shaper]] = {
        "unshaped": {},
        "zv": {name: zv(mode) for name, mode in flexible.items()},
        "zvd": {name: zvd(mode) for name, mode in flexible.items()},
    }
    cases = [Case(name, CommandShaping(of), alone) for name, of in made.items()]
    with open_motion(str(bundled(PROGRAM)), setup) as motion:
        return run(motion.blocks, setup, cases, motion.name, record=True)


def deflection(case: str) -> tuple[FloatArray, FloatArray]:
    """Time, s, and deflection of the probe in X, mm, in a case of `machine_run` and half a second after."""
    signals = machine_run().signal(case)
    column = signals.axes.index("x")
    during = signals.tool[:, column] - signals.position[:, column]
    time = np.concatenate([signals.time, signals.time[-1] + signals.settling_time[1:]])
    return time, np.concatenate([during, signals.settling[1:, column]])
