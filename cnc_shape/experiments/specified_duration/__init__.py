"""Paper 002: specified-duration shapers, their robustness, and a container that does not swing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from cnc_shape.experiments.experiment import Experiment, Table
from cnc_shape.experiments.specified_duration import figures, tables
from cnc_shape.experiments.specified_duration.equations import LOWER, designed, designs
from cnc_shape.experiments.specified_duration.sweep import duration_table
from cnc_shape.experiments.specified_duration.transport import transport_table


def _tables() -> Sequence[Table]:
    found = designs()
    return (
        tables.durations(found),
        *(tables.equation_table(design) for design in found.values()),
        tables.equation_table(designed(LOWER)),
        tables.stepping(found),
        tables.robustness(found),
        tables.steps(found),
        duration_table(),
        transport_table(found),
    )


EXPERIMENT: Final = Experiment(
    id="002",
    title="Specified-duration shapers",
    reference=(
        "B. B. Kang, SD shapers that remove residual vibration in an arbitrary shaping time (in Korean), "
        "Journal of Korea Robotics Society. Its formulas, with the numbers of eqs 14-22, are images: "
        "what is compared are the numbers and statements of its text; ours of eqs 14-22 stand beside."
    ),
    tables=_tables,
    figures={
        "fig03_fig04_impulse_vectors": figures.vector_figure,
        "fig05_sensitivity": figures.sensitivity_figure,
        "fig06_steps": figures.step_figure,
        "fig08_container": figures.transport_figure,
        "beyond_duration": figures.duration_figure,
        "beyond_impulses": figures.impulse_figure,
    },
)
