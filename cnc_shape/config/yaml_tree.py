"""YAML to plain data that remembers where everything stood.

The tree is built from parse events, so nothing is constructed that the text alone could make expensive or
dangerous: no aliases (a billion laughs), no anchors, no tags (objects), no nesting beyond `MAX_DEPTH`, and
what is too much is refused while it is read. Scalars follow the core schema of YAML 1.2 (section 10.3.2),
where ``1e-3`` is a number, ``010`` is ten, ``1:30`` and ``yes`` are text, and ``y`` is an axis.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import chain
from math import inf, nan
from typing import Final, NoReturn

import yaml

from cnc_shape.errors import ConfigError

MAX_BYTES: Final = 1 << 20
MAX_DEPTH: Final = 16
MAX_VALUES: Final = 25_000

_INTEGER = re.compile(r"[-+]?[0-9]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_OTHER_BASE = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
_WORDS: Final[Mapping[str, object]] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".inf", ".Inf", ".INF", "+.inf", "+.Inf", "+.INF"), inf),
    **dict.fromkeys(("-.inf", "-.Inf", "-.INF"), -inf),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), nan),
}  # fmt: skip
_LONGEST_EXACT = 18  # digits; a longer integer is no count of anything
_UNPRINTABLE = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]")


@dataclass(frozen=True, slots=True)
class Place:
    """Where something stands in a text, counted from 1."""

    line: int
    column: int


@dataclass(frozen=True, slots=True)
class Tree:
    """A value as plain data, with the places of everything in it."""

    value: object
    place: Place
    children: Mapping[str | int, Tree] = field(default_factory=dict["str | int", "Tree"])
    keys: Mapping[str, Place] = field(default_factory=dict[str, Place])


def scalar(text: str) -> object:
    """Return what a plain scalar says by the core schema of YAML 1.2."""
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text) and len(text) <= _LONGEST_EXACT:
        return int(text)
    if _OTHER_BASE.fullmatch(text) and len(text) <= _LONGEST_EXACT:
        return int(text, 0)
    if _FLOAT.fullmatch(text):
        return float(text)
    return text


def read_tree(source: str, data: bytes) -> Tree:
    """Read one YAML document.

    Parameters
    ----------
    source
        The name that errors call the text by.
    data
        The text in UTF-8.

    Raises
    ------
    ConfigError
        Too large, not UTF-8, not YAML, empty, more than one document, nested too deeply, a key given
        twice or without a value, or an anchor, alias or tag.
    """
    text = _decode(source, data)
    reader = _Reader(source, text)
    try:
        return reader.document()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = reader.place if mark is None else _place(mark)
        tabs = "\\t" in (error.problem or "")
        hint = "indent with spaces, not tabs" if tabs else "check indentation, colons, brackets and quotes"
        refuse(source, place, f"not valid YAML: {error.problem or error.context}", hint)
    except (yaml.YAMLError, ValueError, OverflowError):  # an escape or a version that is no number
        refuse(source, reader.place, "not valid YAML after this", "check the escapes in quoted text")


def refuse(source: str, place: Place, reason: str, hint: str | None) -> NoReturn:
    """Raise the error of a machine file at `place`."""
    raise ConfigError(source, place.line, place.column, reason, hint=hint)


def _decode(source: str, data: bytes) -> str:
    if len(data) > MAX_BYTES:
        refuse(source, Place(1, 1), f"larger than {MAX_BYTES} bytes", "is this a machine file?")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[: error.start].decode("utf-8-sig")
        reason = f"byte 0x{data[error.start]:02x} is not UTF-8"
        refuse(source, _end(before), reason, "save the file as UTF-8 text")
    if odd := _UNPRINTABLE.search(text):
        reason = f"character U+{ord(odd.group()):04X} has no place in a text"
        refuse(source, _end(text[: odd.start()]), reason, "is this a machine file?")
    return text


def _end(text: str) -> Place:
    """Return the place right after `text`."""
    lines = re.split("\r\n|[\n\r\x85\u2028\u2029]", text)
    return Place(len(lines), len(lines[-1]) + 1)


def _place(mark: yaml.Mark) -> Place:
    return Place(mark.line + 1, mark.column + 1)


class _Reader:
    """The events of one text; `place` is where the last one began."""

    def __init__(self, source: str, text: str) -> None:
        self._source = source
        self._events: Iterator[yaml.Event] = yaml.parse(text, Loader=yaml.SafeLoader)
        self._count = 0
        self.place = Place(1, 1)

    def document(self) -> Tree:
        self._next()  # the stream starts
        if isinstance(start := self._next(), yaml.StreamEndEvent):
            self._refuse("the file is empty", "cnc-shape init writes a machine file to start from")
        if isinstance(start, yaml.DocumentStartEvent) and start.tags:
            self._refuse("tags have no place in a machine file", "remove the %TAG line")
        tree = self._tree(self._next(), ())
        self._next()  # the document ends
        if not isinstance(self._next(), yaml.StreamEndEvent):
            self._refuse("a second document begins here", "one file holds one machine: remove the ---")
        return tree

    def _next(self) -> yaml.Event:
        event = next(self._events)
        self.place = _place(event.start_mark)
        self._count += 1
        if self._count > MAX_VALUES:
            self._refuse(f"more than {MAX_VALUES} values", "is this a machine file?")
        return event

    def _refuse(self, reason: str, hint: str) -> NoReturn:
        refuse(self._source, self.place, reason, hint)

    def _tree(self, event: yaml.Event, path: tuple[str | int, ...]) -> Tree:
        if len(path) > MAX_DEPTH:
            self._refuse(f"nested more than {MAX_DEPTH} deep", "a machine file needs 5 levels")
        self._refuse_reference(event)
        if isinstance(event, yaml.MappingStartEvent):
            return self._mapping(path)
        if isinstance(event, yaml.SequenceStartEvent):
            return self._sequence(path)
        return self._scalar(event, path)

    def _refuse_reference(self, event: yaml.Event) -> None:
        if isinstance(event, yaml.AliasEvent):
            self._refuse(f"*{event.anchor} is an alias", "write the values out")
        if isinstance(event, yaml.NodeEvent) and event.anchor is not None:
            self._refuse(f"&{event.anchor} is an anchor", "remove it: nothing can refer to it")
        if tag := getattr(event, "tag", None):
            self._refuse(f"{tag} is a tag", "remove it: values are plain numbers, text, lists and keys")

    def _scalar(self, event: yaml.Event, path: tuple[str | int, ...]) -> Tree:
        assert isinstance(event, yaml.ScalarEvent)
        value = scalar(event.value) if event.implicit[0] else event.value
        if value is None:
            self._refuse(f"{dotted(path) or 'the file'} has no value", "give it one, or remove the key")
        return Tree(value, self.place)

    def _sequence(self, path: tuple[str | int, ...]) -> Tree:
        place = self.place
        items: list[Tree] = []
        while not isinstance(event := self._next(), yaml.SequenceEndEvent):
            items.append(self._tree(event, (*path, len(items))))
        return Tree([item.value for item in items], place, dict(enumerate(items)))

    def _mapping(self, path: tuple[str | int, ...]) -> Tree:
        place = self.place
        children: dict[str | int, Tree] = {}
        keys: dict[str, Place] = {}
        while not isinstance(event := self._next(), yaml.MappingEndEvent):
            self._refuse_reference(event)
            if not isinstance(event, yaml.ScalarEvent):
                self._refuse("a key must be a word", "write key: value")
            key = event.value
            if key in keys:
                reason = f"{dotted((*path, key))} is given twice"
                self._refuse(reason, f"the first is on line {keys[key].line}: keep one")
            keys[key] = self.place
            children[key] = self._tree(self._next(), (*path, key))
        return Tree({key: child.value for key, child in children.items()}, place, children, keys)


def dotted(path: tuple[str | int, ...]) -> str:
    """Return a path of keys and indices as ``axes.y.modes[0].frequency_hz``."""
    words = chain.from_iterable((f"[{p}]",) if isinstance(p, int) else (".", p) for p in path)
    return "".join(words).removeprefix(".")
