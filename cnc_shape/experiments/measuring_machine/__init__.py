"""Paper 000: what a shaper does to a step, a wrong model, a stage and a measuring machine."""

from __future__ import annotations

from typing import Final

from cnc_shape.experiments.experiment import Experiment
from cnc_shape.experiments.measuring_machine import figures, motion_figures, tables

EXPERIMENT: Final = Experiment(
    id="000",
    title="Input shaping of a stage and a coordinate measuring machine",
    reference=(
        "S.-W. Hong, S.-W. Park, W. E. Singhose, Input Shaping for Vibration Reduction in Precise "
        "Positioning System (in Korean), about 2008. Its curves, measured and computed, have no numbers; "
        "Figs. 7 and 11 are sketches of machines."
    ),
    tables=tables.tables,
    figures={
        "fig01_shaped_step": figures.shaped_step,
        "fig02_step_responses": figures.step_with_and_without,
        "fig03_model_errors": figures.model_errors,
        "fig04_vibration_surface": figures.vibration_surface,
        "fig05_real_time_buffer": motion_figures.real_time_buffer,
        "fig06_real_time_error": motion_figures.real_time_error,
        "beyond_cost_of_sampling": motion_figures.cost_of_sampling,
        "fig08_stage_error": motion_figures.stage_error,
        "fig09_stage_velocity": motion_figures.stage_velocity,
        "fig10_stage_errors": motion_figures.stage_errors,
        "fig12_probe_position": motion_figures.probe_position,
        "fig13_probe_deflection": motion_figures.probe_deflection,
    },
)
