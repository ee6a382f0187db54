"""A block: the words of one line, sorted and checked against each other before anything happens."""

from __future__ import annotations

from dataclasses import dataclass

from cnc_shape.readers.gcode.codes import (
    CHANGE_TOOL,
    GROUP_OF,
    IGNORED,
    M_GROUP_OF,
    M_NOT_YET,
    NOT_YET,
    PROGRAM_ENDS,
    REFUSED,
    SET_TOOL,
    SMOOTHNESS,
    name_of,
)
from cnc_shape.readers.gcode.dialects import Dialect
from cnc_shape.readers.gcode.lexer import BlockError

LARGEST = 1e15  # of any number in a program
_EXTRA_AXES = "UVW"


@dataclass(frozen=True, slots=True)
class Block:
    """The words of a line. G and M codes apart, every letter occurs at most once."""

    words: dict[str, float]
    g: dict[str, int]  # modal group: code, ten times its number
    m: tuple[int, ...]


def read_block(pairs: list[tuple[str, str]], dialect: Dialect) -> Block:
    """Sort the words of a line.

    Raises
    ------
    BlockError
        A repeated word, two codes of one modal group, an unknown code, a code that is not built yet, a
        letter that the dialect does not have, N in the middle of a line.
    """
    words: dict[str, float] = {}
    g: dict[str, int] = {}
    m: list[int] = []
    for place, (letter, number) in enumerate(pairs):
        value = float(number)
        if not -LARGEST < value < LARGEST:
            raise BlockError(
                f"{letter} is beyond the limit of {LARGEST:g}", hint="check the number", letter=letter
            )
        if letter == "G":
            _add_g(value, number, g, dialect)
        elif letter == "M":
            _add_m(value, number, m, dialect)
        elif letter == "N":
            if place or value < 0.0:
                raise BlockError("N stands at the beginning of a line only", hint="move it there", letter="N")
        elif letter in words:
            raise BlockError(f"two {letter} words on one line", hint="keep one of them", letter=letter)
        elif letter in _EXTRA_AXES:
            raise BlockError(f"the axis {letter} is not built yet", hint="use X Y Z A B C", letter=letter)
        elif letter == "O":
            if place:
                raise BlockError(
                    "O-words (subroutines and loops) are not built yet", hint="unroll the program", letter="O"
                )
            words["O"] = value
        else:
            words[letter] = value
    if (
        "E" in words
        and dialect is not Dialect.MARLIN
        and not {66, 67, 68} & set(m)
        and SMOOTHNESS not in g.values()
    ):
        raise BlockError(
            "an E word: only 3D printers have it",
            hint="exponents are not numbers of G-code; for a printer's program use --dialect marlin",
            letter="E",
        )
    return Block(words, g, tuple(m))


def _add_g(value: float, number: str, g: dict[str, int], dialect: Dialect) -> None:
    code = round(value * 10.0)
    group = GROUP_OF.get(code)
    if abs(value * 10.0 - code) > 1e-6 or (
        (group is None and code not in NOT_YET and code not in REFUSED)
        or (code == SMOOTHNESS and dialect is not Dialect.FANUC)
    ):
        raise BlockError(
            f"unknown code G{number}", hint="see the list of codes that are read", letter=f"G{number}"
        )
    if code in REFUSED:
        reason, hint = REFUSED[code]
        raise BlockError(reason, hint=hint, letter=name_of(code))
    if group is None or (code in NOT_YET and dialect is not Dialect.MARLIN):
        what, hint = NOT_YET[code]
        raise BlockError(f"{name_of(code)} ({what}) is not built yet", hint=hint, letter=name_of(code))
    if group in g:
        other = name_of(g[group])
        raise BlockError(
            f"{other} and {name_of(code)} exclude each other on one line",
            hint=f"both set the {group}: keep one",
            letter=name_of(code),
        )
    g[group] = code


def _add_m(value: float, number: str, m: list[int], dialect: Dialect) -> None:
    code = round(value)
    known = code in IGNORED or code in PROGRAM_ENDS or code in (CHANGE_TOOL, SET_TOOL) or code in M_NOT_YET
    if value != code or not (known or (dialect in (Dialect.FANUC, Dialect.MARLIN) and code < 1000)):
        raise BlockError(
            f"unknown code M{number}", hint="see the list of codes that are read", letter=f"M{number}"
        )
    if code in M_NOT_YET:
        what, hint = M_NOT_YET[code]
        raise BlockError(f"M{code} ({what}) is not built yet", hint=hint, letter=f"M{code}")
    group = M_GROUP_OF.get(code)
    for other in m:
        if other == code or (group is not None and M_GROUP_OF.get(other) == group):
            raise BlockError(
                f"M{other} and M{code} exclude each other on one line", hint="keep one", letter=f"M{code}"
            )
    m.append(code)
