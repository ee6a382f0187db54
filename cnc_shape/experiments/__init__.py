"""Experiments: the papers' tables and figures, run again; one package a paper.

`PAPERS` is the registration: a paper's number, and the module that has its `EXPERIMENT`. The modules are
imported when they are asked for.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Final

from cnc_shape.errors import OptionError
from cnc_shape.experiments.experiment import Experiment

PAPERS: Final[Mapping[str, str]] = {
    "000": "cnc_shape.experiments.measuring_machine",
    "001": "cnc_shape.experiments.multi_mode",
    "002": "cnc_shape.experiments.specified_duration",
    "003": "cnc_shape.experiments.inertia_compensation",
    "004": "cnc_shape.experiments.contour_control",
}


def load_experiment(paper: str) -> Experiment:
    """The experiment of a paper, by its number.

    Raises
    ------
    OptionError
        No paper of that number is run again here.
    """
    if paper not in PAPERS:
        raise OptionError(f"no paper is called {paper!r}", hint="there are " + ", ".join(PAPERS))
    experiment = import_module(PAPERS[paper]).EXPERIMENT
    assert isinstance(experiment, Experiment)
    return experiment
