"""The trade: every kind of shaping on one program, with the structure as modelled and as wrong as it may be.

A machine file says by how much a mode's frequency may be off. The tool is simulated with the nominal
structure and with each corner of that box: every axis's frequencies all too low or all too high. A kind of
shaping is as good as its worst corner.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.config.setup import CASE_NAMES, Setup, Shaping
from cnc_shape.contour import MeasuringState, Tally, measuring, tally
from cnc_shape.errors import OptionError
from cnc_shape.joints import joints_of
from cnc_shape.machine import Axis, Machine
from cnc_shape.motion import Block
from cnc_shape.pipeline import Deviation, deviation
from cnc_shape.program import ROTARY
from cnc_shape.response import Response
from cnc_shape.servo import loop_reach
from cnc_shape.shapers.analysis import contour_factor
from cnc_shape.shapers.command_shaping import CommandShaping, CommandState, command_shaping
from cnc_shape.shapers.shaper import NONE as UNSHAPED
from cnc_shape.simulation import SimulationState, simulating
from cnc_shape.timing import PLAIN, Timing


@dataclass(frozen=True, slots=True)
class Model:
    """How far off the structure is: a factor on all frequencies of an axis; nominal where it names none."""

    factors: Mapping[str, float]

    def summary(self) -> str:
        """``X +3 %, Y -3 %``, or ``nominal``."""
        off = [f"{axis.upper()} {100.0 * (factor - 1.0):+g} %" for axis, factor in self.factors.items()]
        return ", ".join(off) or "nominal"


NOMINAL = Model({})


def models(machine: Machine) -> tuple[Model, ...]:
    """The nominal structure, and all axes' frequencies off by what the machine file says, up and down.

    Of an axis with several modes the largest uncertainty counts, for all of them.
    """
    off = {
        axis.name: share
        for axis in machine.axes
        if (share := max((mode.frequency_uncertainty for mode in axis.modes), default=0.0)) > 0.0
    }
    signs = product((-1.0, 1.0), repeat=len(off)) if off else ()
    corners = [
        Model({axis: 1.0 + sign * share for (axis, share), sign in zip(off.items(), chosen, strict=True)})
        for chosen in signs
    ]
    return (NOMINAL, *corners)


def off_by(machine: Machine, model: Model) -> Machine:
    """The machine whose structure is off as a model says."""

    def moved(axis: Axis) -> Axis:
        factor = model.factors.get(axis.name, 1.0)
        modes = tuple(mode.scaled(factor) for mode in axis.modes)
        return replace(axis, modes=modes)

    return replace(machine, axes=tuple(moved(axis) for axis in machine.axes))


@dataclass(frozen=True, slots=True)
class ModelResult:
    """What the tool does where the structure is off by so much."""

    model: Model
    tool: Deviation
    residual_vibration: Mapping[str, float]  # axis: mm or rad


@dataclass(frozen=True, slots=True)
class TradeRow:
    """One kind of shaping: what it costs, and what it buys in each model."""

    name: str
    cycle_time: float  # s
    contour_factors: Mapping[str, float]  # axis: kappa, tool error on curves over the unshaped one
    command: Deviation
    drives: Deviation
    results: tuple[ModelResult, ...]  # the nominal one first

    @property
    def nominal(self) -> ModelResult:
        """What it does where the structure is as modelled."""
        return self.results[0]

    @property
    def worst(self) -> ModelResult:
        """The model in which the tool leaves the path farthest on average."""
        return max(self.results, key=lambda result: result.tool.rms)

    @property
    def worst_max(self) -> float:
        """Largest contour error of the tool in any model, mm."""
        return max(result.tool.max for result in self.results)


def contour_factors(setup: Setup, shaping: Shaping) -> dict[str, float]:
    """Kappa of every linear axis that bends: 1 where axes are not shaped, 0 where curves are compensated."""
    found: dict[str, float] = {}
    for axis in setup.machine.axes:
        factor = contour_factor(setup.shapers.get(axis.name, UNSHAPED), axis.modes)
        if factor is not None and axis.name not in ROTARY:
            found[axis.name] = {Shaping.AXIS: factor, Shaping.CONTOUR: 0.0}.get(shaping, 1.0)
    return found


class ModelTrial:
    """One way to time and shape a motion, simulated with several structures at once.

    Whoever `listens` is given the largest contour error of the tool in any of them, sample by sample.
    """

    def __init__(
        self,
        setup: Setup,
        shaping: CommandShaping,
        timing: Timing,
        structures: Sequence[Model],
        listen: Callable[[FloatArray], None] | None = None,
    ) -> None:
        self._listen = listen
        self._setup = setup
        self._control = replace(setup.control, cross_coupling=None)
        self._how, self._timing, self._models = shaping, timing, tuple(structures)
        self.begun = False
        self._shaped: CommandState | None = None
        self._states: list[SimulationState | None] = [None] * len(self._models)
        self._measured: MeasuringState | None = None
        self._tallies = [Tally() for _ in range(len(self._models) + 2)]
        self._cycle_time = self._longer = 0.0
        self._axes: tuple[str, ...] = ()

    def advance(self, block: Block) -> None:
        """Run the next block, if it is of this timing; a time trajectory has no time law to shape."""
        theirs = block.timing
        if theirs != self._timing and (theirs is not None or self._timing.path_shaper is not None):
            return
        if not self.begun:
            self._begin(block.command.axes)
        self._shaped, command = self._shape(self._shaped, block.command, block.last)
        responses: list[Response] = []
        for k, simulate in enumerate(self._simulate):
            self._states[k], response = simulate(self._states[k], block.toolpath, command, block.last)
            responses.append(response)
        said, nominal = responses[0].command, responses[0].position
        signals = (said.position, nominal, *(response.tool for response in responses))
        self._measured, errors = self._measure(
            self._measured, block.toolpath, said.arc_length, signals, block.last
        )
        self._tallies = [tally(state, error) for state, error in zip(self._tallies, errors, strict=True)]
        if self._listen is not None:
            self._listen(np.max([error.distance for error in errors[2:]], axis=0))
        if block.last:
            self._cycle_time = block.cycle_time + self._longer

    def row(self, name: str, factors: Mapping[str, float]) -> TradeRow:
        """What it found; call it after the last block."""
        command, drives, *tools = (deviation(found) for found in self._tallies)
        results = [
            ModelResult(model, tool, dict(zip(self._axes, state.residual.tolist(), strict=True)))
            for model, tool, state in zip(self._models, tools, self._states, strict=True)
            if state is not None
        ]
        return TradeRow(name, self._cycle_time, factors, command, drives, tuple(results))

    def _begin(self, axes: tuple[str, ...]) -> None:
        period, machine = self._control.sample_time, self._setup.machine.with_axes(axes)
        self._axes, self.begun = axes, True
        self._longer = self._how.longer(axes, period)
        self._shape = command_shaping(self._how, axes, period)
        kinematics = self._setup.kinematics
        reach = loop_reach(joints_of(machine, kinematics), self._control, self._longer)
        self._simulate = [
            simulating(off_by(machine, model), self._control, kinematics, reach) for model in self._models
        ]
        self._measure = measuring(reach)


def _timings(setup: Setup) -> dict[Shaping, Timing]:
    """How each kind times the motion; shapers without a common one leave path shaping out."""
    found: dict[Shaping, Timing] = {}
    for kind in CASE_NAMES if setup.shapers else ():
        try:
            found[kind] = setup.timing(kind)
        except OptionError:
            if kind is setup.planning.shaping:
                raise
    return found


class Trade:
    """All kinds of shaping under way on one program: feed it every block, then ask for the rows."""

    def __init__(self, setup: Setup) -> None:
        structures = models(setup.machine)
        timings = _timings(setup)
        self.timings = tuple(dict.fromkeys([PLAIN, *timings.values()]))
        self._factors = {kind: contour_factors(setup, kind) for kind in timings}
        self._trials = {
            kind: ModelTrial(setup, setup.command_shaping(kind), timing, structures)
            for kind, timing in timings.items()
        }

    def advance(self, block: Block) -> None:
        """Run the next block through every kind."""
        for trial in self._trials.values():
            trial.advance(block)

    def rows(self) -> tuple[TradeRow, ...]:
        """One row a kind; none where the machine has no shapers. Call it after the last block."""
        return tuple(
            trial.row(CASE_NAMES[kind], self._factors[kind])
            for kind, trial in self._trials.items()
            if trial.begun
        )
