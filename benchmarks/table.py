"""All benchmarks, one after the other, and the table of their rows.

``python benchmarks/table.py [--long] [--write FILE]``. With ``--write`` the table and what it was measured on
replace what stands between the two markers in FILE. Exit code 1 if a script failed; a missed budget is
a number in the table, not a failure.
"""

from __future__ import annotations

import os
import subprocess
import sys
from argparse import ArgumentParser
from collections.abc import Iterable, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.measuring import NOT_BUILT, Row, machine_lines, parse

SCRIPTS = (
    "reading",
    "csv_reading",
    "look_ahead",
    "sampling",
    "shaping",
    "live_shaping",
    "servo_loop",
    "servo_drive",
    "contour_error",
    "whole_chain",
    "real_programs",
    "memory",
    "start_up",
    "first_run",
)
HEADINGS = ("stage", "ours", "peer", "ratio", "budget", "verdict")
BEGIN, END = "<!-- table: begin -->", "<!-- table: end -->"


def run(script: str, options: Sequence[str]) -> tuple[list[Row], int]:
    """Run one script, pass on what it prints for people, and collect its rows; its exit code as well."""
    command = [sys.executable, str(Path(__file__).with_name(f"{script}.py")), *options]
    rows: list[Row] = []
    # lines come as they are printed, whatever the terminal
    environment = {**os.environ, "PYTHONUNBUFFERED": "1", "PYTHONIOENCODING": "utf-8"}
    with subprocess.Popen(command, stdout=subprocess.PIPE, encoding="utf-8", env=environment) as process:
        for line in process.stdout or ():
            row = parse(line)
            if row is None:
                print(line, end="", flush=True)
            else:
                rows.append(row)
    return rows, process.returncode


def table(rows: Iterable[Row]) -> str:
    """Return the rows as a table that reads as text and as Markdown."""
    return aligned([HEADINGS, *(row.cells() for row in rows)])


def aligned(cells: Sequence[Sequence[str]]) -> str:
    """Return rows of cells, the headings first, as a table that reads as text and as Markdown."""
    widths = [max(len(row[column]) for row in cells) for column in range(len(cells[0]))]
    lines = [
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) + " |"
        for row in cells
    ]
    lines.insert(1, "|" + "|".join("-" * (width + 2) for width in widths) + "|")
    return "\n".join(lines)


def notes(rows: Iterable[Row]) -> str:
    """Return what rows have to say beside their numbers, as a list."""
    told = [row for row in rows if row.note and row.note != NOT_BUILT]
    return "\n".join(f"- {row.stage}, {row.peer_name or row.unit}: {row.note}" for row in told)


def placed(text: str, produced: str) -> str:
    """Put what was produced between the markers of `text`.

    Raises
    ------
    ValueError
        The markers are not there, once each and in order.
    """
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end) or BEGIN in rest or END in after:
        raise ValueError(f"the text needs {BEGIN} and {END}, once each")
    return f"{before}{begin}\n\n{produced}\n\n{end}{after}"


def main() -> int:
    """Run everything and print the table."""
    arguments = ArgumentParser(description="Run all benchmarks and print their table.")
    arguments.add_argument("--long", action="store_true", help="memory on ten million blocks as well")
    arguments.add_argument("--write", metavar="FILE", type=Path, help="put the table into this document")
    wanted = arguments.parse_args()
    document = wanted.write.read_text(encoding="utf-8") if wanted.write else f"{BEGIN}{END}"
    placed(document, "")  # a document without its markers is refused before anything is measured
    rows: list[Row] = []
    failed: list[str] = []
    for script in SCRIPTS:
        print(f"== {script}", flush=True)
        found, code = run(script, ["--long"] if wanted.long and script == "memory" else [])
        rows += found
        if code != 0:
            failed.append(script)
    produced = "\n\n".join(part for part in ("  \n".join(machine_lines()), table(rows), notes(rows)) if part)
    print(f"\n{produced}")
    if wanted.write:
        wanted.write.write_text(placed(document, produced), encoding="utf-8")
    if failed:
        print(f"\nfailed: {', '.join(failed)}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
