"""The Python API: the commands' names as functions, one line of summary a value."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose

import cnc_shape as cs
from cnc_shape.config.bundled import bundled


def test_every_name_is_there():
    assert set(dir(cs)) == set(cs.__all__)
    for name in cs.__all__:
        assert getattr(cs, name) is not None


def test_the_stages_one_by_one_give_what_the_command_gives():
    setup = cs.load_machine(bundled("xy_stage.yaml"))
    program = cs.read_program(bundled("bracket.nc"))
    toolpath = cs.build_toolpath(program)
    limits = [axis.limits for axis in setup.machine.with_axes(program.axes).axes]
    command = cs.sample(cs.plan(cs.smooth(toolpath, cs.Smoothing(0.01)), limits), 1e-3)
    shaped = cs.shape_command(command, setup.command_shaping(setup.planning.shaping))
    control = cs.Control(feedforward=setup.control.feedforward, position_gain=setup.control.position_gain)
    response = cs.simulate(shaped, setup.machine, control)
    longer = setup.command_shaping(setup.planning.shaping).longer(command.axes, 1e-3)
    back, ahead = (int(np.ceil((k / 20 + longer) / 1e-3)) + 1 for k in (4.0, 1.5))
    windows = cs.foot_windows(shaped.arc_length, back, ahead, 0.5)
    error = cs.contour_error(response.tool, toolpath, *windows)
    case = cs.simulate_program(bundled("bracket.nc"), setup, ["shaped"], record=False).summary.cases[0]
    assert_allclose([error.rms, error.max], [case.tool.rms, case.tool.max], rtol=1e-12)


def test_values_say_in_one_line_what_they_are():
    setup = cs.load_machine(bundled("xy_stage.yaml"))
    shaper = cs.design.zv(cs.Mode(50.0, 0.0))
    assert shaper.summary() == "2 impulses over 10 ms: 0.5 at 0 ms, 0.5 at 10 ms"
    run = cs.simulate_program(bundled("clover.csv"), setup, ["unshaped"])
    toolpath = cs.build_toolpath(cs.read_program(bundled("clover.csv")))
    error = cs.contour_error(run.signal("unshaped").tool, toolpath)
    assert error.summary().startswith("contour error ")
    assert f"line {error.line[np.argmax(error.distance)]}" in error.summary()
    command = cs.sample(
        cs.plan(cs.smooth(toolpath, cs.Smoothing(0.01)), [a.limits for a in setup.machine.axes]), 1e-3
    )
    assert (
        command.summary()
        == f"{len(command)} samples of X, Y, Z every 1 ms along {command.arc_length[-1]:.3f} mm"
    )
    assert cs.simulate(command, setup.machine, setup.control).summary().startswith("X follows to ")


def test_a_report_is_written_from_a_run(tmp_path):
    setup = cs.load_machine(bundled("xy_stage.yaml"))
    run = cs.simulate_program(bundled("clover.csv"), setup, ["unshaped", "shaped"])
    assert cs.write_report(run, tmp_path / "report", setup).is_file()
    assert len(cs.plot(run).axes) == 2
