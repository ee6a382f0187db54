"""``cnc-shape reproduce``: the papers' numbers and figures beside ours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from cnc_shape.cli.options import Force, Json, Quiet

if TYPE_CHECKING:
    from cnc_shape.experiments.verdicts import Result


def reproduce(
    papers: Annotated[
        list[str] | None,
        typer.Argument(metavar="[PAPER]...", help="Number of a paper, such as 002; without one, all."),
    ] = None,
    output: Annotated[
        str | None,
        typer.Option("-o", "--output", metavar="DIR", help="Write a page and the figures of every paper."),
    ] = None,
    figures: Annotated[
        str, typer.Option(help="With -o: formats of the figures, the first is on the page: svg, png or pdf.")
    ] = "svg,png",
    force: Force = False,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Run the papers' tables and figures again: published number, ours, tolerance and verdict.

    A number that differs is no failure: its note has the reason.
    """
    from cnc_shape.cli.output import print_json
    from cnc_shape.cli.progress import progress
    from cnc_shape.experiments import PAPERS, load_experiment
    from cnc_shape.experiments.pages import check_pages, figure_formats, write_pages
    from cnc_shape.experiments.verdicts import compute, results_json

    experiments = [load_experiment(paper) for paper in dict.fromkeys(papers or PAPERS)]
    formats = figure_formats(figures)
    drawn = 0
    if output is not None:
        check_pages(output, force=force)
        drawn = sum(len(one.figures) for one in experiments)
    with progress("reproducing", float(len(experiments) + drawn), quiet=quiet or json) as advance:
        results = [compute(one, advance) for one in experiments]
        if output is not None:
            write_pages(results, output, formats, advance, force=force)
    if json:
        print_json("reproduce", results_json(results))
    else:
        _print(results)


def _print(results: Sequence[Result]) -> None:
    from rich.console import Console

    from cnc_shape.experiments.verdicts import reasons, summary_words, verdicts_table

    console = Console(highlight=False)
    for result in results:
        console.print(
            f"paper {result.experiment.id}: {result.experiment.title}\n", markup=False, style="bold"
        )
        for table in result.tables:
            console.print(verdicts_table(table))
            if text := reasons(table, console.width):
                console.print(text, markup=False, soft_wrap=True)
            console.print()
    for result in results:
        console.print(summary_words(result))
