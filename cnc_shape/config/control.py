"""The servo loop that a machine file describes."""

from __future__ import annotations

from cnc_shape.config.complaints import locate
from cnc_shape.config.models import ControlModel
from cnc_shape.config.yaml_tree import Tree, refuse
from cnc_shape.controllers import Control, CrossCoupling, Estimator, Feedforward, Form
from cnc_shape.kinematics import Kinematics


def read_control(source: str, tree: Tree, model: ControlModel, kinematics: Kinematics) -> Control:
    """Return the loop.

    Raises
    ------
    ConfigError
        A gain of the orientation on a machine whose tool does not turn.
    """
    feed, couple = model.feedforward, model.cross_coupling
    if couple and couple.orientation_per_s and kinematics.turn is None:
        path = ("control", "cross_coupling", "orientation_per_s")
        reason = f"{'.'.join(path)}: the tool of a {kinematics.name} machine does not turn"
        refuse(source, locate(tree, path)[0], reason, "remove it, or set it to 0")
    return Control(
        sample_time=model.sample_time_s,
        position_gain=model.position_gain_per_s,
        delay_samples=model.delay_samples,
        feedforward=feed
        and Feedforward(feed.velocity, feed.acceleration, feed.model_time_constant_s, feed.model_gain),
        cross_coupling=couple
        and CrossCoupling(
            couple.proportional_per_s,
            Estimator[couple.estimator.upper()],
            couple.integral_per_s2,
            couple.derivative,
            Form[couple.form.upper()],
            couple.orientation_per_s,
        ),
        jacobian_every=model.jacobian_every,
    )
