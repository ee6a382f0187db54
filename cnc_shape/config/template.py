"""The machine file that `init` writes."""

from __future__ import annotations

from pathlib import Path

from cnc_shape.errors import OptionError

SUFFIXES = (".yaml", ".yml")


def machine_template() -> str:
    """Return a machine file whose comments explain every key."""
    return Path(__file__).with_name("machine_template.yaml").read_text(encoding="utf-8")


def template_path(name: str) -> Path:
    """Return the path of the machine file called `name`, ending in .yaml where it has no suffix.

    Raises
    ------
    OptionError
        Another suffix, or no name.
    """
    path = Path(name)
    if "\0" in name or not path.name or path.name == "..":
        raise OptionError(f"{name!r} is no name for a file", hint="name it like machine.yaml")
    if not path.suffix:
        return path.with_name(path.name + SUFFIXES[0])
    if path.suffix.lower() not in SUFFIXES:
        reason = f"a machine file ends in .yaml, not in {path.suffix}"
        raise OptionError(reason, hint=f"name it {path.with_suffix(SUFFIXES[0])}")
    return path
