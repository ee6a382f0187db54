"""Paper 002, sections 2-4: durations, shapers (eqs 14-22), their robustness (Fig. 5) and steps (Fig. 6)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Final

import numpy as np

from cnc_shape.experiments.experiment import Row, Table
from cnc_shape.experiments.specified_duration.equations import DAMPED, Design
from cnc_shape.experiments.specified_duration.grid import Found, search
from cnc_shape.shapers import Shaper, zv
from cnc_shape.shapers.analysis import residual_vibration
from cnc_shape.shapers.insensitivity import insensitivity
from cnc_shape.shapers.measures import step_response
from cnc_shape.shapers.sd_family import impulse_count

EXACT: Final = 1e-9  # what is exact on paper, to rounding
DIGITS: Final = 5e-6  # half the last digit that is shown of a number that was not published
LOST: Final = "printed as an image, not in the text at hand"
AT_REST: Final = 1e-9  # of a unit step
AFTER: Final = 5.0  # s, how long a step is watched

FIGURE_5: Final = (17, 18, 15, 16)  # in the paper's order of robustness
IMPULSES: Final = ((0.4, 3), (0.8, 3), (1.3, 4), (1.8, 5))  # eq 4: a duration of each of its ranges
DERIVATIVES: Final = (("ZV", 0.5), ("ZVD", 1.0), ("ZVD2", 1.5), ("ZVD3", 2.0))  # periods, section 2


def durations(found: Mapping[int, Design]) -> Table:
    """Equations 3 and 4, and the durations of known shapers that section 2 tells."""

    def periods(number: int, published: float, tolerance: float) -> Row:
        design = found[number]
        ours = design.shaper.duration / design.mode.damped_period
        note = "last impulse of our shaper over the damped period"
        return Row(f"T_N of {design.equation.name}", "-", published, ours, tolerance, note)

    def known(name: str, published: float, derivatives: int) -> Row:
        ours = zv(DAMPED, derivatives=derivatives).duration / DAMPED.damped_period
        return Row(f"T_N of {name}", "-", published, ours, EXACT, "exact for every damping")

    def count(periods: float, published: int) -> Row:
        note = "how many impulses the family of our design has at this duration"
        return Row(f"impulses for T_N = {periods}", "-", published, impulse_count(periods), 0.0, note)

    rows = (
        periods(14, 0.8, 0.05), periods(15, 0.796, 5e-4), periods(16, 1.293, 5e-4), periods(17, 0.398, 5e-4),
        *(known(name, value, k) for k, (name, value) in enumerate(DERIVATIVES)),
        *(count(value, number) for value, number in IMPULSES),
    )  # fmt: skip
    return Table("Section 2, eqs (3) and (4): durations and numbers of impulses", rows)


def equation_table(design: Design) -> Table:
    """A shaper: the paper's search and ours, impulse by impulse."""
    equation, shaper = design.equation, design.shaper
    rows = list(_impulses("", shaper, "largest I_0.05 over the whole family; " + LOST))
    rows.append(_condition(design))
    width = insensitivity(shaper, [design.mode]).width
    assert width is not None
    rows.append(Row("I_0.05", "-", None, width, DIGITS, "width of the band with V ≤ 0.05, over ω/ω_model"))
    if equation.periods is not None:
        stepped = search(equation)
        note = f"the paper's own search, A_1 in steps of 0.01, {stepped.offered} candidates; {LOST}"
        rows += _impulses("as searched, ", stepped.shaper, note)
        rows.append(_grid_loss(width, stepped))
    title = f"{equation.place}: {equation.name}"
    return Table(title, tuple(rows), equation.note)


def _impulses(prefix: str, shaper: Shaper, note: str) -> Iterator[Row]:
    pairs = zip(shaper.times.tolist(), shaper.amplitudes.tolist(), strict=True)
    for k, (time, amplitude) in enumerate(pairs, start=1):
        if k > 1:
            yield Row(f"{prefix}t_{k}", "s", None, time, DIGITS, note)
        yield Row(f"{prefix}A_{k}", "-", None, amplitude, DIGITS, note)


def _condition(design: Design) -> Row:
    left = float(residual_vibration(design.shaper, design.mode))
    return Row("V at the mode", "-", 0.0, left, EXACT, "demanded by eqs 5, 9 and 11; V of eq 7")


