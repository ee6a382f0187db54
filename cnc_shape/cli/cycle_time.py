"""``cnc-shape check --time``: how long a program takes, beside its lengths over its feeds."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from cnc_shape.cli.output import warn
from cnc_shape.cli.progress import line_by_line, progress
from cnc_shape.cli.reading import sole_program
from cnc_shape.config.setup import Setup
from cnc_shape.cycle_time import ClockState, CycleTime, clocked
from cnc_shape.errors import OptionError
from cnc_shape.limits import NO_PATH_LIMITS
from cnc_shape.motion import planned
from cnc_shape.opening import lacking_axes
from cnc_shape.passing import Moves
from cnc_shape.program import Program
from cnc_shape.readers import Reading
from cnc_shape.writers.moves import write_moves
from cnc_shape.writers.publish import check_target

KEPT, JERK_KEPT = 1e-6, 1e-3  # -, excess up to which a limit counts as kept
ROUNDING = 1e-9  # -, excess that is not worth telling


@dataclass(frozen=True, slots=True)
class Clock:
    """What is asked about the time of programs."""

    setup: Setup
    times: Path | None  # file for the time of every move
    force: bool
    quiet: bool  # no warnings
    silent: bool  # no progress


def check_times(files: list[str], times: str, *, force: bool) -> Path:
    """The file for the times of one program.

    Raises
    ------
    OptionError
        There are several programs, or the file is the program itself.
    OutputError
        The file cannot be made there.
    """
    target = Path(times)
    sole_program(files, "--times", times)
    check_target(target, force=force)
    return target


def time_of(opened: Reading, chunks: Iterable[Program], clock: Clock) -> dict[str, Any]:
    """Plan the program of `opened`, whose chunks come through `chunks`, and say how long it takes.

    Raises
    ------
    InfeasibleError
        What no motion can satisfy.
    OptionError
        The times of moves are asked of a file that tells its own.
    """
    if opened.timed is not None:
        if clock.times is not None:
            raise OptionError(
                "--times is for programs: a time trajectory tells its own times", hint="leave --times out"
            )
        for _ in chunks:
            pass
        return {"planned": False, "cycle_time_s": float(opened.timed.points.time[-1])}
    machine, planning = clock.setup.machine, clock.setup.planning
    reached: ClockState | None = None

    def moves() -> Iterator[Moves]:
        nonlocal reached
        with progress("planning", opened.lines, quiet=clock.silent) as advance:
            stretches = planned(chunks, machine, planning.path_tolerance, path_limits=planning.path_limits)
            for sums, part in clocked(line_by_line(stretches, advance), machine, planning.path_limits):
                reached = sums
                yield part

    if clock.times is not None:
        write_moves(clock.times, moves(), force=clock.force)
    else:
        for _ in moves():
            pass
    assert reached is not None  # a reader yields one chunk at least
    total = reached.total()
    warn(lacking_axes(machine, total.moved), quiet=clock.quiet)
    return _object(total, clock.setup)


def _object(total: CycleTime, setup: Setup) -> dict[str, Any]:
    jerk = any(isfinite(axis.limits.jerk) for axis in setup.machine.axes)
    excess = total.excess
    along = {"path_acceleration": excess.path_acceleration, "chord": excess.chord}
    return {
        "planned": True,
        "cycle_time_s": total.cycle_time,
        "naive_time_s": total.naive_time,
        "feed_s": total.feed_time,
        "rapid_s": total.rapid_time,
        "dwell_s": total.dwell_time,
        "stops": total.stops,
        "share_at_feed": total.share_at_feed,
        "worst": [
            {"line": line.line, "time_s": line.time, "naive_s": line.naive_time} for line in total.worst
        ],
        "violation": {
            "velocity": excess.velocity, "acceleration": excess.acceleration,
            "jerk": excess.jerk if jerk else None, "feed": excess.feed,
            **(along if setup.planning.path_limits != NO_PATH_LIMITS else {}),
        },
    }  # fmt: skip


def time_facts(time: dict[str, Any]) -> list[tuple[str, str]]:
    """What the object says, for the eye."""
    cycle = time["cycle_time_s"]
    if not time["planned"]:
        return [("cycle time", f"{cycle:.3f} s, as the file tells")]
    naive = time["naive_time_s"]
    times = f", {cycle / naive:.3f} × the {naive:.3f} s of lengths over feeds" if naive > 0.0 else ""
    lost = [
        f"line {line['line']}: {line['time_s'] - line['naive_s']:.3f} s "
        f"({line['time_s']:.3f} s for {line['naive_s']:.3f} s)"
        for line in time["worst"]
    ]
    return [
        ("cycle time", f"{cycle:.3f} s{times}"),
        (
            "of that",
            f"feeds {time['feed_s']:.3f} s, rapids {time['rapid_s']:.3f} s, dwells {time['dwell_s']:.3f} s",
        ),
        *(
            [("at feed", f"{time['share_at_feed']:.1%} of the feeds' time is at the programmed feed")]
            if time["feed_s"] > 0.0
            else []
        ),
        ("stops", f"{time['stops']} on the way"),
        *(("most lost" if row == 0 else "", text) for row, text in enumerate(lost)),
        ("limits", _limits(time["violation"])),
    ]


def _limits(violation: dict[str, float | None]) -> str:
    told = {name.replace("_", " "): excess for name, excess in violation.items() if excess is not None}
    kept = all(excess <= (JERK_KEPT if name == "jerk" else KEPT) for name, excess in told.items())
    excesses = ", ".join(
        f"{name} {excess if excess > ROUNDING else 0.0:.1g}" for name, excess in told.items()
    )
    return f"{'kept' if kept else 'exceeded'}, largest relative excess: {excesses}"
