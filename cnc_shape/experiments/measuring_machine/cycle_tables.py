"""Section 3.2 of paper 000: the measuring machine."""

from __future__ import annotations

import numpy as np

from cnc_shape.experiments.experiment import Row, Table
from cnc_shape.experiments.measuring_machine import probing
from cnc_shape.experiments.straight_motion import settled
from cnc_shape.shapers import NONE, zv

SHOWN = 5e-4  # µm, digits of what is 0 but for rounding
LEVELS = (1e-3, 1e-2, 2e-2, 4e-2, 5e-2)  # mm, from which the approach may count as steady
SETTLING = {  # ms, what the model was known to give
    "unshaped": 1182.0,
    "ZV": 17.1,
    "SD, 0.8 periods": 28.1,
    "ZVD": 35.8,
    "EI": 262.0,
    "ZV, model 10 % high": 571.0,
    "ZVD, model 10 % high": 31.4,
    "EI, model 10 % high": 99.8,
}


def cycle_table() -> Table:
    """Figs. 12 and 13: the probing cycle."""
    rows: list[Row] = []
    for name, shaper in probing.shapers().items():
        found = probing.cycle(shaper)
        rows += [
            Row(f"{name}: vibration after the gross move", "µm", None, 1e3 * found.ring, SHOWN,
                "amplitude at its end; exact response"),
            Row(f"{name}: probe hangs within 2 µm", "ms", None, 1e3 * found.settling, 0.0,
                f"from the end of the unshaped gross move; the specification's model: {SETTLING[name]:g} ms"),
            Row(f"{name}: approach is steady within 1 µm", "ms", None, 1e3 * found.approach, 0.0,
                "from its start, 60 ms after the end of the shaped gross move"),
        ]  # fmt: skip
    shaper = zv(probing.COLUMN)
    measured = (
        "unshaped less ZV. The paper measured 10 ms on a machine it gives no numbers of: sign and mechanism "
        "agree, the size depends on how still is still enough, as the rows below it show"
    )
    for tolerance in LEVELS:
        gain = probing.approach_time(NONE, tolerance) - probing.approach_time(shaper, tolerance)
        quantity = f"approach shorter by, steady within {1e3 * tolerance:g} µm"
        first = tolerance == LEVELS[0]
        rows.append(Row(quantity, "ms", 10.0 if first else None, 1e3 * gain, 5.0 if first else 0.0,
                        measured if first else "unshaped less ZV"))  # fmt: skip
    return Table(
        "Section 3.2, Figs. 12 and 13: the probing cycle",
        tuple(rows),
        "A model of ours, the paper having none: the probe hangs on a column with 25 Hz and ζ = 0.02; gross "
        "move "
        "of 50 mm at 100 mm/s and 1 m/s², pause of 60 ms, approach of 4 mm at 8 mm/s and 0.4 m/s², retract "
        "of 4 mm "
        "at 60 mm/s. EI leaves its designed 5 %, 4.2 µm here, so a tolerance of 2 µm makes it look bad "
        "although "
        "it does what it is made for.",
    )


def program_table() -> Table:
    """The same cycle as a program."""
    rows: list[Row] = []
    end = probing.GROSS.end
    summaries = {case.name: case for case in probing.machine_run().summary.cases}
    for name in summaries:
        time, bent = probing.deflection(name)
        after = time >= end - 1e-9
        found = settled(bent[after], time[after], probing.SETTLED) - end
        start = end + probing.PAUSE
        begun = (time >= start) & (time < start + probing.COLUMN.damped_period)
        how = f"{probing.PROGRAM} on {probing.MACHINE} through the whole chain"
        rows += [
            Row(f"{name}: probe hangs within 2 µm", "ms", None, 1e3 * found, 0.0,
                f"{how}, sampled every ms; from the end of the unshaped gross move"),
            Row(f"{name}: contour error of the probe, largest", "µm", None,
                1e3 * summaries[name].tool.max, SHOWN, how),
            Row(f"{name}: deflection when the approach begins", "µm", None,
                1e3 * float(np.abs(bent[begun]).max()), SHOWN,
                f"{how}; largest in the first period of the approach"),
        ]  # fmt: skip
    return Table(
        "Section 3.2, the cycle as a program",
        tuple(rows),
        "The gross move goes along X, the touch along Y: what the column still swings in X is measured with "
        "the part.",
    )
