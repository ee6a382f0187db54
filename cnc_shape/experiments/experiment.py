"""Experiment: what a paper published, what we get, and whether they agree."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Status(Enum):
    """Verdict on one number."""

    REPRODUCED = "reproduced"
    DIFFERS = "differs"
    NOT_PUBLISHED = "not published"


@dataclass(frozen=True, slots=True)
class Row:
    """One number of a paper beside ours."""

    quantity: str  # what it is: "A1", "ZV, residual"; distinct within its table, whose title tells the place
    unit: str  # "-", "s", "mm", "%", ...
    published: float | None  # as printed; None: the paper gives no number
    ours: float
    tolerance: float  # absolute, in the unit: half the last printed digit unless the note says otherwise
    note: str  # how it was computed; where it differs, why

    @property
    def status(self) -> Status:
        """Whether ours lies within the tolerance of what was published."""
        if self.published is None:
            return Status.NOT_PUBLISHED
        within = abs(self.ours - self.published) <= self.tolerance
        return Status.REPRODUCED if within else Status.DIFFERS


@dataclass(frozen=True, slots=True)
class Table:
    """Rows that belong together: one table, one equation, one figure of the paper."""

    title: str
    rows: tuple[Row, ...]
    text: str = ""  # what a reader of the page needs to know: model, parameters, the paper's errors


Drawing: TypeAlias = "Callable[[], Figure]"


@dataclass(frozen=True, slots=True)
class Experiment:
    """A paper: how its tables are computed and its figures drawn."""

    id: str  # "000"
    title: str
    reference: str  # authors, year, where it appeared
    tables: Callable[[], Sequence[Table]]
    figures: Mapping[str, Drawing]  # file stem: how to draw it, in the page's order; captions are titles
