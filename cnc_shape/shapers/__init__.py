"""Input shapers. `SHAPERS` is the registration: one name, one function.

A single-mode shaper is a function of one `Mode`, a multi-mode shaper of several; `impulses` takes
what the user measured or was given.
"""

from cnc_shape.shapers.cascade import cascade
from cnc_shape.shapers.shaper import NONE, Shaper, make_shaper
from cnc_shape.shapers.zero_vibration import zv, zvd

SINGLE_MODE = {"zv": zv, "zvd": zvd}
MULTI_MODE = {"cascade": cascade}
SHAPERS = {**SINGLE_MODE, **MULTI_MODE, "impulses": make_shaper}

__all__ = ["MULTI_MODE", "NONE", "SHAPERS", "SINGLE_MODE", "Shaper", "cascade", "make_shaper", "zv", "zvd"]
