"""Which function draws which figure of paper 001."""

from __future__ import annotations

from collections.abc import Mapping

from cnc_shape.experiments.experiment import Drawing
from cnc_shape.experiments.multi_mode import figures, response_figures

DRAWINGS: Mapping[str, Drawing] = {
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
}
