"""Rows of the table: what each is compared with, which is best, and how their names read.

Only like is compared with like: disturbed rows with the first disturbed row, the others with the first.
"""

from __future__ import annotations

from cnc_shape.pipeline import CaseSummary, Summary
from cnc_shape.report.text import one_line

UNDER = "  + "  # before what a row adds to the one above it


def compared_with(summary: Summary, case: CaseSummary) -> CaseSummary:
    """The row that `case` is compared with: the first that is disturbed as it is."""
    return next(other for other in summary.cases if other.disturbed == case.disturbed)


def is_mixed(summary: Summary) -> bool:
    """Whether some rows are disturbed and some are not."""
    return len({case.disturbed for case in summary.cases}) > 1


def best_case(summary: Summary) -> CaseSummary:
    """The case with the smallest RMS contour error of the tool, among the disturbed ones if there are any."""
    hardest = any(case.disturbed for case in summary.cases)
    rivals = [case for case in summary.cases if case.disturbed == hardest]
    return min(rivals, key=lambda case: case.tool.rms)


def row_names(summary: Summary) -> list[str]:
    """Names of the rows; a disturbed row under its undisturbed self is just ``+ disturbed``."""
    names = [one_line(case.name) for case in summary.cases]
    for k in range(len(names) - 1, 0, -1):
        above = names[k - 1] + "+"
        if summary.cases[k].disturbed and names[k].startswith(above):
            names[k] = UNDER + names[k].removeprefix(above)
    return names


def folded(name: str) -> str:
    """A row's name with each of its terms on a line of its own."""
    return name if name.startswith(UNDER) else name.replace("+", "\n+ ")
