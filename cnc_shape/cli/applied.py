"""What ``cnc-shape apply`` says: its JSON, its text, its warnings, and the head of a program."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cnc_shape import __version__
from cnc_shape.applying import Applied, Load
from cnc_shape.config.setup import Setup
from cnc_shape.respecting import KEPT, Respect
from cnc_shape.shapers import Shaper
from cnc_shape.units import MICROMETRE, MILLISECOND
from cnc_shape.writers.program import WrittenProgram


def result(
    done: Applied, target: Path | None, written: WrittenProgram | None, respect: Respect | None, setup: Setup
) -> dict[str, Any]:
    """The object of ``--json``."""
    answer: dict[str, Any] = {
        "cycle_time_s": done.cycle_time,
        "shaped_time_s": done.shaped_time,
        "samples": done.samples,
        "sample_time_s": done.sample_time,
        "axes": list(done.axes),
        "command_contour_rms_um": done.command.rms / MICROMETRE,
        "command_contour_max_um": done.command.max / MICROMETRE,
        "worst_limit_violation": done.worst_limit_violation,
        "shaped_acceleration_ratio": done.shaped_acceleration_ratio,
        "limits": {
            axis: {"velocity_ratio": load.velocity, "acceleration_ratio": load.acceleration}
            for axis, load in done.loads.items()
        },
        "output": "-" if target is None else str(target),
    }
    if written is not None:
        answer |= {
            "segments": written.segments,
            "program_deviation_um": written.deviation / MICROMETRE,
            "program_deviation_mdeg": written.turn_deviation / MILLISECOND,
            "time_difference_s": written.time_difference,
        }
    if respect is not None:
        answer["respected"] = {
            "plans": respect.plans,
            "cycle_time_added_s": done.cycle_time - respect.cycle_time,
            "planned_limits": {
                axis: {"velocity_ratio": share.velocity, "acceleration_ratio": share.acceleration}
                for axis, share in _moved(respect.shares(setup.machine), done).items()
            },
        }
    return answer


def text(
    done: Applied, target: Path, written: WrittenProgram | None, respect: Respect | None, setup: Setup
) -> str:
    """The lines for a person."""
    axes = ", ".join(axis.upper() for axis in done.axes)
    lines = [f"{target}: {done.samples} samples of {axes}"]
    if written is not None:
        turned = f" and {written.turn_deviation * 1e3:.3f} millidegrees" if written.turn_deviation else ""
        lines = [
            f"{target}: {written.segments} moves of {axes} for {done.samples} samples",
            f"  read back: within {written.deviation / MICROMETRE:.3f} µm{turned} of every sample, "
            f"{abs(written.time_difference):.1e} s off at the end",
        ]
    lines += [
        f"  {done.shaped_time:.3f} s shaped, {done.cycle_time:.3f} s unshaped",
        f"  command leaves the path by up to {done.command.max / MICROMETRE:.2f} µm "
        f"({done.command.rms / MICROMETRE:.2f} µm RMS)",
        f"  largest acceleration {done.shaped_acceleration_ratio:.1%} of its limit",
    ]
    if respect is not None:
        added = done.cycle_time - respect.cycle_time
        lowered = [
            f"{axis.upper()} to {share.velocity:.1%} of its velocity "
            f"and {share.acceleration:.1%} of its acceleration"
            for axis, share in _moved(respect.shares(setup.machine), done).items()
            if min(share.velocity, share.acceleration) < 1.0
        ]
        lines.append(
            f"  limits kept after {respect.plans} plans: {'; '.join(lowered)}; "
            f"{added:.3f} s more ({added / respect.cycle_time:.1%})"
            if lowered
            else "  limits kept as planned"
        )
    return "\n".join(lines)


def notes(done: Applied, setup: Setup, program: Path | None, *, timed: bool = False) -> list[str]:
    """Warnings about what was applied.

    program: the one that was written, if any; timed: the input told its own times, and nothing was planned.
    """
    told = [] if setup.acting_shapers else ["this machine has no shapers: the command is written unshaped"]
    over = [
        f"{axis.upper()} by {100.0 * (ratio - 1.0):.2g} % in {what}"
        for axis, load in done.loads.items()
        for what, ratio in (("velocity", load.velocity), ("acceleration", load.acceleration))
        if ratio > KEPT
    ]
    if over:
        way = "its times are as given" if timed else "--respect-limits plans anew"
        told.append(f"warning: the shaped command exceeds limits: {', '.join(over)}; {way}")
    if program is not None:
        told.append(
            f"{program} holds the motion alone: no spindle, coolant, tool change or other machine function"
        )
    return told


def remarks(name: str, setup: Setup) -> list[str]:
    """Comments at the head of a program: what made it, and what it does not hold."""
    return [
        f"shaped motion of {name}, by cnc-shape {__version__}",
        f"machine: {setup.machine.name}",
        f"shaping: {setup.planning.shaping.value}",
        *_shaper_lines(setup.acting_shapers, setup),
        "motion alone: no spindle, coolant, tool change or other machine function of the original",
        "positions of the control point in mm and degrees, as read with G54 at the machine's origin",
    ]


def _shaper_lines(shapers: Mapping[str, Shaper], setup: Setup) -> list[str]:
    if not shapers:
        return ["no shapers"]
    return [
        f"{axis.upper()} shaped by {setup.choices[axis].type if axis in setup.choices else 'impulses'}: "
        f"{shaper.times.size} impulses over {shaper.duration / MILLISECOND:.4g} ms"
        for axis, shaper in shapers.items()
    ]


def _moved(loads: Mapping[str, Load], done: Applied) -> dict[str, Load]:
    return {axis: load for axis, load in loads.items() if axis in done.axes}
