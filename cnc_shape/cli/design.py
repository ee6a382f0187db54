"""``cnc-shape design``: a shaper for every axis, or all shapers compared."""

from __future__ import annotations

from typing import Annotated

import typer

from cnc_shape.cli.options import Force, Json, Machine, Quiet

Number = float | None
Numbers = list[float] | None


def design(
    shaper: Annotated[
        str | None, typer.Argument(metavar="[SHAPER]", help="Its name; without one, all are compared.")
    ] = None,
    frequency_hz: Annotated[
        Numbers, typer.Option(help="Undamped natural frequency of a mode; repeat for several.")
    ] = None,
    damping_ratio: Annotated[
        Numbers, typer.Option(help="Damping ratio of a mode, in the order of the frequencies.")
    ] = None,
    frequency_uncertainty: Annotated[
        Numbers,
        typer.Option(help="How far off a frequency may be, relative: 0.1; for each mode, or one for all."),
    ] = None,
    damping_uncertainty: Annotated[
        Numbers,
        typer.Option(help="How far off a damping ratio may be, relative; for each mode, or one for all."),
    ] = None,
    machine: Machine = None,
    duration_s: Annotated[Number, typer.Option(help="sd, virtual_mode: time of the last impulse.")] = None,
    duration_periods: Annotated[
        Number, typer.Option(help="sd, virtual_mode, mzv: the same in damped periods of the mode.")
    ] = None,
    virtual_frequency_hz: Annotated[
        Number, typer.Option(help="virtual_mode: the mode that is not there; higher is shorter.")
    ] = None,
    max_amplitude: Annotated[
        Number, typer.Option(help="sd, multi_mode, optimal, virtual_mode: largest impulse.")
    ] = None,
    min_gap_s: Annotated[Number, typer.Option(help="sd: least time between two impulses.")] = None,
    metric: Annotated[
        str | None, typer.Option(help="sd: what is to be largest, insensitivity or margin.")
    ] = None,
    positive: Annotated[
        bool, typer.Option("--positive", help="sd, multi_mode, optimal: no negative impulses.")
    ] = False,
    derivatives: Annotated[
        list[int] | None,
        typer.Option(help="zv, multi_mode, optimal: derivatives of V that vanish, too; for each mode."),
    ] = None,
    impulses: Annotated[int | None, typer.Option(help="mzv: how many impulses.")] = None,
    of: Annotated[
        str | None, typer.Option(help="cascade: the shaper of one mode that it is made of.")
    ] = None,
    min_running_sum: Annotated[
        Number, typer.Option(help="optimal: least value that a shaped step may take.")
    ] = None,
    max_running_sum: Annotated[
        Number, typer.Option(help="optimal: largest value that a shaped step may take.")
    ] = None,
    max_sum_abs_amplitude: Annotated[
        Number, typer.Option(help="optimal: largest sum |A|, which bounds the demand of any motion.")
    ] = None,
    times_s: Annotated[Numbers, typer.Option(help="impulses: time of an impulse; repeat.")] = None,
    amplitudes: Annotated[Numbers, typer.Option(help="impulses: amplitude of an impulse; repeat.")] = None,
    vibration_tolerance: Annotated[
        Number,
        typer.Option(help="Vibration that may be left, relative: 0.05; of ei, sd, optimal and all bands."),
    ] = None,
    corner_speed_mm_s: Annotated[
        float, typer.Option(help="Speed at which the corner is taken whose smoothing is told.")
    ] = 5.0,
    corner_tolerance_mm: Annotated[
        Number,
        typer.Option(
            help="Of a corner with a stop; the tolerance of the machine's path, or 0.05.", show_default=False
        ),
    ] = None,
    sensitivity: Annotated[
        bool, typer.Option("--sensitivity", help="JSON: V over frequency and damping, too.")
    ] = False,
    axis: Annotated[
        str | None, typer.Option(help="Only this axis of the machine; or the one the frequencies are of.")
    ] = None,
    emit: Annotated[
        str | None,
        typer.Option(
            metavar="TARGET",
            help="Print the text that hands the shaper to a controller: rrf, rrf-3.4, klipper, "
            "klipper-custom, marlin, marlin-ft, c, yaml or json. Without SHAPER the machine's own shapers.",
        ),
    ] = None,
    sample_time_s: Annotated[
        Number,
        typer.Option(help="--emit c: sample time of the taps; the machine's, or 0.001.", show_default=False),
    ] = None,
    plot: Annotated[
        str | None, typer.Option(metavar="FILE", help="Draw the shaper, or the comparison: .png, .svg, .pdf.")
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Design input shapers: one for every axis of a machine or for given modes, or compare all.

    Shapers: zv zvd zvdd zvddd umzv mzv ei 2hump_ei 3hump_ei virtual_mode sd; for several modes cascade,
    multi_mode and optimal; as firmwares compute them klipper_ei klipper_2hump_ei klipper_3hump_ei fitted_ei
    duet_ei2 duet_ei3; and impulses of your own. --emit hands the result to a controller.
    """
    from cnc_shape.cli import designing, emitting
    from cnc_shape.cli.subjects import subjects_of

    target = None if emit is None else emitting.target_of(emit)
    sample_time = emitting.sample_time_of(sample_time_s, machine, target)
    options: dict[str, object] = {
        "duration_s": duration_s, "duration_periods": duration_periods, "max_amplitude": max_amplitude,
        "virtual_frequency_hz": virtual_frequency_hz, "min_gap_s": min_gap_s, "metric": metric,
        "positive": positive or None, "derivatives": derivatives or None, "impulses": impulses, "of": of,
        "min_running_sum": min_running_sum, "max_running_sum": max_running_sum,
        "max_sum_abs_amplitude": max_sum_abs_amplitude, "times_s": times_s or None,
        "amplitudes": amplitudes or None, "vibration_tolerance": vibration_tolerance,
    }  # fmt: skip
    given = {key: value for key, value in options.items() if value is not None}
    drawing = designing.drawing_at(plot, force=force)
    if shaper is None and target is not None:
        if frequency_hz or damping_ratio or frequency_uncertainty or damping_uncertainty or plot is not None:
            raise emitting.no_shaper()
        designing.refuse_options(given)
        emitting.hand_over_configured(machine, axis, target, sample_time_s, json=json)
        return
    subjects, corner = subjects_of(
        frequency_hz or [], damping_ratio or [], frequency_uncertainty or [], damping_uncertainty or [],
        machine, corner_speed_mm_s, corner_tolerance_mm, axis,
    )  # fmt: skip
    if shaper is None:
        designing.compare_all(
            subjects, given, corner, drawing, quiet=quiet, json=json, sensitivity=sensitivity
        )
        return
    designs = designing.design_one(subjects, shaper, given)
    result = (
        None
        if target is None
        else emitting.handed_over(designs, target, corner, sample_time, sensitivity=sensitivity)
    )
    drawing(lambda: designing.design_figure(designs))
    if result is None:
        designing.show(designs, corner, json=json, sensitivity=sensitivity)
    else:
        emitting.show(result, json=json)
