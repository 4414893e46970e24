"""The bone's box from picture to picture, with or without a pose (the paper's bounding box).

It is where the picture looks like a template: near the last one, or anywhere. Templates are learned
from frames that the judge accepted and from nothing else: where the box lies in them is known, so
that no mistake of its own feeds it. Where nothing looks enough like them, there is no box.
"""

from dataclasses import dataclass, replace

import numpy as np

from navapp.geometry.rectification import Image, luma
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from navapp.registration import RegistrationModel
from navapp.tracking.box.picture_box import PictureBox
from navapp.tracking.box.templates import (
    Match,
    Templates,
    find_anywhere,
    find_near,
    find_turned,
    learn,
)
from navapp.values import Status, TrackedFrame

# All chosen, limits of similarity on the simulated knees of
# `python -m tests.bench.box_tracking`, seeds 0 to 3 and 9 to 14. Pictures are reduced by this
# factor.
_REDUCTION = 4
# One accepted frame of so many is learned from.
_LEARN_EVERY = 15
# A frame that hides so much more of the bone than another one did is not learned from: the hand
# would be learned with it. (Tissue hides a part of it always.)
_HAND_FRACTION = 0.1
# Least similarity of a box near the last one, and of one that is found anywhere; the whole picture
# is searched for none better than what is surely the bone.
_NEAR, _ANYWHERE, _SURE = 0.38, 0.57, 0.7
# The size of a box is known to a few percent: depth follows it only where it changed by more (log).
_SAME_SIZE = 0.1
# A bone whose box moved it by less is found from where it was last seen.
_SAME_PLACE_MM = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class BoxState:
    """What is remembered of one bone's box from picture to picture; bounded."""

    box: PictureBox | None  # px of the reduced picture; None when it is not known
    templates: Templates | None = None  # of accepted frames; None before the first
    accepted: PictureBox | None = None  # of the newest accepted frame, px of the reduced picture
    n_accepted: int = 0  # accepted frames so far that were learned from or might have been
    least_hidden: float = 1.0  # smallest fraction of the bone that was hidden in an accepted frame

    @property
    def picture_box(self) -> PictureBox | None:
        """The box in the picture's own size; None when it is not known."""
        return None if self.box is None else self.box.resize(_REDUCTION)


def place_box(
    state: BoxState | None, left: Image, box: PictureBox | None, hidden_fraction: float | None
) -> BoxState:
    """After a frame with a pose: its projection is the box.

    Args:
        state: before; None at first.
        left: (H, W) or (H, W, 3) picture of the left camera.
        box: of the pose, in that picture.
        hidden_fraction: of the bone, when the judge accepted the pose; None otherwise.
    """
    small = None if box is None else box.resize(1.0 / _REDUCTION)
    state = BoxState(small) if state is None else replace(state, box=small)
    if small is None or hidden_fraction is None:
        return state
    if hidden_fraction > state.least_hidden + _HAND_FRACTION:
        return state
    templates = state.templates
    if templates is None or state.n_accepted % _LEARN_EVERY == 0:
        templates = learn(templates, reduce_picture(left), small)
    least_hidden = min(state.least_hidden, hidden_fraction)
    return BoxState(small, templates, small, state.n_accepted + 1, least_hidden)


def follow_box(state: BoxState, left: Image) -> BoxState:
    """After a frame without a pose: the box where it moved, or where it is found again, or None."""
    templates, accepted = state.templates, state.accepted
    if templates is None or accepted is None:
        return replace(state, box=None)
    picture = reduce_picture(left)
    best = None if state.box is None else _follow(templates, picture, state.box)
    if best is None or best.similarity < _SURE:
        found = find_anywhere(templates, picture, accepted)
        least = _ANYWHERE if best is None else max(_ANYWHERE, best.similarity)
        best = found if found.similarity >= least else best
    if best is None:
        turned = find_turned(templates, picture, accepted)
        best = turned if turned.similarity >= _ANYWHERE else None
    return replace(state, box=None if best is None else best.box)


def reduce_picture(left: Image) -> Image:
    """A picture as the box is looked for in it: grey, a quarter of its size."""
    import cv2

    grey = luma(left)
    size = grey.shape[1] // _REDUCTION, grey.shape[0] // _REDUCTION
    return np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _follow(templates: Templates, picture: Image, box: PictureBox) -> Match | None:
    """Near the last box; None unless its middle is in view and it still looks like the bone."""
    near = find_near(templates, picture, box)
    middle = near.box.centre
    is_in_view = ((middle >= 0.0) & (middle < picture.shape[::-1])).all()
    return near if is_in_view and near.similarity >= _NEAR else None


class BoxTracker:
    """One bone's box in a rig's left pictures: a pose's projection, or followed without one."""

    def __init__(self, rig: StereoRig, model: RegistrationModel) -> None:
        self._camera = rig.left
        self._model = model

    def project(self, left_from_bone: RigidTransform) -> PictureBox | None:
        """The box of a pose in the left picture, which it may leave; None behind the camera."""
        return PictureBox.around(self._camera.project(left_from_bone.apply(self._model.hull_mm)))

    def follow(
        self, state: BoxState | None, left: Image, start: RigidTransform | None = None
    ) -> BoxState | None:
        """The box in the next picture without help of a pose; None when none was ever known.

        Args:
            state: before.
            left: picture of the left camera.
            start: an accepted pose, instead of a box that an operator draws at first.
        """
        if state is None and start is not None:
            return place_box(None, left, self.project(start), hidden_fraction=0.0)
        return None if state is None else follow_box(state, left)

    def place(self, state: BoxState | None, left: Image, tracked: TrackedFrame) -> BoxState | None:
        """The box after a frame: the pose's projection, if there is a pose."""
        pose, verdict = tracked.left_from_bone, tracked.verdict
        if pose is None:
            return state
        hidden_fraction = verdict.occluded_fraction if verdict.status is Status.OK else None
        return place_box(state, left, self.project(pose), hidden_fraction)

    def starts(self, expected: RigidTransform, state: BoxState | None) -> list[RigidTransform]:
        """Poses from which a bone is searched: where its box lies, and where it was expected."""
        box = None if state is None else state.picture_box
        if box is None:
            return [expected]
        moved = self.move(expected, box)
        is_same = np.linalg.norm(moved.translation_mm - expected.translation_mm) < _SAME_PLACE_MM
        return [expected] if is_same else [moved, expected]

    def move(self, pose: RigidTransform, box: PictureBox) -> RigidTransform:
        """A pose shifted so that its projection lies in a box; its depth follows the box's size."""
        projection = self.project(pose)
        if projection is None:
            return pose
        size = (box.width * box.height / (projection.width * projection.height)) ** 0.5
        nearer = size if abs(np.log(size)) > _SAME_SIZE else 1.0
        before, after = self._camera.rays([projection.centre, box.centre])
        centre_mm = pose.apply(self._model.centre_mm)
        depth_mm = float(centre_mm[2])
        shift_mm = depth_mm / nearer * after - depth_mm * before
        # What lies beside the box's middle moves towards the axis as it goes away.
        shift_mm[:2] += (1.0 / nearer - 1.0) * (centre_mm - depth_mm * before)[:2]
        translation_mm = pose.translation_mm + shift_mm
        return RigidTransform.from_parts(pose.target, pose.source, pose.rotation, translation_mm)
