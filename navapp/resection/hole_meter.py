"""Measures the mouths of drilled holes, in pairs of pictures in which the bone's pose is known.

A hole is dark, and its rim lies on the bone's surface, which the model gives: so the rim is looked
for on that surface, along rays from the middle of the mouth, in both pictures.
"""

import numpy as np

from navapp.geometry.rectification import Image
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.resection.face_errors import find_common_sd_mm
from navapp.resection.hole_rim import find_dark_disc, fit_circle
from navapp.resection.hole_view import Eye, SkinPatch
from navapp.values import BoneModel, DrillAxis, PoseEstimate
from navapp.values.holes import MeasuredHole

# Chosen: what shading and blood may move all of a rim by.
_COMMON_SD_MM = 0.08


class HoleMeter:
    """Measures the holes of one bone under one rig."""

    def __init__(self, rig: StereoRig, bone: BoneModel) -> None:
        self._rig, self._bone = rig, bone
        self._patches: dict[DrillAxis, SkinPatch | None] = {}

    def measure(
        self, left: Image, right: Image, estimate: PoseEstimate, planned: DrillAxis
    ) -> MeasuredHole | None:
        """One hole, against its plan.

        Args:
            left: picture of the left camera.
            right: of the right one, at the same instant.
            estimate: of the bone's pose in the left camera.
            planned: the hole.

        Returns:
            None where no dark mouth as wide as the drill is seen within 4 mm of the plan.
        """
        if planned not in self._patches:
            self._patches[planned] = SkinPatch.around(self._bone, planned)
        patch = self._patches[planned]
        if patch is None:
            return None
        eyes = [
            Eye(picture, camera, seen_from @ estimate.camera_from_bone)
            for picture, camera, seen_from in (
                (left, self._rig.left, RigidTransform.identity("left", "left")),
                (right, self._rig.right, self._rig.right_from_left),
            )
        ]
        disc = find_dark_disc(eyes, patch, planned)
        if disc is None:
            return None
        fit = fit_circle(eyes, patch, planned, *disc)
        if fit is None:
            return None
        circle, covariance, share = fit
        entry_mm = patch.place(circle[None, :2])[0]
        return MeasuredHole(
            planned,
            entry_mm,
            circle[:2],
            2.0 * float(circle[2]),
            covariance,
            self._common_covariance(estimate, planned, entry_mm),
            share,
        )

    def _common_covariance(
        self, estimate: PoseEstimate, planned: DrillAxis, entry_mm: FloatArray
    ) -> FloatArray:
        """(3, 3) of offset and diameter by what pictures may share: pose, plan, rig, shading."""
        pose, bone = estimate.camera_from_bone, self._bone
        by_pose = estimate.predict_covariances(bone.mesh.centroid_mm, entry_mm[None])[0]
        across = planned.axes @ pose.rotation.T
        common_mm = find_common_sd_mm(estimate, bone, self._rig.quality)
        covariance = _COMMON_SD_MM**2 * np.diag([1.0, 1.0, 4.0])
        covariance[:2, :2] += across @ by_pose @ across.T + common_mm**2 * np.eye(2)
        return covariance
