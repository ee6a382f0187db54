"""``cnc-shape init``: a machine file to start from."""

from __future__ import annotations

from typing import Annotated

import typer


def init(
    name: Annotated[
        str, typer.Argument(help="File to write; .yaml is added where it has no suffix.")
    ] = "machine.yaml",
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Write a commented machine file that explains every key and passes check; - is standard output."""
    from cnc_shape.cli.output import one_line, print_json, print_text
    from cnc_shape.config.template import machine_template, template_path
    from cnc_shape.errors import OptionError
    from cnc_shape.writers.publish import publish

    if name == "-":
        if json:
            raise OptionError(
                "- and --json both want standard output", hint="name a file, or leave --json out"
            )
        print_text(machine_template())
        return
    path = template_path(name)
    publish(path, machine_template().encode(), force=force)
    if json:
        print_json("init", {"output": str(path)})
    else:
        print_text(one_line(f"wrote {path}; next: cnc-shape check {path}"))
