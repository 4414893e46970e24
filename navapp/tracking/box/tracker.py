"""The bone's box from picture to picture, with or without a pose (the paper's bounding box).

Tracking-learning-detection after Kalal, Mikolajczyk, Matas (PAMI 2012): median flow follows the
box, a detector finds it again, and it learns. It learns from frames that the judge accepted and
from nothing else: where the box lies in them is known, so that no mistake of its own feeds it.
"""

from dataclasses import dataclass, replace

import numpy as np

from navapp.geometry.rectification import Image, luma
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from navapp.registration import RegistrationModel
from navapp.tracking.box.detector import SURE, BoxMemory, Detection, detect, learn, polish
from navapp.tracking.box.median_flow import median_flow
from navapp.tracking.box.picture_box import PictureBox
from navapp.values import Status, TrackedFrame

# All chosen, limits of similarity on the simulated knees of
# `python -m tests.bench.box_tracking --first 0 --seeds 4`. Pictures are reduced by this factor.
_REDUCTION = 4
# One accepted frame of so many is learned from.
_LEARN_EVERY = 15
# A frame that hides so much more of the bone than another one did is not learned from: the hand
# would be learned with it. (Tissue hides a part of it always.)
_HAND_FRACTION = 0.1
# Least similarity and least relative similarity of a box that is found in the whole picture, and of
# one that the flow has followed.
_FOUND, _FOLLOWED = (0.5, 0.54), (0.28, 0.48)
# The size of a box is known to a few percent: depth follows it only where it changed by more (log).
_SAME_SIZE = 0.1
# A bone whose box moved it by less is found from where it was last seen.
_SAME_PLACE_MM = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class BoxState:
    """What is remembered of one bone's box from picture to picture; bounded."""

    newest: Image  # (H, W) or (H, W, 3) picture of the left camera; never written to
    box: PictureBox | None  # in that picture, px of the reduced one; None when it is not known
    # what it looked like in accepted frames; None before the first.
    memory: BoxMemory | None = None
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
    state = BoxState(left, small) if state is None else replace(state, newest=left, box=small)
    if small is None or hidden_fraction is None:
        return state
    if hidden_fraction > state.least_hidden + _HAND_FRACTION:
        return state
    memory = state.memory
    if memory is None or state.n_accepted % _LEARN_EVERY == 0:
        memory = learn(memory, reduce_picture(left), small)
    least_hidden = min(state.least_hidden, hidden_fraction)
    return BoxState(left, small, memory, state.n_accepted + 1, least_hidden)


def follow_box(state: BoxState, left: Image) -> BoxState:
    """After a frame without a pose: the box where it moved, or where it is found again, or None."""
    memory = state.memory
    if memory is None:
        return replace(state, newest=left, box=None)
    picture = reduce_picture(left)
    likely = _follow(state, memory, picture)
    if not likely or likely[0].similarity < SURE:
        found = [one for one in detect(memory, picture) if _is_enough(one, _FOUND)]
        likely += [polish(memory, picture, one.box) for one in found[:1]]
    best = max(likely, key=lambda one: one.similarity, default=None)
    return replace(state, newest=left, box=None if best is None else best.box)


def reduce_picture(left: Image) -> Image:
    """A picture as the box is looked for in it: grey, a quarter of its size."""
    import cv2

    grey = luma(left)
    size = grey.shape[1] // _REDUCTION, grey.shape[0] // _REDUCTION
    return np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _follow(state: BoxState, memory: BoxMemory, picture: Image) -> list[Detection]:
    """The box that the flow leads to; none unless it still looks like the bone."""
    if state.box is None:
        return []
    before = reduce_picture(state.newest)
    box = median_flow(before, picture, state.box) if before.shape == picture.shape else None
    if box is None:
        return []
    followed = polish(memory, picture, box)
    return [followed] if _is_enough(followed, _FOLLOWED) else []


def _is_enough(one: Detection, least: tuple[float, float]) -> bool:
    return one.similarity >= least[0] and one.relative >= least[1]


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
