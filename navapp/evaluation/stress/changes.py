"""What a stressed session is given wrongly: a rig or a plan that is not quite the true one."""

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np

from navapp.geometry.camera import Camera
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform, rotation_from_vector
from navapp.values import BoneModel, Plan

RigChange = Callable[[StereoRig, float], StereoRig]
# Plan, level, and the true thickness of the cartilage over the femur's vertices.
PlanChange = Callable[[Plan, float, FloatArray], Plan]
Eye = Literal["left", "right"]
EYES: tuple[Eye, ...] = ("left", "right")
BONE = "femur"

# Where a camera's numbers stand in its matrix, and in OpenCV's distortion.
_IN_MATRIX = {"fx": (0, 0), "fy": (1, 1), "cx": (0, 2), "cy": (1, 2)}
_IN_DISTORTION = {"k1": 0, "k2": 1, "p1": 2, "p2": 3, "k3": 4}


def change_camera(eye: Eye, number: str) -> RigChange:
    """One number of one camera: fx, fy by per cent, cx, cy by px, others by their own unit."""

    def change(rig: StereoRig, level: float) -> StereoRig:
        return _with_camera_number(rig, eye, number, level)

    return change


def change_both_focal(rig: StereoRig, level_percent: float) -> StereoRig:
    """Both focal lengths of both cameras."""
    for eye in EYES:
        for number in ("fx", "fy"):
            rig = _with_camera_number(rig, eye, number, level_percent)
    return rig


def change_turn(axis: int) -> RigChange:
    """The right camera turned about one of its own axes, by degrees."""

    def change(rig: StereoRig, level_deg: float) -> StereoRig:
        vector = np.zeros(3)
        vector[axis] = np.radians(level_deg)
        turn = RigidTransform.from_parts(
            "right", "right", rotation_from_vector(vector), np.zeros(3)
        )
        return replace(rig, right_from_left=turn @ rig.right_from_left)

    return change


def change_place(axis: int) -> RigChange:
    """The right camera moved along one of its own axes, by mm."""

    def change(rig: StereoRig, level_mm: float) -> StereoRig:
        shift_mm = np.zeros(3)
        shift_mm[axis] = level_mm
        return _moved(rig, rig.right_from_left.translation_mm + shift_mm)

    return change


def change_baseline(rig: StereoRig, level_percent: float) -> StereoRig:
    """The distance of the cameras."""
    return _moved(rig, rig.right_from_left.translation_mm * (1.0 + 0.01 * level_percent))


def scale_plan(plan: Plan, level_percent: float, _thickness_mm: FloatArray) -> Plan:
    """Surface and targets larger about the middle of the bone."""
    middle_mm = plan.bones[BONE].mesh.centroid_mm

    def scale(points_mm: FloatArray) -> FloatArray:
        scaled: FloatArray = middle_mm + (1.0 + 0.01 * level_percent) * (points_mm - middle_mm)
        return scaled

    targets = {
        name: scale(points) if name.startswith(f"{BONE}/") else points
        for name, points in plan.targets.items()
    }
    scaled = _with_surface(plan, scale(plan.bones[BONE].mesh.vertices_mm))
    return replace(scaled, targets=targets, digest="")


def shift_plan(plan: Plan, level_mm: float, _thickness_mm: FloatArray) -> Plan:
    """The surface beside its targets, in equal parts along the three axes of the plan."""
    shift_mm = np.full(3, level_mm / np.sqrt(3.0))
    return _with_surface(plan, plan.bones[BONE].mesh.vertices_mm + shift_mm)


def grow_plan(plan: Plan, level_mm: float, _thickness_mm: FloatArray) -> Plan:
    """The surface outside the bone's, as a threshold that is too low makes it."""
    mesh = plan.bones[BONE].mesh
    return _with_surface(plan, mesh.vertices_mm + level_mm * mesh.normals)


def misjudge_cartilage(sd_mm: float) -> PlanChange:
    """A thickness that differs from the true one wherever there is cartilage.

    Args:
        sd_mm: standard deviation that the plan claims.
    """

    def change(plan: Plan, level_mm: float, thickness_mm: FloatArray) -> Plan:
        is_covered = thickness_mm > 0.0
        planned_mm = np.where(is_covered, np.maximum(thickness_mm + level_mm, 0.0), 0.0)
        bone = replace(
            plan.bones[BONE],
            cartilage_mm=planned_mm,
            cartilage_sd_mm=np.where(is_covered, sd_mm, 0.0),
        )
        return replace(plan, bones={**plan.bones, BONE: bone}, digest="")

    return change


def _with_camera_number(rig: StereoRig, eye: Eye, number: str, level: float) -> StereoRig:
    if eye == "left":
        return replace(rig, left=_with_number(rig.left, number, level))
    return replace(rig, right=_with_number(rig.right, number, level))


def _with_number(camera: Camera, number: str, level: float) -> Camera:
    if number in _IN_DISTORTION:
        distortion = np.zeros(max(5, camera.distortion.size))
        distortion[: camera.distortion.size] = camera.distortion
        distortion[_IN_DISTORTION[number]] += level
        return replace(camera, distortion=distortion)
    matrix = np.array(camera.matrix)
    place = _IN_MATRIX[number]
    matrix[place] = (
        matrix[place] * (1.0 + 0.01 * level) if number[0] == "f" else level + matrix[place]
    )
    return replace(camera, matrix=matrix)


def _moved(rig: StereoRig, translation_mm: FloatArray) -> StereoRig:
    before = rig.right_from_left
    moved = RigidTransform.from_parts("right", "left", before.rotation, translation_mm)
    return replace(rig, right_from_left=moved)


def _with_surface(plan: Plan, vertices_mm: FloatArray) -> Plan:
    bone = plan.bones[BONE]
    moved = BoneModel(bone.name, TriangleMesh(vertices_mm, bone.mesh.faces), bone.side)
    return replace(plan, bones={**plan.bones, BONE: moved}, digest="")
