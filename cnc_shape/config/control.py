"""The servo loop that a machine file describes."""

from __future__ import annotations

from cnc_shape.config.compensation_models import InertiaCompensationModel
from cnc_shape.config.complaints import refuse_at, refuse_key_at
from cnc_shape.config.drives import GIVE_A_MOTOR, NO_MOTOR, motors_of
from cnc_shape.config.models import ControlModel
from cnc_shape.config.yaml_tree import Tree
from cnc_shape.controllers import (
    Control,
    CrossCoupling,
    DisturbanceObserver,
    Estimator,
    Feedforward,
    Form,
    FrictionFeedforward,
    GainLaw,
    InertiaCompensation,
    InertiaIdentification,
)
from cnc_shape.kinematics import Kinematics
from cnc_shape.machine import Machine
from cnc_shape.units import MICROMETRE

MOTOR_TERMS = (
    "disturbance_observer",
    "inertia_compensation",
    "friction_feedforward",
    "inertia_identification",
)
FEWEST_REMEMBERED = 50  # samples that identification remembers: with a dozen its sums are rounding, then nan


def read_control(
    source: str, tree: Tree, model: ControlModel, machine: Machine, kinematics: Kinematics
) -> Control:
    """Return the loop.

    Raises
    ------
    ConfigError
        A gain of the orientation on a machine whose tool does not turn, or a term of servo motors on one
        without any.
    """
    _check_motor_terms(source, tree, model, machine)
    feed, couple = model.feedforward, model.cross_coupling
    watch, compensate = model.disturbance_observer, model.inertia_compensation
    friction, identify = model.friction_feedforward, model.inertia_identification
    if couple and couple.orientation_per_s and kinematics.turn is None:
        path = ("control", "cross_coupling", "orientation_per_s")
        reason = f"the tool of a {kinematics.name} machine does not turn"
        refuse_at(source, tree, path, reason, "remove it, or set it to 0")
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
        disturbance_observer=watch and DisturbanceObserver(watch.bandwidth_rad_s, watch.feedforward),
        inertia_compensation=compensate and _compensation(compensate),
        friction_feedforward=friction and FrictionFeedforward(friction.coulomb, friction.viscous),
        inertia_identification=identify
        and InertiaIdentification(
            identify.forgetting_time_s,
            identify.excitation_rad_s2,
            identify.smallest_ratio,
            identify.largest_ratio,
        ),
    )


def _compensation(model: InertiaCompensationModel) -> InertiaCompensation:
    return InertiaCompensation(
        max_gain_ratio=model.max_gain_ratio,
        deadband=model.deadband_nm,
        regularisation=model.regularisation_rad_s2,
        window=model.window_s,
        attack=model.attack_s,
        release=model.release_s,
        forgetting=model.forgetting,
        law=GainLaw[model.law.upper()],
        scale_integral_time=model.scale_integral_time,
        threshold=model.threshold_um * MICROMETRE,
        torque_speed_slope=model.torque_speed_slope_rad_s_nm,
    )


def _check_motor_terms(source: str, tree: Tree, model: ControlModel, machine: Machine) -> None:
    for key in MOTOR_TERMS:
        if getattr(model, key) is not None and not motors_of(machine):
            refuse_key_at(source, tree, ("control", key), NO_MOTOR, GIVE_A_MOTOR)
    identify, period = model.inertia_identification, model.sample_time_s
    if identify is not None and identify.forgetting_time_s < FEWEST_REMEMBERED * period:
        reason = (
            f"{identify.forgetting_time_s:g} s are {identify.forgetting_time_s / period:.3g} samples, "
            "too few to tell inertia, friction and load apart"
        )
        hint = f"remember {FEWEST_REMEMBERED} samples or more: {FEWEST_REMEMBERED * period:g} s"
        refuse_at(source, tree, ("control", "inertia_identification", "forgetting_time_s"), reason, hint)
