"""A run in words: the verdict in one sentence, the price of shaping, the worst places."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray
from cnc_shape.pipeline import CaseSummary, Run, Summary
from cnc_shape.recording import Samples, Signals
from cnc_shape.report.rows import best_case, compared_with, is_mixed
from cnc_shape.report.table import micrometres, worst_linear

WORST_PLACES = 10
SATURATED = 0.01  # share of the time at the torque limit from which on it is worth a warning
APART = 0.02  # share of the motion's time that two worst places lie apart at least


def verdict(summary: Summary) -> str:
    """What the run says, in one sentence with its numbers."""
    best = best_case(summary)
    first = compared_with(summary, best)
    rivals = [case for case in summary.cases if case.disturbed == best.disturbed]
    if is_mixed(summary):
        calm = next(case for case in summary.cases if not case.disturbed)
        worst = f"{_capital(calm.name)}, the tool leaves the programmed path by {_reach(calm)}; "
        worst += f"{first.name}, by {_reach(first)}"
    else:
        worst = f"{_capital(first.name)}, the tool leaves the programmed path by {_reach(first)}"
    if len(rivals) == 1:
        return f"{worst}; the program takes {first.cycle_time:.3f} s."
    if best is first:
        other = "disturbed case" if is_mixed(summary) else "case"
        return f"{worst}, and no other {other} does better; the program takes {first.cycle_time:.3f} s."
    return (
        f"{worst}; {best.name}, by {_reach(best)}, "
        f"{100.0 * (1.0 - best.tool.rms / first.tool.rms):.0f} % less, "
        f"{_time_price(best.cycle_time - first.cycle_time, first.cycle_time)}."
    )


def _reach(case: CaseSummary) -> str:
    return (
        f"up to {micrometres(case.tool.max)} µm{_at(case.tool.line)} and {micrometres(case.tool.rms)} µm RMS"
    )


def saturations(summary: Summary) -> list[str]:
    """A warning for every case in which a motor is at its torque limit for more than 1 % of the time."""
    found: list[str] = []
    for case in summary.cases:
        shares = {motor.joint: motor.saturated_share for motor in case.motors}
        told = [f"motor {j.upper()} for {100.0 * s:.3g} %" for j, s in shares.items() if s > SATURATED]
        if told:
            found.append(
                f"{case.name}: torque limit reached by {', '.join(told)} of the time; the loop is open then"
            )
    return found


def price_of_shaping(summary: Summary) -> str | None:
    """What shaping pays in rounded corners, where a command is longer than the first row's."""
    plain = summary.cases[0]
    alike = [case for case in summary.cases if case.disturbed == plain.disturbed]
    shaped = next((case for case in alike if case.cycle_time > plain.cycle_time), None)
    if shaped is None:
        return None
    lateness = (shaped.cycle_time - plain.cycle_time) * 1e3
    before, after = worst_linear(plain.residual_vibration), worst_linear(shaped.residual_vibration)
    return (
        "A shaper mixes what lies before a corner with what lies behind it, so that the command itself "
        f"rounds corners and flattens curves: {shaped.name}, it leaves the programmed path by up to "
        f"{micrometres(shaped.command.max)} µm{_at(shaped.command.line)} and "
        f"{micrometres(shaped.command.rms)} µm RMS, against {micrometres(plain.command.max)} and "
        f"{micrometres(plain.command.rms)} µm {plain.name}, and ends {lateness:.1f} ms later. "
        "That buys calm: the vibration left after the end goes from "
        f"{micrometres(before)} to {micrometres(after)} µm."
    )


@dataclass(frozen=True, slots=True)
class Place:
    """A place where a case's tool is far from the path."""

    line: int
    error: float  # mm, of the tool
    drive_error: float  # mm, of the drives at the same time
    first_error: float | None  # mm, the largest on this line of the case compared with; None: no sample there
    exact: bool  # whether every sample of that case was there to find it
    time: float  # s
    foot: FloatArray  # (3,) mm, on the path


def worst_places(run: Run, case: str) -> list[Place]:
    """The worst places of a case, worst first, some time apart."""
    signals = run.signal(case)
    summary = next(summary for summary in run.summary.cases if summary.name == case)
    first = run.signal(compared_with(run.summary, summary).name)
    apart = APART * float(np.ptp(signals.time)) if signals.time.size else 0.0
    left = signals.tool_error.copy()
    rows: list[int] = []
    while len(rows) < WORST_PLACES and left.size and left.max() > 0.0:
        row = int(left.argmax())
        rows.append(row)
        left[np.abs(signals.time - signals.time[row]) <= apart] = 0.0
    by_line = _worst_by_line(first.source, signals.line[rows])
    exact = first.factor == 1 or first.samples is not None
    return [
        Place(
            line=int(signals.line[row]),
            error=float(signals.tool_error[row]),
            drive_error=float(signals.drive_error[row]),
            first_error=by_line.get(int(signals.line[row])),
            exact=exact,
            time=float(signals.time[row]),
            foot=signals.foot[row],
        )
        for row in rows
    ]


def _worst_by_line(source: Signals | Samples, lines: IntArray) -> dict[int, float]:
    """Largest error of the tool on each of `lines` that has samples."""
    worst: dict[int, float] = {}
    for line, error in zip(source.pieces("line"), source.pieces("tool_error"), strict=True):
        wanted = np.isin(line, lines)
        for number, value in zip(line[wanted].tolist(), error[wanted].tolist(), strict=True):
            worst[number] = max(worst.get(number, 0.0), value)
    return worst


def _at(line: int | None) -> str:
    return "" if line is None else f" (line {line})"


def _time_price(later: float, cycle_time: float) -> str:
    if later < 5e-5:
        return "in the same time" if later > -5e-5 else f"{-later * 1e3:.1f} ms sooner"
    return f"for {later * 1e3:.1f} ms ({100.0 * later / cycle_time:.2g} %) more"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
