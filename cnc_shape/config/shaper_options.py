"""The options of every shaper, read off its function: the signature is the schema.

A parameter that takes modes is filled from the axis. Every other one is an option, called as in the signature
plus its unit, with the signature's default; the machine file and the command line know it by that key.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, TypeAlias, Union, get_type_hints

from numpy.typing import ArrayLike
from pydantic import Field, create_model

from cnc_shape.config.setup import ShaperChoice
from cnc_shape.config.strict import Strict
from cnc_shape.errors import OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers import MULTI_MODE, PLAIN, SHAPERS, SINGLE_MODE, Shaper
from cnc_shape.shapers import NONE as UNSHAPED

UNIT_NAMES: Final = {  # parameter: key with its unit
    "times": "times_s",
    "duration": "duration_s",
    "min_gap": "min_gap_s",
    "virtual_frequency": "virtual_frequency_hz",
}
NONE: Final = "none"
FUNCTIONS: Final[Mapping[str, Callable[..., Shaper]]] = {NONE: lambda: UNSHAPED, **SHAPERS}

_FILE_TYPES: Final[Mapping[object, Any]] = {
    ArrayLike: Annotated[list[float], Field(min_length=1, max_length=1000)],
    Callable[[Mode], Shaper]: Literal[tuple(PLAIN)],  # a shaper by its name
    Sequence[int] | None: Annotated[list[int] | None, Field(min_length=1, max_length=32)],
}


class ShaperModel(Strict):
    """A shaper of an axis: its type, and the options of that type."""

    type: str


@dataclass(frozen=True, slots=True)
class ShaperOption:
    """An option of a shaper: a parameter of its function, and how files and commands give it."""

    parameter: str
    hint: Any  # type of the parameter
    default: object  # of the parameter, or `inspect.Parameter.empty`

    @property
    def file_type(self) -> Any:
        """Type of the value in a file."""
        if _is_enum(self.hint):
            return Literal[tuple(str(member.value) for member in self.hint)]
        return _FILE_TYPES.get(self.hint, self.hint)

    @property
    def file_default(self) -> Any:
        """Default as a file would give it; Ellipsis where there is none."""
        if self.default is inspect.Parameter.empty:
            return ...
        return _in_file(self.default)

    def value(self, given: object) -> object:
        """What the function takes for the value `given` in a file."""
        if _is_enum(self.hint):
            return self.hint(given)
        return PLAIN[given] if isinstance(given, str) else given


def _is_enum(hint: Any) -> bool:
    return isinstance(hint, type) and issubclass(hint, Enum)


def options_of(name: str) -> dict[str, ShaperOption]:
    """Return the options of the shaper called `name`, by their keys."""
    function = FUNCTIONS[name]
    hints = get_type_hints(function, include_extras=True)
    return {
        UNIT_NAMES.get(parameter, parameter): ShaperOption(parameter, hints[parameter], description.default)
        for parameter, description in inspect.signature(function).parameters.items()
        if hints[parameter] not in (Mode, Sequence[Mode])
    }


def key_of(argument: str | None) -> str | None:
    """Return the key of the option that the parameter `argument` is given by."""
    return None if argument is None else UNIT_NAMES.get(argument, argument)


def as_given(name: str, values: Mapping[str, object]) -> dict[str, object]:
    """Return arguments of the shaper's function as the options that a file would give: key: value."""
    options = {option.parameter: key for key, option in options_of(name).items()}
    return {
        options.get(parameter, parameter): _in_file(value)
        for parameter, value in values.items()
        if value is not None
    }


def _in_file(value: object) -> object:
    """The word for a value that a file names by one, or the value itself."""
    if isinstance(value, Enum):
        return value.value
    return next((name for name, function in PLAIN.items() if function is value), value)


def options_model(name: str) -> type[ShaperModel]:
    """Return the model of ``{type: name, ...}`` whose keys are the options of the shaper."""
    fields: dict[str, Any] = {"type": (Literal[name], ...)}
    fields |= {key: (option.file_type, option.file_default) for key, option in options_of(name).items()}
    return create_model(f"shaper_{name}", __base__=ShaperModel, **fields)


MODELS: Final = tuple(options_model(name) for name in FUNCTIONS)
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
    InfeasibleError
        No shaper keeps to the bounds that the options set.
    """
    function: Callable[..., Any] = FUNCTIONS[choice.type]
    options = options_of(choice.type)
    values = {options[key].parameter: options[key].value(given) for key, given in choice.options.items()}
    for key, option in options.items():
        if option.default is inspect.Parameter.empty and key not in choice.options:
            raise OptionError(f"{choice.type} needs {key}", hint=f"give {key}", argument=option.parameter)
    if choice.type in SINGLE_MODE:
        return function(modes[0], **values)
    if choice.type in MULTI_MODE:
        return function(modes, **values)
    return function(**values)
