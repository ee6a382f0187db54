"""Opening a program, a table of way-points or a time trajectory as a motion that can be run."""

from __future__ import annotations

import hashlib
from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.chunks import with_last
from cnc_shape.config.setup import Setup
from cnc_shape.errors import InfeasibleError
from cnc_shape.joints import CARTESIAN, joints_of
from cnc_shape.machine import LINEAR_DEFAULT, Machine
from cnc_shape.motion import Block, lacking, moving, replaying
from cnc_shape.program import Note, Program
from cnc_shape.readers import ReadingOptions, reading
from cnc_shape.readers.source import STANDARD_INPUT
from cnc_shape.readers.trajectories import resample
from cnc_shape.refusals import SAME_PLACE, line_on_toolpath, refuse_pose
from cnc_shape.smoothing import Smoothing, smoothing
from cnc_shape.timing import PLAIN, Timing
from cnc_shape.toolpath import Toolpath, building
from cnc_shape.trajectory import Trajectory, join_trajectories


@dataclass(slots=True)
class OpenMotion:
    """A motion that is being read and planned; ask for `warnings` when it is over."""

    name: str
    path: str
    setup: Setup
    lines: int  # of the file
    blocks: Iterator[Block]
    notes: list[Note] = field(default_factory=list[Note])
    moved: tuple[str, ...] = ()
    axes: tuple[str, ...] = ()  # of the commands
    timed: bool = False  # the file tells its own times, and nothing was planned

    def warnings(self, *, by_name: bool = False) -> list[str]:
        """What machine file and reader had to say, and which axes the machine does not describe.

        by_name: speak of files by their names alone, wherever they lie.
        """
        machine, path = self.setup.source, self.path
        told = list(self.setup.warnings)
        if by_name:
            told = [text.replace(machine, Path(machine).name, 1) for text in told]
            path = self.name
        told += [f"{path}:{note.line}: warning: {note.message}" for note in self.notes]
        return told + lacking_axes(self.setup.machine, self.moved)

    def unmet_loads(self) -> list[str]:
        """A warning for every load along an axis that the program leaves out, which is not simulated."""
        along = [load.direction for load in self.setup.disturbances.loads if isinstance(load.direction, str)]
        return [
            f"warning: the load along {axis.upper()} pushes nothing: the program does not name that axis"
            for axis in dict.fromkeys(along)
            if axis not in self.axes
        ]


def lacking_axes(machine: Machine, moved: Sequence[str]) -> list[str]:
    """A warning, if a program moves axes that the machine does not describe."""
    missing = lacking(machine, moved)
    if not missing:
        return []
    names = ", ".join(axis.upper() for axis in missing)
    return [
        f"warning: the machine lacks {names}, which the program moves: taken as ideal, "
        f"{LINEAR_DEFAULT.velocity:g} mm/s, {LINEAR_DEFAULT.acceleration:g} mm/s² "
        "(90 °/s, 900 °/s²), unlimited travel"
    ]


@contextmanager
def open_motion(
    path: str,
    setup: Setup,
    options: ReadingOptions | None = None,
    timings: Sequence[Timing] = (PLAIN,),
    watched: Sequence[Timing] = (),
    planner: Machine | None = None,
) -> Generator[OpenMotion]:
    """Open a file and plan it as it is read, once for each timing; where it tells the time itself, replay it.

    Tool lengths are the machine's where `options` have none. A time trajectory cannot be path-shaped: that is
    refused in `timings`, and left out of the `watched` ones. The planner keeps the limits of `planner`, by
    default the machine's own.

    Raises
    ------
    ProgramError
        What is wrong with the file, at once or while the blocks are drawn.
    InfeasibleError
        While the blocks are drawn: what no motion can satisfy.
    """
    period = setup.control.sample_time
    options = with_tools(options, setup)
    with reading(path, options) as opened:
        name = "stdin" if path == STANDARD_INPUT else Path(path).name
        motion = OpenMotion(name, opened.source, setup, opened.lines, iter(()))
        if opened.timed is not None:
            _refuse_path_shaping(timings, opened.source)
            command, toolpath = resample(opened.timed, period, samples=options.limits.samples)
            blocks = replaying(command, toolpath)
            motion.timed = True
        else:
            every = tuple(dict.fromkeys((*timings, *watched)))
            chunks = _noted(opened.chunks, motion.notes)
            machine = planner or setup.machine
            planning = setup.planning
            blocks = moving(chunks, machine, planning.path_tolerance, period, every, planning.path_limits)
        motion.blocks = _watched(_within_reach(blocks, setup, opened.source), motion)
        yield motion


