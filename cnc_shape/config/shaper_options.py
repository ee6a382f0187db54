"""The options of every shaper, read off its function: the signature is the schema.

A parameter that takes modes is filled from the axis. Every other one is an option of the machine file, called
as in the signature plus its unit, with the signature's default and bounds.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, TypeAlias, Union, get_type_hints

from numpy.typing import ArrayLike
from pydantic import Field, create_model

from cnc_shape.config.setup import ShaperChoice
from cnc_shape.config.strict import Strict
from cnc_shape.modes import Mode
from cnc_shape.shapers import MULTI_MODE, SHAPERS, SINGLE_MODE, Shaper
from cnc_shape.shapers import NONE as UNSHAPED

UNIT_NAMES: Final = {"times": "times_s"}  # parameter in s: key of the file
NOT_BUILT: Final = frozenset(
    {
        "zvdd", "zvddd", "umzv", "mzv", "ei", "2hump_ei", "3hump_ei", "virtual_mode", "multi_mode", "sd",
        "optimal",
    }
).difference(SHAPERS)  # fmt: skip
NONE: Final = "none"
FUNCTIONS: Final[Mapping[str, Callable[..., Shaper]]] = {NONE: lambda: UNSHAPED, **SHAPERS}

_FILE_TYPES: Final[Mapping[object, Any]] = {
    ArrayLike: Annotated[list[float], Field(min_length=1, max_length=1000)],
    Callable[[Mode], Shaper]: Literal[tuple(SINGLE_MODE)],  # a shaper by its name
}


class ShaperModel(Strict):
    """A shaper of an axis: its type, and the options of that type."""

    type: str


def _options(function: Callable[..., Shaper]) -> dict[str, tuple[str, inspect.Parameter, Any]]:
    """Return the options of a shaper: key in the file -> parameter, its description, its type in the file."""
    hints = get_type_hints(function, include_extras=True)
    parameters = inspect.signature(function).parameters
    return {
        UNIT_NAMES.get(name, name): (name, parameter, _FILE_TYPES.get(hints[name], hints[name]))
        for name, parameter in parameters.items()
        if hints[name] not in (Mode, Sequence[Mode])
    }


def _default(value: object) -> object:
    if value is inspect.Parameter.empty:
        return ...
    return next((name for name, function in SINGLE_MODE.items() if function is value), value)


def options_model(name: str, function: Callable[..., Shaper]) -> type[ShaperModel]:
    """Return the model of ``{type: name, ...}`` whose keys are the options of `function`."""
    fields: dict[str, Any] = {"type": (Literal[name], ...)}
    fields |= {key: (hint, _default(p.default)) for key, (_, p, hint) in _options(function).items()}
    return create_model(f"shaper_{name}", __base__=ShaperModel, **fields)


MODELS: Final = tuple(options_model(name, function) for name, function in FUNCTIONS.items())
if TYPE_CHECKING:
    AnyShaper: TypeAlias = ShaperModel
else:
    AnyShaper = Annotated[Union[MODELS], Field(discriminator="type")]  # noqa: UP007  # a tuple of models


def design(choice: ShaperChoice, modes: Sequence[Mode]) -> Shaper:
    """Return the shaper that `choice` asks for on an axis with `modes`.

    A single-mode shaper takes the first mode.

    Raises
    ------
    OptionError
        Options that make no shaper of these modes.
    """
    function: Callable[..., Any] = FUNCTIONS[choice.type]
    keys = _options(function)
    values = {keys[key][0]: _value(value) for key, value in choice.options.items()}
    if choice.type in SINGLE_MODE:
        return function(modes[0], **values)
    if choice.type in MULTI_MODE:
        return function(modes, **values)
    return function(**values)


def _value(value: object) -> object:
    return SINGLE_MODE[value] if isinstance(value, str) else value
