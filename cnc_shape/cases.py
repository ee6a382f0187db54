"""Cases: which rows a machine's table has, and what each stands for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from cnc_shape.config.setup import CASE_NAMES, Setup, Shaping
from cnc_shape.controllers import Control
from cnc_shape.errors import OptionError
from cnc_shape.pipeline import Case
from cnc_shape.timing import PLAIN, Slowdown, Timing

KINDS = (Shaping.CONTOUR, Shaping.AXIS, Shaping.PATH)  # of shaping, in the order in which they are offered


def default_cases(setup: Setup, slowdown: Slowdown | None = None) -> tuple[Case, ...]:
    """Rows of a machine's table: unshaped, shaped, then one row more per configured term."""
    coupled = setup.control.cross_coupling is not None
    if not setup.acting_shapers:
        names = ["independent", *(["cross_coupled"] if coupled else [])]
    else:
        names = ["unshaped", "shaped", *(["shaped+cross_coupled"] if coupled else [])]
    return pick_cases(setup, names, slowdown)


def pick_cases(setup: Setup, names: Sequence[str], slowdown: Slowdown | None = None) -> tuple[Case, ...]:
    """Rows that the user names, in his order.

    Where the machine's own shaping acts, the motion is as gentle as `slowdown` says.

    Raises
    ------
    OptionError
        A name that this machine has no case for.
    """
    known = _known(setup)
    for name in names:
        if name not in known:
            raise OptionError(f"this machine has no case called {name!r}", hint="it has " + ", ".join(known))
    return tuple(_case(setup, name, *known[name], slowdown) for name in names)


def timings(cases: Sequence[Case]) -> tuple[Timing, ...]:
    """The distinct motions that cases run on, the unshaped one first."""
    return tuple(dict.fromkeys([PLAIN, *(case.timing for case in cases)]))


def _known(setup: Setup) -> dict[str, tuple[Shaping, Control]]:
    """What every name stands for."""
    alone = replace(setup.control, cross_coupling=None)
    shaping = setup.planning.shaping
    shaped = bool(setup.acting_shapers)
    known = {"unshaped" if shaped else "independent": (Shaping.NONE, alone)}
    if shaped:
        known["shaped"] = (shaping, alone)
    if setup.control.cross_coupling is not None:
        known["shaped+cross_coupled" if shaped else "cross_coupled"] = (shaping, setup.control)
    if setup.shapers:
        known |= {CASE_NAMES[kind]: (kind, alone) for kind in KINDS}
        known["shaped-feedforward"] = (shaping, replace(alone, feedforward=None))
    return known


def _case(setup: Setup, name: str, shaping: Shaping, control: Control, slowdown: Slowdown | None) -> Case:
    timing = setup.timing(shaping)
    if shaping is setup.planning.shaping is not Shaping.NONE:
        timing = replace(timing, slowdown=slowdown)
    return Case(name, setup.command_shaping(shaping), control, timing)
