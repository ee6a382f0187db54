"""What `design` does once it is asked: modes and options to designs, designs to text, JSON and figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from cnc_shape.cli.output import print_json, print_text
from cnc_shape.cli.subjects import Subject
from cnc_shape.config.setup import ShaperChoice
from cnc_shape.config.shaper_options import FUNCTIONS, NONE, as_given, design, key_of, options_of
from cnc_shape.config.strict import suggestion
from cnc_shape.errors import CncShapeError, InfeasibleError, OptionError
from cnc_shape.modes import Mode
from cnc_shape.report.shaper_sheet import Corner, design_json, design_text, title
from cnc_shape.report.style import Format
from cnc_shape.shapers import SINGLE_MODE
from cnc_shape.shapers.comparison import Comparison, Design, compare
from cnc_shape.shapers.insensitivity import DEFAULT_VIBRATION_TOLERANCE
from cnc_shape.shapers.measures import assess

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS: Mapping[str, Format] = {".png": "png", ".svg": "svg", ".pdf": "pdf"}
TOLERANCE = "vibration_tolerance"

Draw = Callable[[Callable[[], "Figure"]], None]  # draws what the inner one makes, where that is wanted


def drawing_at(plot: str | None, *, force: bool) -> Draw:
    """How to draw to the file `plot`, or not at all; refused before anything is designed.

    Raises
    ------
    OptionError
        A suffix that names no format.
    OutputError
        A file that may not be written.
    """
    if plot is None:
        return lambda make: None
    from cnc_shape.writers.publish import check_target, publish

    kind = FORMATS.get(Path(plot).suffix.lower())
    if kind is None:
        raise OptionError(f"cannot draw to {plot}", hint="name it .png, .svg or .pdf")
    check_target(Path(plot), force=force)

    def draw(make: Callable[[], Figure]) -> None:
        from cnc_shape.report.style import render

        publish(plot, render(make(), kind), force=force)

    return draw


def design_one(subjects: Sequence[Subject], name: str, given: Mapping[str, object]) -> list[Design]:
    """Design the shaper called `name` for every subject.

    Raises
    ------
    OptionError
        An unknown shaper, options that are not its own or outside their range, too many modes.
    InfeasibleError
        No shaper keeps to the bounds that were given.
    """
    choice = _choice(name, given)
    tolerance = tolerance_of(given)
    return [_designed(subject, choice, tolerance) for subject in subjects]


def show(designs: Sequence[Design], corner: Corner, *, json: bool, sensitivity: bool) -> None:
    """Print designs, as JSON or as text."""
    if json:
        print_json("design", designs_json(designs, corner, sensitivity=sensitivity))
        return
    for found in designs:
        print_text(design_text(found, found.options, corner))


def designs_json(designs: Sequence[Design], corner: Corner, *, sensitivity: bool) -> dict[str, Any]:
    """The result of `design` for one shaper; the designs' options are those given, by their keys."""
    return {"designs": [design_json(one, one.options, corner, sensitivity=sensitivity) for one in designs]}


def design_figure(designs: Sequence[Design]) -> Figure:
    """Draw the designs."""
    from cnc_shape.report import design_figures

    return design_figures.design_figure(designs)


def _choice(name: str, given: Mapping[str, object]) -> ShaperChoice:
    known = [word for word in FUNCTIONS if word != NONE]
    if name not in known:
        hint = suggestion(name, known)
        raise OptionError(f"unknown shaper {name!r}", hint=hint)
    options = options_of(name)
    values = dict[str, object]()
    for key, value in given.items():
        if key in options:
            values[key] = _fitting(name, key, options[key].file_type, value)
        elif key != TOLERANCE:  # which also is what every band is told for
            owners = [word for word in known if key in options_of(word)]
            raise OptionError(
                f"{_option(key)} belongs to {', '.join(owners)}, not to {name}", hint="leave it out"
            )
    return ShaperChoice(name, values)


def _fitting(name: str, key: str, wanted: Any, value: object) -> object:
    """The value as the shaper takes it: one word of several, one number of a list of one."""
    words = getattr(wanted, "__args__", ())
    if isinstance(value, str) and value not in words:
        raise OptionError(
            f"{_option(key)} is {' or '.join(words)}, not {value!r}", hint=f"{name} knows no other"
        )
    if isinstance(value, list) and wanted is int:
        numbers = cast("list[int]", value)
        if len(numbers) > 1:
            raise OptionError(
                f"{name} takes {_option(key)} once, not {len(numbers)} times", hint="it is for one mode"
            )
        return numbers[0]
    return cast("object", value)


def _option(key: str) -> str:
    return "--" + key.replace("_", "-")


