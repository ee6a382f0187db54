"""What the models refuse, said at its place in the file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, NoReturn, cast

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from cnc_shape.config.strict import suggestion
from cnc_shape.config.yaml_tree import Place, Tree, dotted, refuse
from cnc_shape.errors import ConfigError

KeyPath = tuple[str | int, ...]  # to a value of a file: keys, and indices of lists

_EXPECTED: Final = {
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "string_type": "text",
    "list_type": "a list, like [1, 2]",
    "model_type": "keys with values",
    "model_attributes_type": "keys with values",
}
_RELATIONS: Final = {
    "greater_than": ("gt", "greater than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
}
_LONGEST_SHOWN = 40  # characters of a value in a message


def complaint(source: str, tree: Tree, error: ValidationError) -> ConfigError:
    """Return the first thing that is wrong in the file, as an error at its place."""
    found = [_located(tree, detail) for detail in error.errors(include_url=False)]
    place, path, detail = min(found, key=lambda item: (item[0].line, item[0].column))
    reason, hint = _words(detail)
    return ConfigError(source, place.line, place.column, f"{dotted(path) or 'the file'}: {reason}", hint=hint)


def locate(tree: Tree, path: Sequence[str | int]) -> tuple[Place, KeyPath]:
    """Return the place and the path of the value that `path` leads to, or of the last thing on it.

    Steps that are not in the file (the type's name where there are several, a missing key) are passed over.
    """
    place, walked = tree.place, list[str | int]()
    for step in path:
        kind = tree.children.get("type")
        if step in tree.children and not (kind and kind.value == step):
            tree = tree.children[step]
            place = tree.place
            walked.append(step)
    return place, tuple(walked)


def key_place(tree: Tree, path: Sequence[str | int]) -> Place:
    """Return the place of the key at the end of `path`."""
    for step in path[:-1]:
        tree = tree.children[step]
    return tree.keys[str(path[-1])]


def refuse_at(source: str, tree: Tree, path: KeyPath, reason: str, hint: str | None) -> NoReturn:
    """Raise the error of the value that `path` leads to, or of the last thing on it."""
    place, walked = locate(tree, path)
    refuse(source, place, f"{dotted(walked)}: {reason}", hint)


def refuse_key_at(source: str, tree: Tree, path: KeyPath, reason: str, hint: str | None) -> NoReturn:
    """Raise the error of the key at the end of `path`."""
    refuse(source, key_place(tree, path), f"{dotted(path)}: {reason}", hint)


def _located(tree: Tree, detail: ErrorDetails) -> tuple[Place, KeyPath, ErrorDetails]:
    within = cast("KeyPath", _context(detail).get("within", ()))
    place, path = locate(tree, (*detail["loc"], *within))
    if detail["type"] == "key":
        path = (*path, str(_context(detail)["key"]))
        place = key_place(tree, path)
    elif detail["type"].startswith("union_tag"):
        tag_place, tag_path = locate(tree, (*path, "type"))
        place, path = (tag_place, tag_path) if tag_path != path else (place, path)
    return place, path, detail


def _context(detail: ErrorDetails) -> Mapping[str, object]:
    return detail.get("ctx", {})


def _words(detail: ErrorDetails) -> tuple[str, str]:
    """Return what is wrong with a value, and what to do about it."""
    kind, value, context = detail["type"], detail["input"], _context(detail)
    if kind in ("key", "value"):
        return str(context["reason"]), str(context["hint"])
    if kind == "missing":
        key = detail["loc"][-1]
        return f"{key} is missing", f"add {key}: with its value"
    if kind == "union_tag_not_found":
        return "type is missing", "add type: with the name of one"
    if kind in ("union_tag_invalid", "literal_error"):
        return _word(kind, value, context)
    if kind in _EXPECTED:
        return f"must be {_EXPECTED[kind]}, not {_shown(value)}", _kind_hint(kind, value)
    if kind in _RELATIONS:
        name, relation = _RELATIONS[kind]
        return f"must be {relation} {context[name]:g}, not {_shown(value)}", "check the number and its unit"
    if kind == "string_unicode":
        return "must be one printable line", "write plain text"
    if kind == "finite_number":
        return f"must be finite, not {_shown(value)}", "give a number that can be written out"
    if kind in ("too_short", "too_long"):
        least, most = context.get("min_length"), context.get("max_length")
        bound = f"at least {least}" if kind == "too_short" else f"at most {most}"
        return f"needs {bound} values, not {context['actual_length']}", "check the commas"
    return detail["msg"][:1].lower() + detail["msg"][1:], "check the value"


def _word(kind: str, value: object, context: Mapping[str, object]) -> tuple[str, str]:
    known = str(context["expected_tags" if kind == "union_tag_invalid" else "expected"])
    words = [word.strip(" '") for word in known.replace(" or ", ",").split(",")]
    given = cast("Mapping[str, object]", value)["type"] if kind == "union_tag_invalid" else value
    choice = " or ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)
    return f"must be {choice}, not {_shown(given)}", suggestion(str(given), words)


def _shown(value: object) -> str:
    """Return a value as it might stand in the file, in short."""
    if isinstance(value, dict):
        return "keys with values"
    if isinstance(value, list):
        return "a list"
    if isinstance(value, bool):
        return str(value).lower()
    text = repr(value)
    text = text if len(text) <= _LONGEST_SHOWN else text[:_LONGEST_SHOWN] + "..."
    return f"the text {text}" if isinstance(value, str) else text


def _kind_hint(kind: str, value: object) -> str:
    if kind in ("float_type", "int_type") and isinstance(value, str):
        return "write it with digits alone, in the unit the key names: 0.5, 1e-3"
    if kind == "int_from_float":
        return "it counts something: leave the fraction out"
    if kind in ("model_type", "model_attributes_type"):
        return "write {key: value}, or one key a line below, indented"
    return "write one, as the key asks"
