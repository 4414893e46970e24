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
from navapp.tracking.box.median_flow import Grey, median_flow
from navapp.tracking.box.picture_box import PictureBox
from navapp.values import Status, TrackedFrame

# Pictures are looked at in a quarter of their size.
_REDUCTION = 4
# One accepted frame of so many is learned from.
_LEARN_EVERY = 15
# A frame that hides so much more of the bone than another one did is not learned from: the hand
# would be learned with it. (Tissue hides a part of it always.)
_HAND_SHARE = 0.1
# A box found anywhere in the picture must be so like an accepted one, in itself and beside the
# counterexamples ...
_FOUND = 0.5, 0.54
# ... one that the flow has carried along need not be as much.
_CARRIED = 0.28, 0.48
# The size of a box is known to a few percent: depth follows it only where it changed by more.
_SAME_SIZE = 0.1
# A bone whose box moved it by less is found from where it was last seen.
_SAME_PLACE_MM = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class BoxState:
    """What is remembered of one bone's box from picture to picture; bounded.

    Attributes:
        newest: (H, W) or (H, W, 3) picture of the left camera; never written to.
        box: in that picture, px of the reduced one; None when it is not known.
        memory: what it looked like in accepted frames; None before the first.
        n_accepted: accepted frames so far that were learned from or might have been.
        least_hidden: smallest share of the bone that was hidden in an accepted frame.
    """

    newest: Image
    box: PictureBox | None
    memory: BoxMemory | None = None
    n_accepted: int = 0
    least_hidden: float = 1.0

    @property
    def picture(self) -> Grey:
        """The newest one, grey and reduced: a bone that is followed seldom asks for it."""
        return reduce_picture(self.newest)

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
    state = BoxState(left, None) if state is None else state
    small = None if box is None else box.resize(1.0 / _REDUCTION)
    state = replace(state, newest=left, box=small)
    if small is None or hidden_fraction is None:
        return state
    least_hidden = min(state.least_hidden, hidden_fraction)
    if hidden_fraction > least_hidden + _HAND_SHARE:
        return state
    memory = state.memory
    if memory is None or state.n_accepted % _LEARN_EVERY == 0:
        memory = learn(memory, state.picture, small)
    return BoxState(left, small, memory, state.n_accepted + 1, least_hidden)


def follow_box(state: BoxState, left: Image) -> BoxState:
    """After a frame without a pose: the box where it moved, or where it is found again, or None."""
    memory = state.memory
    if memory is None:
        return replace(state, newest=left, box=None)
    picture = reduce_picture(left)
    carried = _carry(state, memory, picture)
    if carried is None or carried.likeness.similarity < SURE:
        found = [one for one in detect(memory, picture) if _is_enough(one, _FOUND)]
        carried = _likelier(carried, polish(memory, picture, found[0].box) if found else None)
    return replace(state, newest=left, box=None if carried is None else carried.box)


def reduce_picture(left: Image) -> Grey:
    """A picture as the box is looked for in it: grey, a quarter of its size."""
    import cv2

    grey = luma(left)
    size = (max(1, grey.shape[1] // _REDUCTION), max(1, grey.shape[0] // _REDUCTION))
    return np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _carry(state: BoxState, memory: BoxMemory, picture: Grey) -> Detection | None:
    """What the flow says, if it still looks like the bone."""
    if state.box is None:
        return None
    before = state.picture
    if before.shape != picture.shape:
        return None
    box = median_flow(before, picture, state.box)
    if box is None:
        return None
    carried = polish(memory, picture, box)
    return carried if _is_enough(carried, _CARRIED) else None


def _likelier(a: Detection | None, b: Detection | None) -> Detection | None:
    both = [one for one in (a, b) if one is not None]
    return max(both, key=lambda one: one.likeness.similarity, default=None)


def _is_enough(one: Detection, least: tuple[float, float]) -> bool:
    return one.likeness.similarity >= least[0] and one.likeness.relative >= least[1]


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
            start: pose accepted as a start, which stands for the box that an operator draws when
                none is known yet.
        """
        if state is not None:
            return follow_box(state, left)
        if start is None:
            return None
        return place_box(None, left, self.project(start), hidden_fraction=0.0)

    def place(self, state: BoxState | None, left: Image, tracked: TrackedFrame) -> BoxState | None:
        """The box after a frame: the pose's projection, if there is a pose."""
        pose, verdict = tracked.left_from_bone, tracked.verdict
        if pose is None or verdict.status is Status.LOST:
            return state
        hidden_fraction = verdict.occluded_fraction if verdict.status is Status.OK else None
        return place_box(state, left, self.project(pose), hidden_fraction)

    def starts(self, expected: RigidTransform, state: BoxState | None) -> list[RigidTransform]:
        """Poses from which a bone is searched: where its box lies, and where it was expected."""
        box = None if state is None else state.picture_box
        if box is None:
            return [expected]
        moved = self.move(expected, box)
        shift_mm = moved.translation_mm - expected.translation_mm
        if np.linalg.norm(shift_mm) < _SAME_PLACE_MM:
            return [expected]
        return [moved, expected]

    def move(self, pose: RigidTransform, box: PictureBox) -> RigidTransform:
        """A pose shifted so that its projection lies in a box; its depth follows the box's size."""
        projection = self.project(pose)
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
