"""Paper 001: three impulses for a mode and a virtual one; n + 1 impulses for n modes."""

from __future__ import annotations

from typing import Final

from cnc_shape.experiments.experiment import Experiment
from cnc_shape.experiments.multi_mode import figures, response_figures, tables

EXPERIMENT: Final = Experiment(
    id="001",
    title="Virtual-mode shapers, and few impulses for many modes",
    reference=(
        "S. W. Hong, H. S. Choi, Y. G. Seo, S. W. Park, A Method of Input Shaper Design Using Virtual Mode "
        "for Undamped Vibration Systems (in Korean), 2008."
    ),
    tables=tables.tables,
    figures={
        "fig01_duration": figures.shaper_duration,
        "fig02_sequence": figures.impulse_sequence,
        "fig03_dimensionless_duration": figures.dimensionless_duration,
        "fig04_shapers_and_commands": figures.shapers_and_commands,
        "fig05_amplitudes_over_frequency": figures.amplitudes_over_frequency,
        "fig06_amplitudes_over_duration": figures.amplitudes_over_duration,
        "fig07_step_responses": response_figures.step_responses,
        "fig08_sensitivity": response_figures.sensitivity_surface,
        "fig09_bands": response_figures.sensitivity_bands,
        "fig10_band_width": response_figures.band_width,
        "appendix_two_modes": figures.two_mode_shapers,
        "beyond_stage_contour": figures.stage_contour,
    },
)