def path_places(path: str, setup: Setup, options: ReadingOptions | None = None) -> FloatArray | None:
    """Place on the toolpath at which each cell of a program's path starts, mm; None: it tells its own times.

    Raises
    ------
    ProgramError
        What is wrong with the file.
    """
    options = with_tools(options, setup)
    build, smooth = building(), smoothing(Smoothing(setup.planning.path_tolerance))
    built = smoothed = None
    places: list[FloatArray] = []
    with reading(path, options) as opened:
        if opened.timed is not None:
            return None
        for chunk, last in with_last(opened.chunks):
            built, toolpath = build(built, chunk, last)
            smoothed, cells = smooth(smoothed, toolpath, last)
            places.append(cells.arc_length)
    return np.concatenate([np.zeros(0), *places])


def with_tools(options: ReadingOptions | None, setup: Setup) -> ReadingOptions:
    """Options with the machine's tool lengths where they have none."""
    options = options or ReadingOptions()
    if options.gcode.tools:
        return options
    return replace(options, gcode=replace(options.gcode, tools=setup.tools))


def _refuse_path_shaping(timings: Sequence[Timing], source: str) -> None:
    if any(timing.path_shaper is not None for timing in timings):
        raise InfeasibleError(
            "a time trajectory has no time law of its own that path shaping could act on",
            hint="use shaping: contour or axis, or give a path without times",
            source=source,
        )


def digest(path: str) -> str:
    """SHA-256 of a file; of standard input, which is gone by now, a dash."""
    if path == STANDARD_INPUT:
        return "-"
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _noted(chunks: Iterable[Program], notes: list[Note]) -> Iterator[Program]:
    for chunk in chunks:
        notes.extend(chunk.notes)
        yield replace(chunk, notes=())


def _within_reach(blocks: Iterable[Block], setup: Setup, source: str) -> Iterator[Block]:
    """Refuse the first commanded pose that the machine cannot hold, with its line, before it goes further."""
    if setup.kinematics == CARTESIAN:
        yield from blocks
        return
    near: list[Toolpath] = []  # chunks of the path that the motion has not left
    before: Trajectory | None = None
    first: Timing | None = None
    begun = False
    for block in blocks:
        if not begun:
            first, begun = block.timing, True
        if block.timing == first:
            if block.toolpath is not None and len(block.toolpath):
                near.append(block.toolpath)
            if len(block.command):
                command = block.command if before is None else join_trajectories([before, block.command])
                joints = joints_of(setup.machine.with_axes(command.axes), setup.kinematics)
                lines = partial(_line_of, near, command)
                refuse_pose(joints, joints.pose(command.position), lines, source)
                before = command.cut(slice(-1, None))
                place = float(command.arc_length[-1]) - SAME_PLACE
                near = [toolpath for toolpath in near if toolpath.arc_length[-1] >= place]
        yield block


def _line_of(near: Sequence[Toolpath], command: Trajectory, row: int) -> int | None:
    return line_on_toolpath(near, command.position[row], float(command.arc_length[row]))


def _watched(blocks: Iterable[Block], motion: OpenMotion) -> Iterator[Block]:
    for block in blocks:
        motion.moved, motion.axes = block.moved, block.command.axes
        yield block
