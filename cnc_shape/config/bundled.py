"""Where the machine files and sample programs that come with cnc-shape lie."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from cnc_shape.errors import OptionError

FOLDERS: Final = ("configs", "samples")

_PACKAGE = Path(__file__).resolve().parent.parent


def bundled(name: str) -> Path:
    """Return the path of the bundled file called `name`, such as ``xy_stage.yaml``.

    An installed package carries the folders inside it, a checkout beside it.

    Raises
    ------
    OptionError
        Nothing of that name is bundled; the hint lists what is.
    """
    root = _PACKAGE / "bundled"
    folders = [(root if root.is_dir() else _PACKAGE.parent) / folder for folder in FOLDERS]
    for folder in folders:
        if name == Path(name).name and (folder / name).is_file():
            return folder / name
    names = sorted(path.name for folder in folders if folder.is_dir() for path in folder.iterdir())
    raise OptionError(f"no bundled file is called {name!r}", hint="there are " + ", ".join(names))
