"""A shaper in numbers: as the JSON that others rely on, and as text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from cnc_shape.report.text import one_line
from cnc_shape.shapers.analysis import vibration
from cnc_shape.shapers.comparison import Design
from cnc_shape.shapers.measures import ModelError

RATIOS = np.linspace(0.5, 1.5, 51)  # -, actual over modelled frequency
NOTHING = 1e-12  # s or s^2 a millimetre: below it the tool stays on the path whatever the axes do
DAMPING_RATIOS = (0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3)  # as in paper 000, Fig. 4


@dataclass(frozen=True, slots=True)
class Corner:
    """The right-angled corner that a shaper is asked about."""

    speed: float  # mm/s, of a corner without a stop
    tolerance: float  # mm, of a corner with a stop


def design_json(
    design: Design, options: Mapping[str, object], corner: Corner, *, sensitivity: bool = False
) -> dict[str, Any]:
    """One design; see the contract of `design`. `options` are those given, by their keys."""
    shaper, found = design.shaper, design.assessment
    band = found.insensitivity
    result: dict[str, Any] = {
        "axis": design.axis,
        "shaper": design.name,
        "modes": [
            {"frequency_hz": m.natural_frequency, "damping_ratio": m.damping_ratio} for m in design.modes
        ],
        "options": dict(options),
        "times_s": shaper.times.tolist(),
        "amplitudes": shaper.amplitudes.tolist(),
        "duration_s": shaper.duration,
        "delay_s": shaper.delay,
        "residual_vibration": list(found.residual_vibration),
        "sum_abs_amplitude": shaper.sum_abs_amplitude,
        "max_running_sum": shaper.max_running_sum,
        "contour_factor": found.contour_factor,
        "insensitivity": {
            "tolerance": band.tolerance,
            "low": band.low,
            "high": band.high,
            "width": band.width,
            "margin": band.margin,
        },
        "model_error": [
            {
                "frequency": error.frequency,
                "damping": error.damping,
                "assumed": error.assumed,
                "residual_vibration": error.residual_vibration,
            }
            for error in found.model_error
        ],
        "corner": {
            "speed_mm_s": corner.speed,
            "smoothing_mm": found.corner_smoothing(corner.speed),
            "tolerance_mm": corner.tolerance,
            "acceleration_mm_s2": found.corner_acceleration(corner.tolerance),
        },
        "tool": {
            "curve_s2": found.tool.curve,
            "stop_corner_s2": found.tool.stop,
            "stop_corner_half_dwell_s2": found.tool.stop_half_dwell,
            "corner_s": found.tool.corner_at_speed,
            "tolerance_mm": corner.tolerance,
            "curve_acceleration_mm_s2": _at_most(corner.tolerance, found.tool.curve),
            "stop_corner_acceleration_mm_s2": _at_most(corner.tolerance, found.tool.stop),
            "stop_corner_half_dwell_acceleration_mm_s2": _at_most(
                corner.tolerance, found.tool.stop_half_dwell
            ),
            "corner_speed_mm_s": _at_most(corner.tolerance, found.tool.corner_at_speed),
        },
    }
    if sensitivity:
        result["sensitivity"] = {
            "frequency_ratio": RATIOS.tolist(),
            "damping_ratio": list(DAMPING_RATIOS),
            "residual_vibration": [
                vibration(shaper, mode.omega * RATIOS, np.array(DAMPING_RATIOS)[:, None]).tolist()
                for mode in design.modes
            ],
        }
    return result


def _at_most(tolerance: float, ratio: float) -> float | None:
    """What an axis may do so that the tool keeps a tolerance; None: anything."""
    return tolerance / abs(ratio) if abs(ratio) > NOTHING * tolerance else None


# how an option is said, where its name and value alone are not how one says it
SAID: Mapping[str, str] = {
    "positive": "positive", "of": "of {}", "duration_periods": "{} periods", "duration_s": "{} s",
    "max_amplitude": "|A| ≤ {}", "frequency_uncertainty": "±{}",
}  # fmt: skip


def title(name: str, options: Mapping[str, object]) -> str:
    """The shaper's name with its options: ``sd 0.8 periods``; `options` by their keys."""
    words = [SAID.get(key, key + " {}").format(_word(value)) for key, value in options.items()]
    return ", ".join([" ".join([name, *words[:1]]), *words[1:]])


