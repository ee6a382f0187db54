"""Paper 004: cross-coupled control of the contour error, on axes and on a parallel machine."""

from __future__ import annotations

from typing import Final

from cnc_shape.experiments.contour_control import figures, tables
from cnc_shape.experiments.experiment import Experiment

EXPERIMENT: Final = Experiment(
    id="004",
    title="Contour control of a parallel machine tool",
    reference=(
        "S.-H. Lee, D. Hong, W. C. Choi, J.-B. Song, Contour Control Algorithm for Parallel Machine Tool (in "
        "Korean), after 2002. Its responses and errors are curves without numbers; Figs. 1 to 3 are sketches."
    ),
    tables=tables.tables,
    figures={
        "fig03_machine": figures.machine,
        "fig04_fan_and_feed": figures.fan_and_feed,
        "fig05_response": figures.magnified_response,
        "fig06_contour_error": figures.contour_errors,
        "beyond_gain_sweep": figures.gain_sweep,
    },
)
