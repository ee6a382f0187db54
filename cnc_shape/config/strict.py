"""Strict: the model that every part of a machine file is checked by, and what it says when it refuses.

An unknown key is refused with the nearest known one.
"""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from typing import NoReturn, cast

from pydantic import BaseModel, ConfigDict, model_validator
from pydantic_core import PydanticCustomError


class Strict(BaseModel):
    """A mapping of known keys to values of their own type, finite, never converted."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _know_every_key(cls, data: object) -> object:
        if not isinstance(data, Mapping):
            return data
        for key in cast("Mapping[str, object]", data):
            if key not in cls.model_fields:
                refuse_key(key, "unknown key", suggestion(key, list(cls.model_fields)))
        return cast("object", data)


def refuse_key(key: str, reason: str, hint: str) -> NoReturn:
    """Raise the error of one key of the mapping that is being checked."""
    raise PydanticCustomError("key", "{reason}", {"key": key, "reason": reason, "hint": hint})


def refuse_value(reason: str, hint: str, within: tuple[str | int, ...] = ()) -> NoReturn:
    """Raise the error of the value that is being checked, or of what the path `within` leads to in it."""
    raise PydanticCustomError("value", "{reason}", {"reason": reason, "hint": hint, "within": within})


def suggestion(word: str, known: list[str]) -> str:
    """Return a hint: the known word that `word` was meant to be, or all of them.

    A word without its unit, in capitals or misspelt finds its own.
    """
    small = word.lower()
    meant = [name for name in known if name.startswith(small + "_")] if small else []
    meant = meant or get_close_matches(small, known, n=1, cutoff=0.6)
    return f"did you mean {meant[0]}?" if meant else "known here: " + ", ".join(known)
