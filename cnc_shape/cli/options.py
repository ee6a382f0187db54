"""Options that several commands share."""

from __future__ import annotations

from typing import Annotated

import typer

MACHINE_SUFFIXES = (".yaml", ".yml")  # of machine files among the files that a command is given
Machine = Annotated[
    str | None,
    typer.Option(
        "-m",
        "--machine",
        envvar="CNC_SHAPE_MACHINE",
        help="Machine file; without it the bundled two-mode XY stage.",
        show_default=False,
    ),
]
Dialect = Annotated[str, typer.Option(help="auto, rs274, grbl, marlin or fanuc.")]
BlockDelete = Annotated[bool, typer.Option("--block-delete", help="Skip lines that start with /.")]
PathStyle = Annotated[
    str, typer.Option("--path", help="What joins CSV rows: polyline; with times also spline or circle.")
]
Closed = Annotated[bool, typer.Option("--closed", help="Join the last CSV row to the first.")]
Force = Annotated[bool, typer.Option("--force", help="Replace an existing output.")]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="No progress and no warnings.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
