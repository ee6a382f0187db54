"""Pages: a paper's tables and figures as Markdown, in a folder of their own."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from cnc_shape.errors import OptionError
from cnc_shape.experiments.experiment import Row, Table
from cnc_shape.experiments.verdicts import (
    Result,
    ours_text,
    published_text,
    results_json,
    summary_words,
    tolerance_text,
)
from cnc_shape.report.style import Format, render
from cnc_shape.writers.publish import check_folder, publish_folder

MARKER: Final = "reproduce.json"
FORMATS: Final[dict[str, Format]] = {"svg": "svg", "png": "png", "pdf": "pdf"}
HEADINGS: Final = ("quantity", "unit", "published", "ours", "±", "verdict", "note")


def figure_formats(text: str) -> tuple[Format, ...]:
    """The formats that a user names, such as ``svg,png``.

    Raises
    ------
    OptionError
        None, or one that figures do not come in.
    """
    names = [name.strip() for name in text.split(",") if name.strip()]
    for name in names:
        if name not in FORMATS:
            raise OptionError(f"figures come as {', '.join(FORMATS)}, not {name!r}")
    if not names:
        raise OptionError("no format of figures is named", hint="svg,png is both")
    return tuple(FORMATS[name] for name in dict.fromkeys(names))


def check_pages(folder: str, *, force: bool) -> None:
    """Refuse a folder that `write_pages` would refuse, before the work is done."""
    check_folder(Path(folder), MARKER, force=force)


def write_pages(
    results: Sequence[Result],
    folder: str,
    formats: Sequence[Format],
    advance: Callable[[float], None],
    *,
    force: bool,
) -> None:
    """Write a page for every paper, its figures beside it and all rows as JSON, whole or not at all.

    Parameters
    ----------
    results
        The papers.
    folder
        To make, in a folder that exists.
    formats
        Of the figures; the page shows the first.
    advance
        Told 1 for every figure.
    force
        Replace an older folder of this kind.

    Raises
    ------
    OutputError
        The folder exists and may not be replaced, or cannot be written.
    """
    content: dict[str, bytes] = {
        MARKER: (json.dumps(results_json(results), indent=2, allow_nan=False) + "\n").encode()
    }
    for result in results:
        content[f"{result.experiment.id}.md"] = page(result, formats[0]).encode()
        for name, draw in result.experiment.figures.items():
            figure = draw()
            for kind in formats:
                content[_figure_file(result, name, kind)] = render(figure, kind)
            advance(1.0)

    def build(target: Path) -> None:
        for name, data in content.items():
            (target / name).write_bytes(data)

    publish_folder(folder, build, marker=MARKER, force=force)


def _figure_file(result: Result, name: str, kind: Format) -> str:
    return f"{result.experiment.id}-{name}.{kind}"


def page(result: Result, kind: Format = "svg") -> str:
    """A paper's page: every table with its notes, then the figures."""
    experiment = result.experiment
    number = experiment.id
    parts = [
        f"# Paper {number}: {experiment.title}",
        experiment.reference,
        f"Made by `cnc-shape reproduce {number} -o DIR`; {summary_words(result)}.",
        *(_section(table) for table in result.tables),
    ]
    if experiment.figures:
        parts.append("## Figures")
        parts += [f"![{name}]({_figure_file(result, name, kind)})" for name in experiment.figures]
    return "\n\n".join(parts) + "\n"


def _section(table: Table) -> str:
    lines = [_line(HEADINGS), _line(("---", "---", "---:", "---:", "---:", "---", "---"))]
    lines += [_line(_cells(row)) for row in table.rows]
    return "\n\n".join([f"## {table.title}", *([table.text] if table.text else []), "\n".join(lines)])


def _cells(row: Row) -> tuple[str, ...]:
    verdict = row.status.value
    return (
        row.quantity, row.unit, published_text(row), ours_text(row), tolerance_text(row), verdict, row.note
    )  # fmt: skip


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
