"""Programs of any length: the same arguments give the same bytes, everywhere.

``python benchmarks/programs.py KIND BLOCKS FILE`` writes one. Positions are whole micrometres until they are
printed, so nothing depends on how a platform rounds.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from random import Random

SEED = 1
PIECE = 65536  # blocks that are written together

STEP = 100  # um, along a row of a raster
ROW = 1000  # steps in a row
PITCH = 100  # um, between rows

# a turn by 2 atan(1/128), a Pythagorean angle: points on a circle without any sine
COSINE, SINE = 16383.0 / 16385.0, 256.0 / 16385.0


def mm(micrometres: int) -> str:
    """Print a length as mm with three decimals."""
    whole, rest = divmod(abs(micrometres), 1000)
    return f"{'-' if micrometres < 0 else ''}{whole}.{rest:03d}"


def raster(random: Random, *, power: bool = False) -> Iterator[str]:
    """Rows to and fro, as an engraving laser does: every other row straight, the rest slightly wavy.

    Parameters
    ----------
    random
        Where waves and feeds come from.
    power
        Whether every block has an S word.
    """
    x = row = 0
    while True:
        step, wavy, wave = (-STEP if row % 2 else STEP), row % 4 > 1, 0
        feed = f" F{random.randrange(50, 70) * 100}"
        for column in range(ROW):
            last = column == ROW - 1
            x += 0 if last else step  # the last step of a row leads to the next one
            wave = max(-30, min(30, wave + int(random.random() * 13.0) - 6)) if wavy else 0
            y = (row + last) * PITCH + (0 if last else wave)
            spindle = f" S{int(random.random() * 1000.0)}" if power else ""
            yield f"G1 X{mm(x)} Y{mm(y)}{feed}{spindle}"
            feed = ""
        row += 1


def raster_power(random: Random) -> Iterator[str]:
    """The raster with an S word in every block."""
    return raster(random, power=True)


def mixed(random: Random) -> Iterator[str]:
    """Rounded pockets one beside the other: rapids, lines, arcs, dwells, feeds, comments, line numbers."""
    number = pocket = 0
    while True:
        left, bottom = pocket % 20 * 30_000, pocket // 20 % 20 * 30_000
        radius = random.randrange(1, 6) * 1000
        right, top = left + random.randrange(12, 26) * 1000, bottom + random.randrange(12, 26) * 1000
        feed = random.randrange(6, 19) * 100
        near, far = mm(left + radius), mm(right - radius)
        low, high = mm(bottom + radius), mm(top - radius)
        r = mm(radius)
        blocks = [
            f"(pocket {pocket})",
            f"G0 X{near} Y{mm(bottom)}",
            "G0 Z1.000",
            "G1 Z-0.500 F300",
            f"G1 X{far} F{feed}",
            f"G3 X{mm(right)} Y{low} I0.000 J{r}",
            f"G1 Y{high} (right)",
            f"G3 X{far} Y{mm(top)} I-{r} J0.000",
            f"G1 X{near}",
            f"G3 X{mm(left)} Y{high} I0.000 J-{r}",
            f"G1 Y{low} ; left",
            f"G3 X{near} Y{mm(bottom)} I{r} J0.000",
            "G4 P0.05",
            "G0 Z5.000",
        ]
        for block in blocks:
            number += 10
            yield block if block.startswith("(") else f"N{number % 100_000} {block}"
        pocket += 1


def printer(random: Random) -> Iterator[str]:
    """Layers of wavy rings and zigzag filling, ``X Y E F``: as a slicer writes for a printer."""
    layer, filament = 0, 0
    while True:
        height = 200 * (layer + 1)
        yield f"G1 Z{mm(height)} F600"
        for ring in range(6):
            x, y, radius = 1.0, 0.0, 32_000 - 450 * ring
            ripple = random.randrange(1, 8)
            yield f"G0 X{mm(100_000 + radius)} Y{mm(100_000)} F9000"
            feed = " F4800" if ring == 0 else " F6000"
            for corner in range(402):
                x, y = COSINE * x - SINE * y, SINE * x + COSINE * y
                r = radius + (corner * ripple % 41 - 20) * (2 if ring == 0 else 1)
                filament += 17
                place = f"X{mm(100_000 + int(r * x))} Y{mm(100_000 + int(r * y))}"
                yield f"G1 {place} E{mm(filament)}{feed}"
                feed = ""
        for turn in range(8):
            across = 3000 * (turn - 4)
            reach = 20_000 - abs(across) // 2
            for x_end in (-reach, reach) if turn % 2 else (reach, -reach):
                filament += reach // 15
                yield f"G1 X{mm(100_000 + x_end)} Y{mm(100_000 + across)} E{mm(filament)} F7200"
                across += 1500
        layer += 1


MODES = "G17 G21 G90 G94 G40 G49 F1200"
HEAD = {"printer": ("M82", "M104 S210", "G21 G90", "G28")}  # what comes first, where it is not MODES
TAIL = {"printer": ("M104 S0", "M84")}  # what comes last, where it is not M2

KINDS: dict[str, Callable[[Random], Iterator[str]]] = {
    "raster": raster,
    "raster-power": raster_power,
    "mixed": mixed,
    "printer": printer,
}


def lines(kind: str, blocks: int, seed: int = SEED) -> Iterator[str]:
    """Yield a program of `blocks` blocks between what sets all modes and what ends it."""
    yield from HEAD.get(kind, (MODES,))
    yield from islice(KINDS[kind](Random(seed)), blocks)
    yield from TAIL.get(kind, ("M2",))


def write(kind: str, blocks: int, path: Path, seed: int = SEED) -> None:
    """Write a program piece by piece: memory does not grow with its length."""
    source = lines(kind, blocks, seed)
    with path.open("w", encoding="ascii", newline="\n") as file:
        while piece := list(islice(source, PIECE)):
            file.write("\n".join(piece) + "\n")


def main() -> None:
    """Write the program that the command line asks for."""
    if len(sys.argv) != 4 or sys.argv[1] not in KINDS or not sys.argv[2].isdigit():
        sys.exit(f"usage: programs.py {'|'.join(KINDS)} BLOCKS FILE")
    write(sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]))


if __name__ == "__main__":
    main()
