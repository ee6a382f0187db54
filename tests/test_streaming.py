"""A streamed run equals the monolithic one bit for bit: real programs, through the whole chain."""

from __future__ import annotations

import hashlib
from itertools import islice

import numpy as np
import pytest
from test_pipeline import cut

from cnc_shape.cases import default_cases
from cnc_shape.config.bundled import bundled
from cnc_shape.config.machine_file import load_machine
from cnc_shape.motion import moving
from cnc_shape.pipeline import Trial
from cnc_shape.program import concatenate
from cnc_shape.readers import ReadingOptions, read_chunks

PROGRAMS = [
    "camotics_tiger.nc", "cncjs_tball_pocket_laser.gcode", "gp_screw.gcode", "lcnc_arcspiral.ngc",
    "lcnc_boat_xyzbc.ngc", "lcnc_cds.ngc", "lcnc_lathe_pawn.ngc", "ugs_communicator.nc",
    "ugs_no_spaces.gcode", "ugs_rotation.ngc", "webgcode_pycam.ngc",
]  # fmt: skip
MOVES = 1500  # of each program


class Fingerprint:
    """Stands where a recorder does, and keeps nothing but hashes of all samples, in order."""

    def __init__(self) -> None:
        self._hashes = {}

    def add(self, response, errors):
        for name in ("arc_length", "position", "velocity", "acceleration"):
            self._update(f"command {name}", getattr(response.command, name))
        for name in ("joint", "position", "tool", "drive"):
            self._update(name, getattr(response, name))
        for k, error in enumerate(errors):
            for name in ("distance", "foot", "arc_length", "line"):
                self._update(f"error {k} {name}", getattr(error, name))

    def _update(self, name, values):
        self._hashes.setdefault(name, hashlib.sha256()).update(np.ascontiguousarray(values).tobytes())

    def digests(self):
        return {name: digest.hexdigest() for name, digest in self._hashes.items()}


def fingerprint(chunks, setup, case):
    """Hashes of all that one case makes of a program, and its summary."""
    trial = mark = None
    planning, period = setup.planning, setup.control.sample_time
    for block in moving(chunks, setup.machine, planning.path_tolerance, period, [case.timing]):
        if trial is None or mark is None:
            mark = Fingerprint()
            trial = Trial(case, setup.machine.with_axes(block.command.axes), setup.kinematics, mark)
        trial.advance(block)
    return mark.digests(), trial.summary()


@pytest.mark.parametrize("name", PROGRAMS)
def test_real_programs_at_awkward_chunk_sizes(shared, name):
    path = shared / "data" / "gcode" / "programs" / name
    setup = load_machine(bundled("xy_stage.yaml"))
    (program,) = islice(read_chunks(path, ReadingOptions(rows=MOVES)), 1)
    case = default_cases(setup)[-1]
    whole = fingerprint([program], setup, case)
    for size in (61, 997):
        assert fingerprint(cut(program, size), setup, case) == whole


@pytest.mark.parametrize("rows", [7, 500])
def test_chunks_of_the_reader_are_pieces_of_the_whole_program(shared, rows):
    path = shared / "data" / "gcode" / "programs" / "ugs_rotation.ngc"
    whole = concatenate(read_chunks(path, ReadingOptions(rows=10**9)))
    streamed = concatenate(read_chunks(path, ReadingOptions(rows=rows)))
    for name in ("target", "feed_rate", "line", "motion"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(streamed, name))