def _word(value: object) -> str:
    if isinstance(value, list):
        words = [_word(one) for one in cast("list[object]", value)]
        return " ".join(words[:1] if len(set(words)) == 1 else words)
    return f"{value:g}" if isinstance(value, float) else str(value)


def design_text(design: Design, options: Mapping[str, object], corner: Corner) -> str:
    """One design as a person reads it."""
    shaper, found = design.shaper, design.assessment
    band = found.insensitivity
    modes = ", ".join(f"{m.natural_frequency:g} Hz (damping {m.damping_ratio:g})" for m in design.modes)
    where = f"{design.axis}: " if design.axis else ""
    impulses = [
        f"  {1e3 * t:10.4f} ms   {a:+.6f}"
        for t, a in zip(shaper.times.tolist(), shaper.amplitudes.tolist(), strict=True)
    ]
    high = "∞" if band.high is None else f"{band.high:.4f}"
    factor = found.contour_factor
    curve = "none: these modes do not bend" if factor is None else f"{factor:+.4f}"
    acceleration = found.corner_acceleration(corner.tolerance)
    with_stop = "any acceleration" if acceleration is None else f"{acceleration:.4g} mm/s²"
    cut = 1e3 * found.corner_smoothing(corner.speed)
    return "\n".join(
        [
            one_line(f"{where}{title(design.name, options)} for {modes}"),
            *impulses,
            f"  duration {1e3 * shaper.duration:.3f} ms, delay {1e3 * shaper.delay:.3f} ms",
            f"  vibration left at the design point {100.0 * max(found.residual_vibration):.2g} %",
            *(_error_text(error, design, k) for k, error in enumerate(found.model_error)),
            f"  at most {100.0 * band.tolerance:.3g} % for {band.low:.4f} to {high} of the frequency",
            f"  a step asks up to {shaper.max_running_sum:.4f} times, "
            f"any other motion up to {shaper.sum_abs_amplitude:.4f} times the unshaped command",
            f"  a corner at {corner.speed:g} mm/s is cut by {cut:.3g} µm; "
            f"one with a stop keeps to {1e3 * corner.tolerance:g} µm at {with_stop}",
            f"  curve factor {curve} (tool error on a curve, of the unshaped one)",
            *_tool_text(design, corner.tolerance),
        ]
    )


def _tool_text(design: Design, tolerance: float) -> list[str]:
    """What the axes may do so that the tool itself keeps the tolerance."""
    if design.assessment.contour_factor is None:
        return []
    tool = design.assessment.tool
    ratios = (tool.curve, tool.stop, tool.stop_half_dwell)
    curve, stop, half = (_told(_at_most(tolerance, ratio), "mm/s²") for ratio in ratios)
    speed = _told(_at_most(tolerance, tool.corner_at_speed), "mm/s")
    pause = 500.0 * design.shaper.duration
    return [
        f"  the tool itself keeps to {1e3 * tolerance:g} µm on a curve at {curve}, at a corner with a stop",
        f"  at {stop}, with a pause of {pause:.3g} ms there at {half}, and without a stop at {speed}",
    ]


def _told(value: float | None, unit: str) -> str:
    if value is None:
        return f"any {'speed' if unit == 'mm/s' else 'acceleration'}"
    rounded = float(f"{value:.3g}")
    return f"{rounded:.0f} {unit}" if 1000.0 <= rounded < 1e7 else f"{rounded:g} {unit}"


def _error_text(error: ModelError, design: Design, row: int) -> str:
    frequency = design.modes[row].natural_frequency
    damping = f", damping {error.damping:.0%}" if error.damping else ""
    assumed = " (assumed)" if error.assumed else ""
    return (
        f"  with {frequency:g} Hz up to {error.frequency:.0%}{damping} off{assumed}, "
        f"{100.0 * error.residual_vibration:.3g} % is left at most"
    )
