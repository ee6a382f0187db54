"""Paper 001: three impulses for a mode and a virtual one; n + 1 impulses for n modes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from cnc_shape.experiments.experiment import Drawing, Experiment, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STEMS = (
    "fig01_duration",
    "fig02_sequence",
    "fig03_dimensionless_duration",
    "fig04_shapers_and_commands",
    "fig05_amplitudes_over_frequency",
    "fig06_amplitudes_over_duration",
    "fig07_step_responses",
    "fig08_sensitivity",
    "fig09_bands",
    "fig10_band_width",
    "appendix_two_modes",
    "beyond_stage_contour",
)


def _tables() -> Sequence[Table]:
    from cnc_shape.experiments.multi_mode.tables import tables

    return tables()


def _drawing(stem: str) -> Drawing:
    def draw() -> Figure:
        from cnc_shape.experiments.multi_mode.drawings import DRAWINGS

        return DRAWINGS[stem]()

    return draw


_FIGURES: Mapping[str, Drawing] = {stem: _drawing(stem) for stem in STEMS}

EXPERIMENT = Experiment(
    id="001",
    title="A Method of Input Shaper Design Using Virtual Mode for Undamped Vibration Systems",
    reference="S. W. Hong, H. S. Choi, Y. G. Seo, S. W. Park, 2008 (in Korean)",
    tables=_tables,
    figures=_FIGURES,
)
