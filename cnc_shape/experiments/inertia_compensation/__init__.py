"""Paper 003: a velocity gain that follows the load, on three axes that three more motors load."""

from __future__ import annotations

from typing import Final

from cnc_shape.experiments.experiment import Experiment
from cnc_shape.experiments.inertia_compensation import figures, tables

EXPERIMENT: Final = Experiment(
    id="003",
    title="Real-time inertia compensation of multi-axis CNC systems",
    reference=(
        "J. Lee, S. Jee, D. Sung, Real-time Inertia Compensation Algorithm to Improve the Contouring "
        "Accuracy of Multi-Axis CNC Systems (in Korean). Its results are measured on a test bed that it "
        "tells four numbers of, and its equations contradict one another: they are read here so that all "
        "fit."
    ),
    tables=tables.tables,
    figures={
        "fig06_disturbance_torque": figures.disturbance_torque,
        "fig07_contour_error": figures.contour_errors,
        "beyond_gain_and_inertia": figures.gain_and_inertia,
        "beyond_load_and_variants": figures.load_sweep,
    },
)
