"""The machine file: YAML, checked key by key, and the plain `Setup` it becomes.

The only place that knows pydantic or yaml. `yaml_tree` reads the text and remembers where everything
stood; `models` says which keys there are; `complaints` puts what they refuse at its place; `machine_file`
makes the values, `dump` writes them back.
"""

from cnc_shape.config.bundled import bundled
from cnc_shape.config.check import check_machine
from cnc_shape.config.dump import dump_machine
from cnc_shape.config.machine_file import load_machine, machine_path
from cnc_shape.config.setup import Planning, Setup, ShaperChoice, Shaping

__all__ = [
    "Planning",
    "Setup",
    "ShaperChoice",
    "Shaping",
    "bundled",
    "check_machine",
    "dump_machine",
    "load_machine",
    "machine_path",
]
