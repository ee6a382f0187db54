"""Text that came from outside: names of files, programs and machines, made harmless to look at."""

from __future__ import annotations

import unicodedata


def one_line(text: str) -> str:
    """Return `text` with whatever moves a cursor, turns the writing or is no character spelled out."""
    return "".join(character if _is_plain(character) else _escaped(character) for character in text)


def _is_plain(character: str) -> bool:
    return character.isprintable() and unicodedata.bidirectional(character) not in {
        "LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI",
    }  # fmt: skip


def _escaped(character: str) -> str:
    return character.encode("unicode_escape", "surrogatepass").decode("ascii")
