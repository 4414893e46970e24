"""Between pose and box: a pose's projection is the box, and a box that was found moves the pose."""

from dataclasses import replace

import numpy as np

from navapp.geometry.rectification import Image
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from navapp.registration import RegistrationModel
from navapp.tracking.box_tracker import BoxState, followed, placed
from navapp.tracking.picture_box import PictureBox
from navapp.values import Status, TrackedFrame

# The size of a box is known to a few percent: depth follows it only where it changed by more.
_SAME_SIZE = 0.1
# A bone whose box moved it by less is found from where it was last seen.
_SAME_PLACE_MM = 3.0


class BoxGuide:
    """One bone's box in the pictures of one rig's left camera; holds only what is constant."""

    def __init__(self, rig: StereoRig, model: RegistrationModel) -> None:
        self._camera = rig.left
        self._model = model

    def projected(self, left_from_bone: RigidTransform) -> PictureBox | None:
        """The box of a pose in the left picture, which it may leave; None behind the camera."""
        return PictureBox.around(self._camera.project(left_from_bone.apply(self._model.hull_mm)))

    def followed(
        self, state: BoxState | None, left: Image, start: RigidTransform | None = None
    ) -> BoxState | None:
        """The box in the next picture without help of a pose; None when none was ever known.

        Args:
            state: before.
            left: picture of the left camera.
            start: pose accepted as a start, which stands for the box that an operator draws when
                none is known yet.
        """
        if state is not None:
            return followed(state, left)
        if start is None:
            return None
        return placed(None, left, self.projected(start), hidden_share=0.0)

    def placed(self, state: BoxState | None, left: Image, tracked: TrackedFrame) -> BoxState | None:
        """The box after a frame: the pose's projection, if there is a pose."""
        pose, verdict = tracked.left_from_bone, tracked.verdict
        if pose is None or verdict.status is Status.LOST:
            return state
        hidden_share = verdict.occluded_share if verdict.status is Status.OK else None
        return placed(state, left, self.projected(pose), hidden_share)

    def starts(self, expected: RigidTransform, state: BoxState | None) -> list[RigidTransform]:
        """Poses from which a bone is searched: where its box lies, and where it was expected."""
        box = None if state is None else state.picture_box
        if box is None:
            return [expected]
        moved = self.moved(expected, box)
        shift_mm = moved.translation_mm - expected.translation_mm
        if np.linalg.norm(shift_mm) < _SAME_PLACE_MM:
            return [expected]
        return [moved, expected]

    def moved(self, pose: RigidTransform, box: PictureBox) -> RigidTransform:
        """A pose shifted so that its projection lies in a box; its depth follows the box's size."""
        projection = self.projected(pose)
        if projection is None:
            return pose
        size = (box.width * box.height / (projection.width * projection.height)) ** 0.5
        nearer = size if abs(np.log(size)) > _SAME_SIZE else 1.0
        pixels = np.stack([projection.centre, box.centre])
        before, after = self._camera.rays(pixels)
        centre_mm = pose.apply(self._model.centre_mm)
        depth_mm = float(centre_mm[2])
        shift_mm = depth_mm / nearer * after - depth_mm * before
        # What lies beside the box's middle moves towards the axis as it goes away.
        shift_mm[:2] += (1.0 / nearer - 1.0) * (centre_mm - depth_mm * before)[:2]
        matrix = np.array(pose.matrix)
        matrix[:3, 3] += shift_mm
        return replace(pose, matrix=matrix)
