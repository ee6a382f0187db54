"""``cnc-shape design``: one shaper, its impulses and what it does."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cnc_shape.modes import Mode
    from cnc_shape.shapers import Shaper


def design(
    shaper: Annotated[str, typer.Argument(metavar="SHAPER", help="zv, zvd or cascade.")],
    frequency_hz: Annotated[
        list[float] | None, typer.Option(help="Undamped natural frequency of a mode; repeat for several.")
    ] = None,
    damping_ratio: Annotated[
        list[float] | None, typer.Option(help="Damping ratio of a mode, in the order of the frequencies.")
    ] = None,
    machine: Annotated[
        str | None,
        typer.Option(
            "-m", "--machine", envvar="CNC_SHAPE_MACHINE", help="Machine file: a shaper for each axis."
        ),
    ] = None,
    of: Annotated[str, typer.Option(help="Single-mode shaper that a cascade is made of.")] = "zv",
    vibration_tolerance: Annotated[
        float, typer.Option(help="Residual vibration that the insensitivity is told for.")
    ] = 0.05,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Design an input shaper for one or several modes."""
    from cnc_shape.cli.output import print_json, print_text
    from cnc_shape.errors import OptionError
    from cnc_shape.modes import Mode
    from cnc_shape.shapers import MULTI_MODE, SINGLE_MODE, cascade

    known = [*SINGLE_MODE, *MULTI_MODE]
    if shaper not in known:
        raise OptionError(
            f"unknown shaper {shaper!r}", hint="the shapers built so far are " + ", ".join(known)
        )
    if of not in SINGLE_MODE:
        raise OptionError(
            f"a cascade is made of {' or '.join(SINGLE_MODE)}, not {of!r}", hint="leave --of out for zv"
        )
    if of != "zv" and shaper != "cascade":
        raise OptionError(f"--of belongs to cascade, not to {shaper}")
    frequencies, dampings = frequency_hz or [], damping_ratio or []
    if len(dampings) not in (0, len(frequencies)):
        raise OptionError(
            f"{len(frequencies)} frequencies but {len(dampings)} damping ratios",
            hint="repeat --damping-ratio once for each --frequency-hz, or leave it out for undamped modes",
        )
    per_axis: list[tuple[str | None, tuple[Mode, ...]]] = []
    if frequencies:
        pairs = zip(frequencies, dampings or [0.0] * len(frequencies), strict=True)
        share = 1.0 / len(frequencies)
        per_axis.append((None, tuple(Mode(f, z, share) for f, z in pairs)))
    else:
        per_axis.extend(_machine_modes(machine))
    designs: list[dict[str, Any]] = []
    for axis, modes in per_axis:
        if shaper in SINGLE_MODE and len(modes) > 1:
            raise OptionError(
                f"{shaper} is for one mode, not {len(modes)}", hint="use cascade, or give one --frequency-hz"
            )
        made = (
            SINGLE_MODE[shaper](next(iter(modes)))
            if shaper in SINGLE_MODE
            else cascade(modes, SINGLE_MODE[of])
        )
        options: dict[str, object] = {"of": of} if shaper == "cascade" else {}
        designs.append(_describe(axis, shaper, made, modes, options, vibration_tolerance))
    if json:
        print_json("design", {"designs": designs})
        return
    for entry in designs:
        print_text(_text(entry))


def _machine_modes(machine: str | None) -> list[tuple[str | None, tuple[Mode, ...]]]:
    from cnc_shape.config import load_machine
    from cnc_shape.errors import OptionError

    if machine is None:
        raise OptionError("which mode?", hint="give --frequency-hz and --damping-ratio, or -m MACHINE")
    axes = [(axis.name, axis.modes) for axis in load_machine(machine).machine.axes if axis.modes]
    if not axes:
        raise OptionError(
            f"{machine} has no modes", hint="give an axis modes: [{frequency_hz: 30, damping_ratio: 0.02}]"
        )
    return list(axes)


def _describe(
    axis: str | None,
    name: str,
    shaper: Shaper,
    modes: Sequence[Mode],
    options: dict[str, object],
    tolerance: float,
) -> dict[str, Any]:
    from cnc_shape.shapers.analysis import contour_factor, insensitivity, residual_vibration

    band = insensitivity(shaper, modes, tolerance)
    return {
        "axis": axis,
        "shaper": name,
        "modes": [{"frequency_hz": m.natural_frequency, "damping_ratio": m.damping_ratio} for m in modes],
        "options": options,
        "times_s": shaper.times.tolist(),
        "amplitudes": shaper.amplitudes.tolist(),
        "duration_s": shaper.duration,
        "delay_s": shaper.delay,
        "residual_vibration": [float(residual_vibration(shaper, mode)) for mode in modes],
        "sum_abs_amplitude": shaper.sum_abs_amplitude,
        "max_running_sum": shaper.max_running_sum,
        "contour_factor": contour_factor(shaper, modes),
        "insensitivity": {
            "tolerance": band.tolerance,
            "low": band.low,
            "high": band.high,
            "width": band.width,
            "margin": band.margin,
        },
    }


def _text(entry: dict[str, Any]) -> str:
    modes = ", ".join(f"{m['frequency_hz']:g} Hz (damping {m['damping_ratio']:g})" for m in entry["modes"])
    band = entry["insensitivity"]
    high = "∞" if band["high"] is None else f"{band['high']:.4f}"
    impulses = "\n".join(
        f"  {1e3 * t:10.4f} ms   {a:+.6f}" for t, a in zip(entry["times_s"], entry["amplitudes"], strict=True)
    )
    factor = entry["contour_factor"]
    curve = "none: these modes do not bend" if factor is None else f"{factor:+.4f}"
    where = f"{entry['axis']}: " if entry["axis"] else ""
    return "\n".join(
        (
            f"{where}{entry['shaper']} for {modes}",
            impulses,
            f"  duration {1e3 * entry['duration_s']:.3f} ms, delay {1e3 * entry['delay_s']:.3f} ms",
            f"  vibration left at the design point {max(entry['residual_vibration']):.1e}",
            f"  at most {band['tolerance']:.0%} for {band['low']:.4f} to {high} of the modelled frequency",
            f"  sum |A| {entry['sum_abs_amplitude']:.4f}, largest running sum {entry['max_running_sum']:.4f}",
            f"  curve factor {curve} (tool error on a curve, of the unshaped one)",
        )
    )
