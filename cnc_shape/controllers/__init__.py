"""The terms of the servo loop, one file each; the loop is their sum."""

from cnc_shape.controllers.compensation import (
    DisturbanceObserver,
    FrictionFeedforward,
    GainLaw,
    InertiaCompensation,
    InertiaIdentification,
)
from cnc_shape.controllers.control import Control
from cnc_shape.controllers.cross_coupling import CrossCoupling, Estimator, Form
from cnc_shape.controllers.feedforward import Feedforward

__all__ = [
    "Control",
    "CrossCoupling",
    "DisturbanceObserver",
    "Estimator",
    "Feedforward",
    "Form",
    "FrictionFeedforward",
    "GainLaw",
    "InertiaCompensation",
    "InertiaIdentification",
]