def _grid_loss(width: float, stepped: Found) -> Row:
    loss = 100.0 * (1.0 - stepped.width / width)
    return Row(
        "I_0.05 lost by the steps of 0.01", "%", None, loss, 5e-4,
        "our continuous optimum against the paper's search",
    )  # fmt: skip


def stepping(found: Mapping[int, Design]) -> Table:
    """What stepping A_2 instead of A_1 would give for eq 14."""
    design = found[14]
    first, second = search(design.equation, 0), search(design.equation, 1)
    best = insensitivity(design.shaper, [design.mode]).width
    assert best is not None
    counted = "candidates whose other impulses exist and are positive"
    rows = [
        Row("I_0.05, continuous", "-", None, best, DIGITS, "sd of this package"),
        Row("I_0.05, A_1 stepped", "-", None, first.width, DIGITS, "as the text says below eq 5"),
        Row("I_0.05, A_2 stepped", "-", None, second.width, DIGITS, "as the text says below eq 6"),
        Row("A_1 stepped, candidates", "-", None, first.offered, 0.5, counted),
        Row("A_2 stepped, candidates", "-", None, second.offered, 0.5, counted),
        *_impulses("A_2 stepped, ", second.shaper, "one of two mirrored shapers; " + LOST),
    ]
    text = (
        "The paper is not of one mind about its search: below eq 5 it steps A_1, below eq 6 A_2, and once "
        "speaks of a given A_3. At 0.8 periods A_2 only exists from 0.4472 to 0.5, so that steps of 0.01 "
        "leave five values of it and miss the best shaper; stepping A_1 hardly does. For damped modes the "
        "paper calls for a numerical solution; in the impulse vectors of eq 1 three impulses have a closed "
        "form for every damping."
    )
    return Table("Section 2, eqs (5) and (6): which amplitude is stepped", tuple(rows), text)


def robustness(found: Mapping[int, Design]) -> Table:
    """Figure 5: how far the frequency may be off."""
    widths = {number: _width(found[number]) for number in (*FIGURE_5, 19)}
    ordered = sum(widths[a] < widths[b] for a, b in pairwise(FIGURE_5))
    rows = [
        Row(f"I_0.05 of {found[n].equation.name}", "-", None, width, DIGITS, "V of eq 7, eq " + str(n))
        for n, width in widths.items()
    ]
    rows.append(
        Row(
            "steps in the order SD 0.4 s < ZV < SD 0.8 s < SD 1.3 s", "-", 3.0, ordered, 0.0,
            "said in section 4: how many of the three comparisons of I_0.05 come out so",
        )
    )  # fmt: skip
    text = (
        "V of eq 7 has the factor e^(-ζωt_N): the vibration left over that of one impulse at the end. That "
        "favours longer shapers where the mode is damped. The axis is the actual over the modelled frequency."
    )
    return Table("Section 4, Fig. 5: robustness", tuple(rows), text)


def _width(design: Design) -> float:
    width = insensitivity(design.shaper, [design.mode]).width
    assert width is not None
    return width


def steps(found: Mapping[int, Design]) -> Table:
    """Figure 6: unit steps of the damped mode, at rest from the duration on."""
    rows = list[Row]()
    for number, published in ((17, 0.4), (15, 0.8), (16, 1.3), (18, None), (19, None)):
        design = found[number]
        time = np.linspace(0.0, design.shaper.duration, 40_001)
        off = np.abs(step_response(design.shaper, [design.mode], time) - 1.0)
        rest = float(time[np.flatnonzero(off > AT_REST)[-1]])
        later = design.shaper.duration + np.linspace(0.0, AFTER, 2001)
        left = float(np.abs(step_response(design.shaper, [design.mode], later) - 1.0).max())
        note = "when the step response of our shaper comes to within 1e-9 of 1, in closed form"
        tolerance = DIGITS * 10.0 if published is None else 0.05
        name = design.equation.name
        rows += [
            Row(f"{name}, at rest from", "s", published, rest, tolerance, note),
            Row(f"{name}, left after it", "-", 0.0, left, EXACT, "section 4: gone exactly then"),
        ]
    return Table("Section 4, Fig. 6: unit steps", tuple(rows))
