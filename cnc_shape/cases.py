"""Cases: which rows a machine's table has, and what each stands for.

A name says how the command is shaped and which terms of the loop answer, ``shaped+cross_coupled``. The
position loop, feedforward, friction and identification belong to every row, a term that the machine lacks to
none, and ``+disturbed`` says that its disturbances act.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import chain, combinations
from typing import Final

from cnc_shape.config.setup import CASE_NAMES, Setup, Shaping
from cnc_shape.controllers import Control
from cnc_shape.controllers.compensation import WATCHING
from cnc_shape.disturbances import UNDISTURBED, Disturbances
from cnc_shape.errors import OptionError
from cnc_shape.pipeline import Case
from cnc_shape.timing import PLAIN, Slowdown, Timing

KINDS = (Shaping.CONTOUR, Shaping.AXIS, Shaping.PATH)  # of shaping, in the order in which they are offered
TERMS: Final = ("cross_coupled", "disturbance_observer", "inertia_compensation")  # of the loop, in this order
DISTURBED: Final = "disturbed"


@dataclass(frozen=True, slots=True)
class _Row:
    """What a name stands for."""

    shaping: Shaping
    control: Control
    disturbances: Disturbances = UNDISTURBED


def default_cases(setup: Setup, slowdown: Slowdown | None = None) -> tuple[Case, ...]:
    """Rows of a machine's table: unshaped, shaped, then one row more per configured term.

    With disturbances each row is followed by the same one under them.
    """
    terms = _terms(setup)
    first = ("unshaped", "shaped") if setup.acting_shapers else ("independent",)
    names = [*first, *(_name(setup, terms[: count + 1]) for count in range(len(terms)))]
    if setup.disturbances:
        names = [name for calm in names for name in (calm, f"{calm}+{DISTURBED}")]
    return pick_cases(setup, names, slowdown)


def pick_cases(setup: Setup, names: Sequence[str], slowdown: Slowdown | None = None) -> tuple[Case, ...]:
    """Rows that the user names, in his order.

    Where the machine's own shaping acts, the motion is as gentle as `slowdown` says.

    Raises
    ------
    OptionError
        A name that this machine has no case for, or one twice.
    """
    known = _known(setup)
    for place, name in enumerate(names):
        if name in names[:place]:
            raise OptionError(f"the case {name!r} is named twice", hint="name every row once")
        if name not in known:
            raise OptionError(f"this machine has no case called {name!r}", hint="it has " + ", ".join(known))
    return tuple(_case(setup, name, known[name], slowdown) for name in names)


def timings(cases: Sequence[Case]) -> tuple[Timing, ...]:
    """The distinct motions that cases run on, the unshaped one first."""
    return tuple(dict.fromkeys([PLAIN, *(case.timing for case in cases)]))


def _terms(setup: Setup) -> tuple[str, ...]:
    """Terms that the machine's loop has."""
    control = setup.control
    parts = (control.cross_coupling, control.disturbance_observer, control.inertia_compensation)
    return tuple(term for term, part in zip(TERMS, parts, strict=True) if part is not None)


def _name(setup: Setup, terms: Sequence[str]) -> str:
    """Name of the row with some terms, at least one, and the machine's own shaping."""
    return "+".join(["shaped", *terms] if setup.acting_shapers else terms)


def _with_terms(control: Control, terms: Iterable[str]) -> Control:
    """Return the loop with some of its terms.

    Compensation and identification need what the observer sees, even where nothing of it is fed forward.
    """
    coupled, observed, compensated = (term in terms for term in TERMS)
    observer = control.disturbance_observer
    if not observed:
        watches = compensated or control.inertia_identification is not None
        observer = replace(observer or WATCHING, feedforward=0.0) if watches else None
    return replace(
        control,
        cross_coupling=control.cross_coupling if coupled else None,
        disturbance_observer=observer,
        inertia_compensation=control.inertia_compensation if compensated else None,
    )


def _known(setup: Setup) -> dict[str, _Row]:
    """What every name stands for."""
    terms = _terms(setup)
    alone = _with_terms(setup.control, ())
    shaping = setup.planning.shaping
    shaped = bool(setup.acting_shapers)
    known = {"unshaped" if shaped else "independent": _Row(Shaping.NONE, alone)}
    if shaped:
        known["shaped"] = _Row(shaping, alone)
    for some in chain.from_iterable(combinations(terms, count + 1) for count in range(len(terms))):
        known[_name(setup, some)] = _Row(shaping, _with_terms(setup.control, some))
    if setup.shapers:
        known |= {CASE_NAMES[kind]: _Row(kind, alone) for kind in KINDS}
        known["shaped-feedforward"] = _Row(shaping, replace(alone, feedforward=None))
    if not setup.disturbances:
        return known
    return {
        name: row
        for calm, quiet in known.items()
        for name, row in (
            (calm, quiet),
            (f"{calm}+{DISTURBED}", replace(quiet, disturbances=setup.disturbances)),
        )
    }


def _case(setup: Setup, name: str, row: _Row, slowdown: Slowdown | None) -> Case:
    timing = setup.timing(row.shaping)
    if row.shaping is setup.planning.shaping is not Shaping.NONE:
        timing = replace(timing, slowdown=slowdown)
    return Case(name, setup.command_shaping(row.shaping), row.control, timing, row.disturbances)
