"""The bone's box from picture to picture, with or without a pose (the paper's bounding box).

Tracking-learning-detection after Kalal, Mikolajczyk, Matas (PAMI 2012): median flow follows the
box, a detector finds it again, and it learns. It learns from frames that the judge accepted and
from nothing else: where the box lies in them is known, so that no mistake of its own feeds it.
"""

from dataclasses import dataclass, replace

import numpy as np

from navapp.geometry.rectification import Image, luma
from navapp.tracking.box_detector import SURE, BoxMemory, Detection, detected, polished, taught
from navapp.tracking.median_flow import Grey, median_flow
from navapp.tracking.picture_box import PictureBox

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
        return reduced(self.newest)

    @property
    def picture_box(self) -> PictureBox | None:
        """The box in the picture's own size; None when it is not known."""
        return None if self.box is None else self.box.resized(_REDUCTION)


def placed(
    state: BoxState | None, left: Image, box: PictureBox | None, hidden_share: float | None
) -> BoxState:
    """After a frame with a pose: its projection is the box.

    Args:
        state: before; None at first.
        left: (H, W) or (H, W, 3) picture of the left camera.
        box: of the pose, in that picture.
        hidden_share: of the bone, when the judge accepted the pose; None otherwise.
    """
    state = BoxState(left, None) if state is None else state
    small = None if box is None else box.resized(1.0 / _REDUCTION)
    state = replace(state, newest=left, box=small)
    if small is None or hidden_share is None:
        return state
    least_hidden = min(state.least_hidden, hidden_share)
    if hidden_share > least_hidden + _HAND_SHARE:
        return state
    memory = state.memory
    if memory is None or state.n_accepted % _LEARN_EVERY == 0:
        memory = taught(memory, state.picture, small)
    return BoxState(left, small, memory, state.n_accepted + 1, least_hidden)


def followed(state: BoxState, left: Image) -> BoxState:
    """After a frame without a pose: the box where it moved, or where it is found again, or None."""
    memory = state.memory
    if memory is None:
        return replace(state, newest=left, box=None)
    picture = reduced(left)
    carried = _carried(state, memory, picture)
    if carried is None or carried.likeness.similarity < SURE:
        found = [one for one in detected(memory, picture) if _is_enough(one, _FOUND)]
        carried = _likelier(carried, polished(memory, picture, found[0].box) if found else None)
    return replace(state, newest=left, box=None if carried is None else carried.box)


def reduced(left: Image) -> Grey:
    """A picture as the box is looked for in it: grey, a quarter of its size."""
    import cv2

    grey = luma(left)
    size = (max(1, grey.shape[1] // _REDUCTION), max(1, grey.shape[0] // _REDUCTION))
    return np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _carried(state: BoxState, memory: BoxMemory, picture: Grey) -> Detection | None:
    """What the flow says, if it still looks like the bone."""
    if state.box is None:
        return None
    before = state.picture
    if before.shape != picture.shape:
        return None
    box = median_flow(before, picture, state.box)
    if box is None:
        return None
    carried = polished(memory, picture, box)
    return carried if _is_enough(carried, _CARRIED) else None


def _likelier(a: Detection | None, b: Detection | None) -> Detection | None:
    both = [one for one in (a, b) if one is not None]
    return max(both, key=lambda one: one.likeness.similarity, default=None)


def _is_enough(one: Detection, least: tuple[float, float]) -> bool:
    return one.likeness.similarity >= least[0] and one.likeness.relative >= least[1]
