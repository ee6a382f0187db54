"""``cnc-shape doctor``: what this installation has, what it lacks, and what to do about it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from cnc_shape.cli.options import Json, Quiet

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cnc_shape.diagnosis import Check


def doctor(
    warm: Annotated[
        bool, typer.Option("--warm", help="Compile every kernel ahead, for this processor.")
    ] = False,
    quiet: Quiet = False,
    json: Json = False,
) -> int:
    """Look at versions, cores, write access, kernels and browser; say what to do about what is missing."""
    from cnc_shape.cli.errors import DONE, GATE_FAILED
    from cnc_shape.cli.output import print_json, print_text
    from cnc_shape.diagnosis import Status, diagnose, interpreted
    from cnc_shape.errors import OptionError

    if warm and interpreted():
        raise OptionError("nothing to compile: NUMBA_DISABLE_JIT is set", hint="unset NUMBA_DISABLE_JIT")
    checks = diagnose()
    essential = all(check.status is not Status.MISSING for check in checks)
    seconds = None
    if warm and essential:
        seconds = _warm(quiet=quiet or json)
        checks = diagnose()
    if json:
        found = [
            {"name": check.name, "status": check.status.value, "value": check.value, "hint": check.hint}
            for check in checks
        ]
        print_json("doctor", {"checks": found, "warming_s": seconds})
    else:
        print_text(_text(checks, seconds))
    return DONE if essential else GATE_FAILED


def _warm(*, quiet: bool) -> float:
    """Compile every kernel; returns how long it took, s."""
    from time import perf_counter

    from cnc_shape.cli.progress import progress
    from cnc_shape.kernels import compiled_count, kernel_count
    from cnc_shape.warming import warm

    begun = perf_counter()
    before = compiled_count()
    with progress("compiling kernels", kernel_count() - before, quiet=quiet) as advance:
        for compiled in warm():
            advance(compiled - before)
            before = compiled
    return perf_counter() - begun


def _text(checks: Sequence[Check], seconds: float | None) -> str:
    from cnc_shape.diagnosis import Status
    from cnc_shape.report.text import one_line

    marks = {Status.OK: "ok", Status.WARNING: "warning", Status.MISSING: "MISSING"}
    width = max(len(check.name) for check in checks)
    lines: list[str] = []
    for check in checks:
        lines.append(one_line(f"{marks[check.status]:<8} {check.name:<{width}}  {check.value}"))
        if check.hint is not None:
            lines.append(one_line(f"{'':<8} {'':<{width}}  -> {check.hint}"))
    if seconds is not None:
        lines.append(f"kernels ready after {seconds:.1f} s")
    return "\n".join(lines)
