"""What `design --emit` does: designs, or the shapers of a machine file, to the text of a controller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from json import dumps
from typing import Any

from cnc_shape.cli.designing import designs_json
from cnc_shape.cli.output import print_json, print_text
from cnc_shape.cli.subjects import check_axis
from cnc_shape.errors import OptionError
from cnc_shape.report.shaper_sheet import Corner
from cnc_shape.shapers.comparison import Design
from cnc_shape.writers.firmware import DEFAULT_SAMPLE_TIME, Handover, Target, emit


@dataclass(frozen=True, slots=True)
class Emitted:
    """A text for a controller, and the object that `--json` prints with it."""

    target: Target
    text: str
    result: dict[str, Any]


def target_of(word: str) -> Target:
    """The target called `word`.

    Raises
    ------
    OptionError
        There is none.
    """
    try:
        return Target(word)
    except ValueError:
        known = ", ".join(target.value for target in Target)
        raise OptionError(f"--emit knows no {word!r}", hint=f"use one of {known}") from None


def no_shaper() -> OptionError:
    """What is wrong where modes are given, but no shaper to hand over."""
    return OptionError(
        "--emit hands over one shaper, not a comparison", hint="name the shaper: cnc-shape design zvd --emit"
    )


def sample_time_of(given: float | None, machine: str | None, target: Target | None) -> float:
    """Sample time of a C header's taps, s: the one given, else the machine's where one is named.

    Raises
    ------
    OptionError
        One is given for a target without samples.
    """
    if given is not None and target is not Target.C:
        raise OptionError("--sample-time-s is for the taps of --emit c", hint="leave it out")
    if given is not None:
        return given
    if target is Target.C and machine is not None:
        from cnc_shape.config.machine_file import load_machine

        return load_machine(machine).control.sample_time
    return DEFAULT_SAMPLE_TIME


def handed_over(
    designs: Sequence[Design], target: Target, corner: Corner, sample_time: float, *, sensitivity: bool
) -> Emitted:
    """Designs as the text of `target`.

    Raises
    ------
    OptionError, InfeasibleError
        What the target cannot carry.
    """
    result = designs_json(designs, corner, sensitivity=sensitivity)
    if target is Target.JSON:
        text = dumps({"schema": "cnc-shape/design/1", **result}, indent=2, allow_nan=False)
    else:
        handovers = [Handover(one.axis, one.name, one.options, one.modes, one.shaper) for one in designs]
        text = emit(target, handovers, sample_time)
    return Emitted(target, text, result)


def hand_over_configured(
    machine: str | None, axis: str | None, target: Target, sample_time: float | None, *, json: bool
) -> None:
    """Print the shapers that a machine file gives its axes as the text of `target`.

    Raises
    ------
    OptionError
        A machine without shapers, no such axis, the target json, or what the target cannot carry.
    InfeasibleError
        What the target cannot carry.
    """
    from cnc_shape.config.machine_file import load_machine

    setup = load_machine(machine)
    if not setup.shapers:
        raise OptionError(f"{setup.source} has no shapers", hint="name one: cnc-shape design zvd --emit")
    if axis is not None:
        check_axis(axis, list(setup.shapers))
    if target is Target.JSON:
        raise OptionError("json is the result of a design, and none is asked for", hint="name the shaper")
    handovers = [
        Handover(name, choice.type, choice.options, setup.machine.axis(name).modes, setup.shapers[name])
        for name, choice in setup.choices.items()
        if axis in (None, name)
    ]
    text = emit(target, handovers, sample_time or setup.control.sample_time)
    show(Emitted(target, text, {}), json=json)


def show(emitted: Emitted, *, json: bool) -> None:
    """Print the text alone, or the object with it."""
    if json:
        text = {"target": emitted.target.value, "text": emitted.text}
        print_json("design", {**emitted.result, "emitted": text})
    else:
        print_text(emitted.text)