def tolerance_of(given: Mapping[str, object]) -> float:
    """V that every band is told for."""
    value = given.get(TOLERANCE, DEFAULT_VIBRATION_TOLERANCE)
    assert isinstance(value, float)
    return value


def _designed(subject: Subject, choice: ShaperChoice, tolerance: float) -> Design:
    where = f"{subject.axis}: " if subject.axis else ""
    if choice.type in SINGLE_MODE and len(subject.modes) > 1:
        raise OptionError(
            f"{where}{choice.type} is for one mode, not {len(subject.modes)}",
            hint="use cascade, multi_mode or optimal, or give one --frequency-hz",
        )
    try:
        shaper = design(choice, subject.modes)
    except (OptionError, InfeasibleError) as error:
        raise _at_option(error, where) from None
    assessment = assess(shaper, subject.modes, tolerance)
    return Design(subject.axis, choice.type, choice.options, subject.modes, shaper, assessment)


def _at_option(error: CncShapeError, where: str) -> CncShapeError:
    """The error with the option that it is about in front."""
    key = key_of(error.argument)
    option = "" if key is None else f"{_option(key)}: "
    return type(error)(f"{option}{where}{error.reason}", hint=error.hint)


def compare_all(
    subjects: Sequence[Subject],
    given: Mapping[str, object],
    corner: Corner,
    draw: Draw,
    *,
    quiet: bool,
    json: bool,
    sensitivity: bool,
) -> None:
    """Compare all shapers for every subject, and recommend two.

    Raises
    ------
    OptionError
        An option of one shaper.
    """
    from cnc_shape.cli.progress import progress

    refuse_options(given)
    found: dict[tuple[Mode, ...], Comparison] = {}
    distinct = dict.fromkeys(subject.modes for subject in subjects)
    with progress("comparing", float(len(distinct)), quiet=quiet or json) as advance:
        for modes in distinct:
            found[modes] = compare(modes, tolerance_of(given), advance)
    draw(lambda: _pareto_figure(subjects, found))
    if json:
        print_json("design", _comparison_json(subjects, found, corner, sensitivity=sensitivity))
        return
    from rich.console import Console

    from cnc_shape.report.comparison_table import comparison_table, comparison_words

    console = Console()
    for modes, comparison in found.items():
        names = [subject.axis for subject in subjects if subject.modes == modes and subject.axis]
        titles = _titles(comparison)
        console.print(comparison_table(comparison, titles, names, corner, console.width))
        console.print(comparison_words(comparison, titles), soft_wrap=True, markup=False, highlight=False)


def refuse_options(given: Mapping[str, object]) -> None:
    """Refuse options of a shaper where none is named.

    Raises
    ------
    OptionError
        An option of one shaper.
    """
    for key in given:
        if key != TOLERANCE:
            raise OptionError(f"{_option(key)} is an option of a shaper", hint="name the shaper, too")


def _options(found: Design) -> dict[str, object]:
    return as_given(found.name, found.options)


def _titles(comparison: Comparison) -> list[str]:
    return [title(found.name, _options(found)) for found in comparison.designs]


def _pareto_figure(subjects: Sequence[Subject], found: Mapping[tuple[Mode, ...], Comparison]) -> Figure:
    from cnc_shape.report.design_figures import pareto_figure

    names = {
        modes: ", ".join(s.axis.upper() for s in subjects if s.axis and s.modes == modes) for modes in found
    }
    return pareto_figure([(names[modes], found[modes].designs, _titles(found[modes])) for modes in found])


def _comparison_json(
    subjects: Sequence[Subject],
    found: Mapping[tuple[Mode, ...], Comparison],
    corner: Corner,
    *,
    sensitivity: bool,
) -> dict[str, Any]:
    rows, chosen, left_out = list[dict[str, Any]](), dict[str, dict[str, Any]](), list[dict[str, Any]]()
    for subject in subjects:
        comparison = found[subject.modes]
        chosen[subject.axis or ""] = {
            "fastest": len(rows) + comparison.fastest.row,
            "most_robust": len(rows) + comparison.most_robust.row,
            "fastest_reason": comparison.fastest.reason,
            "most_robust_reason": comparison.most_robust.reason,
        }
        for one in comparison.designs:
            named = replace(one, axis=subject.axis)
            rows.append(design_json(named, _options(one), corner, sensitivity=sensitivity))
        left_out += [
            {"axis": subject.axis, "shaper": one.name, "reason": one.reason} for one in comparison.left_out
        ]
    slowest = min(subjects, key=lambda subject: min(mode.natural_frequency for mode in subject.modes))
    result: dict[str, Any] = {
        "designs": rows, "recommended": chosen[slowest.axis or ""], "left_out": left_out
    }  # fmt: skip
    if slowest.axis is not None:
        result["recommended_by_axis"] = chosen
    return result
