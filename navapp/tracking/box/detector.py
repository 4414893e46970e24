"""Finds a bone's box in a whole picture, from what accepted frames showed.

The detector of tracking-learning-detection (Kalal, Mikolajczyk, Matas, PAMI 2012): windows pass a
test of their variance, then a correlation, then the relative similarity to the nearest of the kept
examples and counterexamples. A hand may hide half of the bone: windows are compared in nine parts,
and a part that does not agree counts nothing rather than against.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from navapp.geometry.transform import FloatArray
from navapp.tracking.box.median_flow import Grey
from navapp.tracking.box.picture_box import PictureBox
from navapp.tracking.box.windows import (
    LEAST_DEVIATION,
    ORIGINS,
    PART_PX,
    SIZE_PX,
    FloatPicture,
    Windows,
    joined,
    seen,
)

MOST_EXAMPLES, MOST_COUNTEREXAMPLES = 30, 60

_SCALES = (1.0, 0.9, 1.11)
# Parts move against each other when the bone turns.
_LOOSE_PX = 1
_N_BEST = 6
_LEAST_SCORE = 0.2
# Nothing but the box is so like it.
SURE = 0.6
# Shares of the box's size by which it is moved and scaled, in turn.
_POLISHING_STEPS = (0.04, 0.04, 0.02)
_NEIGHBOURS = ((-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1))
# A part that agrees so well tells where it lies.
_AGREEING = 0.6
_LEAST_AGREEING = 4
_LARGEST_RESCALE = 0.08
# An example like one that is kept adds nothing.
_KNOWN = 0.9
_APART = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class BoxMemory:
    """What boxes of accepted frames looked like, and what looked like them but was not.

    Attributes:
        examples: at most `MOST_EXAMPLES`, the newest is the last.
        counterexamples: at most `MOST_COUNTEREXAMPLES`.
        width_px, height_px: of the newest accepted box.
    """

    examples: Windows
    counterexamples: Windows
    width_px: float
    height_px: float


@dataclass(frozen=True, slots=True)
class Likeness:
    """How much a window looks like the box.

    Attributes:
        similarity: to the nearest example, mean correlation of the parts, 0 to 1.
        relative: similarity to the nearest example divided by the sum with that to the nearest
            counterexample.
    """

    similarity: float
    relative: float


@dataclass(frozen=True, slots=True)
class Detection:
    """Where the box may be."""

    box: PictureBox
    likeness: Likeness


def learn(memory: BoxMemory | None, picture: Grey, box: PictureBox) -> BoxMemory:
    """The memory after an accepted frame.

    Args:
        memory: before; None at first.
        picture: (H, W) grey.
        box: in it.
    """
    window = seen(picture, box)
    if memory is None:
        around = joined([seen(picture, other) for other in _around(box)])
        memory = BoxMemory(window, around, box.width, box.height)
    elif memory.examples.similarity(window) < _KNOWN:
        # The first one, of the registration, stays.
        first, newer = memory.examples.select(slice(1)), memory.examples.select(slice(1, None))
        examples = joined([first, newer.select(slice(2 - MOST_EXAMPLES, None)), window])
        memory = replace(memory, examples=examples, width_px=box.width, height_px=box.height)
    else:
        return replace(memory, width_px=box.width, height_px=box.height)
    mistaken = [
        seen(picture, found.box)
        for found in detect(memory, picture)
        if found.box.overlap(box) < _APART
    ]
    counterexamples = joined([memory.counterexamples, *mistaken])
    newest = counterexamples.select(slice(-MOST_COUNTEREXAMPLES, None))
    return replace(memory, counterexamples=newest)


def likeness(memory: BoxMemory, picture: Grey, box: PictureBox) -> Likeness:
    """How much a box of a picture looks like what was accepted."""
    window = seen(picture, box)
    similarity = memory.examples.similarity(window)
    other = memory.counterexamples.similarity(window)
    total = similarity + other
    return Likeness(similarity, similarity / total if total > 0.0 else 0.0)


def detect(memory: BoxMemory, picture: Grey) -> list[Detection]:
    """A few places that look most like the box, the most alike first.

    Other scales are looked at when the last one shows nothing that is surely the box.

    Args:
        memory: of accepted frames.
        picture: (H, W) grey, of the size of those it was taught.
    """
    found: list[tuple[float, PictureBox]] = []
    detections: list[Detection] = []
    for scale in _SCALES:
        found = sorted(found + _scan(memory, picture, scale), key=lambda one: -one[0])
        boxes: list[PictureBox] = []
        for _, box in found:
            if len(boxes) < _N_BEST and all(box.overlap(other) < _APART for other in boxes):
                boxes.append(box)
        detections = [Detection(box, likeness(memory, picture, box)) for box in boxes]
        detections.sort(key=lambda one: -one.likeness.similarity)
        if detections and detections[0].likeness.similarity >= SURE:
            break
    return detections


def polish(memory: BoxMemory, picture: Grey, box: PictureBox) -> Detection:
    """The box moved and scaled a little to where it looks most like what was accepted."""
    best = Detection(box, likeness(memory, picture, box))
    for step in _POLISHING_STEPS:
        tried = []
        for column, row, grown in _NEIGHBOURS:
            shift = step * np.array([column * best.box.width, row * best.box.height])
            near = best.box.move(shift, 1.0 + step * grown)
            tried.append(Detection(near, likeness(memory, picture, near)))
        best = max([best, *tried], key=lambda one: one.likeness.similarity)
    return best


def _scan(memory: BoxMemory, picture: Grey, scale: float) -> list[tuple[float, PictureBox]]:
    """Best places at one scale, with their score."""
    import cv2

    width, height = scale * memory.width_px, scale * memory.height_px
    shape = np.array([picture.shape[1], picture.shape[0]])
    size = np.round(shape * SIZE_PX / (width, height)).astype(int)
    size = np.maximum(size, SIZE_PX)
    view = cv2.resize(picture, (int(size[0]), int(size[1])), interpolation=cv2.INTER_AREA)
    # A box may lie half outside the picture.
    margin = SIZE_PX // 2
    view = cv2.copyMakeBorder(view, margin, margin, margin, margin, cv2.BORDER_REPLICATE)
    maps = _correlate(view.astype(np.float32), memory.examples.parts[-1])
    loose = np.ones((2 * _LOOSE_PX + 1,) * 2, np.uint8)
    score = np.mean([np.asarray(cv2.dilate(one, loose)) for one in maps], axis=0)
    found = []
    for _ in range(_N_BEST):
        _, best, _, (x, y) = cv2.minMaxLoc(score)
        if best < _LEAST_SCORE:
            break
        shift, rescale = _settle(maps, x, y)
        middle = (np.array([x, y]) + shift - margin + 0.5 * SIZE_PX) * shape / size - 0.5
        box = PictureBox(0.0, 0.0, width, height)
        found.append((best, box.move(middle - box.centre, rescale)))
        reach = SIZE_PX // 3
        score[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1] = 0.0
    return found


def _correlate(view: FloatPicture, example: FloatPicture) -> FloatPicture:
    """(parts, h, w) correlation of every part, by the corner of the box; 0 where it is flat."""
    import cv2

    kernel = (PART_PX, PART_PX)
    mean = cv2.boxFilter(view, -1, kernel, anchor=(0, 0), borderType=cv2.BORDER_REPLICATE)
    square = cv2.sqrBoxFilter(
        view, cv2.CV_32F, kernel, anchor=(0, 0), borderType=cv2.BORDER_REPLICATE
    )
    is_flat = square - mean * mean < LEAST_DEVIATION**2
    height, width = view.shape[0] - SIZE_PX + 1, view.shape[1] - SIZE_PX + 1
    maps = np.zeros((len(ORIGINS), height, width), np.float32)
    for k, (y, x) in enumerate(ORIGINS):
        part = example[k].reshape(kernel)
        if not part.any():
            continue
        inside = view[y : y + height + PART_PX - 1, x : x + width + PART_PX - 1]
        found = cv2.matchTemplate(inside, part, cv2.TM_CCOEFF_NORMED)
        found[is_flat[y : y + height, x : x + width]] = 0.0
        np.maximum(found, 0.0, out=maps[k])
    return maps


def _settle(maps: FloatPicture, x: int, y: int) -> tuple[FloatArray, float]:
    """Shift (2,) in px of the view, and scale, by where the parts agree best near a place."""
    reach = _LOOSE_PX + 1
    y0, x0 = max(0, y - reach), max(0, x - reach)
    near = maps[:, y0 : y + reach + 1, x0 : x + reach + 1]
    flat = near.reshape(len(maps), -1)
    rows, columns = np.unravel_index(flat.argmax(axis=1), near.shape[1:])
    agrees = flat.max(axis=1) >= _AGREEING
    shifts = np.column_stack([columns + x0 - x, rows + y0 - y])[agrees].astype(np.float64)
    if agrees.sum() < _LEAST_AGREEING:
        return np.zeros(2), 1.0
    places = np.array(ORIGINS, np.float64)[agrees][:, ::-1] + 0.5 * (PART_PX - SIZE_PX)
    spread = places - places.mean(axis=0)
    rescale = float((spread * (shifts - shifts.mean(axis=0))).sum() / max((spread**2).sum(), 1.0))
    rescale = float(np.clip(rescale, -_LARGEST_RESCALE, _LARGEST_RESCALE))
    shift: FloatArray = np.mean(shifts - rescale * places, axis=0)
    return shift, 1.0 + rescale


def _around(box: PictureBox) -> Sequence[PictureBox]:
    """Boxes beside a box, half a box away, and of twice and half its size."""
    places = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]
    half = 0.5 * np.array([box.width, box.height])
    beside = [box.move(half * place) for place in places]
    return [*beside, box.move(np.zeros(2), 2.0), box.move(np.zeros(2), 0.5)]
