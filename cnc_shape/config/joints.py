"""What moves a machine: its kinematics, and the drives of joints or of axes, which exclude each other."""

from __future__ import annotations

from collections.abc import Mapping

from cnc_shape.config.complaints import key_place, locate
from cnc_shape.config.drives import drive_of
from cnc_shape.config.kinematics import choice_of, kinematics_of
from cnc_shape.config.models import LinearAxisModel, MachineModel, RotaryAxisModel
from cnc_shape.config.setup import KinematicsChoice
from cnc_shape.config.yaml_tree import Tree, refuse
from cnc_shape.joints import CARTESIAN
from cnc_shape.kinematics import Kinematics
from cnc_shape.machine import Drive, IdealDrive

AxisModels = Mapping[str, LinearAxisModel | RotaryAxisModel]


def read_kinematics(model: MachineModel) -> tuple[KinematicsChoice, Kinematics]:
    """Return what the file asks for, and the kinematics that comes of it."""
    choice = KinematicsChoice() if model.kinematics is None else choice_of(model.kinematics)
    return choice, kinematics_of(choice)


def read_joints(
    source: str, tree: Tree, model: MachineModel, axes: AxisModels, kinematics: Kinematics
) -> tuple[Drive, ...]:
    """Return the drives of the joints, () where every axis has its own.

    Raises
    ------
    ConfigError
        Drives of joints on a Cartesian machine, of axes that joints move, or not as many as there are joints.
    """
    names = ", ".join(kinematics.joints)
    if kinematics == CARTESIAN:
        if model.joints is not None:
            reason = "joints: the joints of a cartesian machine are its axes"
            refuse(source, key_place(tree, ("joints",)), reason, "give every axis its drive:")
        return ()
    for name, axis in axes.items():
        if axis.drive is not None and name in kinematics.axes:
            reason = f"axes.{name}.drive: the drives of a {kinematics.name} machine belong to its joints"
            hint = f"list them below joints:, one each for {names}"
            refuse(source, key_place(tree, ("axes", name, "drive")), reason, hint)
    if model.joints is None:
        return (IdealDrive(),) * len(kinematics.joints)
    if len(model.joints) != len(kinematics.joints):
        reason = f"joints: {kinematics.name} has {len(kinematics.joints)} of them, not {len(model.joints)}"
        refuse(source, locate(tree, ("joints",))[0], reason, f"list one each for {names}, in this order")
    return tuple(
        drive_of(source, tree, ("joints", index, "drive"), joint.drive, name)
        for index, (joint, name) in enumerate(zip(model.joints, kinematics.joints, strict=True))
    )
