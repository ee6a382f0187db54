"""Section 5 as a table: what was measured on the container, and what the model says."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Final

from cnc_shape.experiments.experiment import Row, Table
from cnc_shape.experiments.specified_duration.container import (
    MEASURED_UNSHAPED,
    frequency_error,
    motor_gain,
    run,
)
from cnc_shape.experiments.specified_duration.equations import Design
from cnc_shape.shapers import NONE

MEASURED: Final = {20: 1.32, 21: 1.12, 22: 0.86}  # mm, swing that is left, section 5
HUNDREDTH: Final = 0.005  # half of the last digit
REMOVED: Final = 99.0  # %, of all three, section 5


def transport_table(found: Mapping[int, Design]) -> Table:
    """Figure 8: steps of 10 cm."""
    gain = motor_gain()
    rows = [
        Row(
            "unshaped, swing", "mm", MEASURED_UNSHAPED, run(NONE).amplitude, HUNDREDTH,
            "simulated without a motor: the whole step becomes swing. The measured trolley does not step, "
            "its motor follows late, and the paper has no model of it",
        ),
        Row(
            "position gain that explains the unshaped swing", "1/s", None, gain, HUNDREDTH,
            "of a position loop with a drive of 10 ms, fitted to the 96.94 mm: they are no test of it",
        ),
    ]  # fmt: skip
    for number, measured in MEASURED.items():
        rows += _shaped(found[number], measured, gain)
    durations = [found[number].shaper.duration for number in (20, 22, 21)]
    ordered = sum(a < b for a, b in pairwise(durations))
    rows.append(
        Row(
            "durations in the order SD 0.35 < ZV < SD 0.8", "-", 2.0, ordered, 0.0,
            "how many of the two comparisons come out so",
        )
    )  # fmt: skip
    text = (
        "A pendulum of 3.67 rad/s and damping 0.0015 under a trolley that steps by 100 mm. The paper tells "
        "neither the motor nor A_max. On a perfect model every shaper removes all of the swing; what was "
        "measured, about 1 mm, needs a frequency that is off by 0.6 to 1.5 %, and by another amount for each "
        "shaper: so part of it is something else, such as the motor and the sensor."
    )
    return Table("Section 5, Fig. 8: container transport", tuple(rows), text)


def _shaped(design: Design, measured: float, gain: float) -> list[Row]:
    shaper, name = design.shaper, design.equation.name.removesuffix(", container")
    ideal, moved = run(shaper), run(shaper, gain)
    share = measured / MEASURED_UNSHAPED
    return [
        Row(
            f"{name}, swing", "mm", measured, ideal.amplitude, HUNDREDTH,
            "simulated with the modelled frequency, where nothing is left; the apparatus is not its model",
        ),
        Row(
            f"{name}, swing with a motor", "mm", None, moved.amplitude, HUNDREDTH,
            "a linear motor delays the step and adds no swing",
        ),
        Row(
            f"{name}, frequency error that explains the swing", "%", None,
            100.0 * frequency_error(shaper, share), HUNDREDTH, "actual frequency above the model; V of eq 7",
        ),
        Row(
            f"{name}, swing removed, from the measured amplitudes", "%", REMOVED,
            100.0 * (1.0 - share), 0.5, "arithmetic of the paper's own numbers",
        ),
        Row(
            f"{name}, within 0.1 mm from", "s", None, ideal.calm_at, HUNDREDTH,
            f"simulated without a motor; the shaper is {shaper.duration:.3f} s long",
        ),
        Row(
            f"{name}, within 0.1 mm with a motor from", "s", None, moved.calm_at, HUNDREDTH,
            "section 5: the motor is why the swing ends later than the shaper",
        ),
    ]  # fmt: skip
