"""Finds a bone's box in a whole picture, from what accepted frames showed.

The detector of tracking-learning-detection (Kalal, Mikolajczyk, Matas, PAMI 2012): windows pass a
test of their variance, then a correlation, then the relative similarity to the nearest of the kept
examples and counterexamples. A hand may hide half of the bone: windows are compared in nine parts,
and a part that does not agree counts nothing rather than against.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import Image
from navapp.geometry.transform import FloatArray
from navapp.tracking.box.picture_box import PictureBox
from navapp.tracking.box.windows import (
    LEAST_DEVIATION,
    ORIGINS,
    PART_PX,
    SIZE_PX,
    Descriptors,
    compute_similarity,
    describe_box,
)

# All chosen, limits of similarity on the simulated knees of
# `python -m tests.bench.box_tracking --first 0 --seeds 4`.
MOST_EXAMPLES, MOST_COUNTEREXAMPLES = 30, 60
# Sizes of the searched box over that of the newest accepted one.
_SCALES = (1.0, 0.9, 1.11)
# Parts move against each other when the bone turns, by so much in a window.
_LOOSE_PX = 1
# Places that are looked at closely, and the least correlation of one.
_MOST_PLACES, _LEAST_CORRELATION = 6, 0.2
# Nothing but the bone's box has this similarity.
SURE = 0.6
# Fractions of the box's size by which it is moved and scaled, in turn: columns, rows, size.
_POLISHING_STEPS = (0.04, 0.04, 0.02)
_NEIGHBOURS = ((-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1))
# Parts of at least this correlation tell where the box lies, if they are enough.
_PART_AGREES, _LEAST_PARTS = 0.6, 4
_LARGEST_RESCALE = 0.08
# An example of this similarity to one that is kept adds nothing.
_KNOWN = 0.9
# Boxes that overlap by less are different ones.
_APART = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class BoxMemory:
    """What boxes of accepted frames looked like, and what looked like them but was not."""

    examples: Descriptors  # at most `MOST_EXAMPLES`, the newest is the last
    counterexamples: Descriptors  # at most `MOST_COUNTEREXAMPLES`
    newest: PictureBox  # the newest accepted box


@dataclass(frozen=True, slots=True)
class Detection:
    """Where the box may be, and how much it looks like that."""

    box: PictureBox  # in the picture
    similarity: float  # to the nearest example, 0 to 1
    relative: float  # similarity divided by the sum with that to the nearest counterexample


def learn(memory: BoxMemory | None, picture: Image, box: PictureBox) -> BoxMemory:
    """The memory, None before the first, after an accepted frame: its box in a picture (H, W)."""
    example = describe_box(picture, box)
    if memory is None:
        around = [describe_box(picture, other) for other in _boxes_around(box)]
        memory = BoxMemory(example, np.concatenate(around), box)
    else:
        memory = replace(memory, newest=box)
        if compute_similarity(example, memory.examples) >= _KNOWN:
            return memory
        # The first example, of the registration, stays.
        newer = memory.examples[1:][2 - MOST_EXAMPLES :]
        memory = replace(memory, examples=np.concatenate([memory.examples[:1], newer, example]))
    mistaken = [
        describe_box(picture, found.box)
        for found in detect(memory, picture)
        if found.box.overlap(box) < _APART
    ]
    counterexamples = np.concatenate([memory.counterexamples, *mistaken])
    return replace(memory, counterexamples=counterexamples[-MOST_COUNTEREXAMPLES:])


def rate(memory: BoxMemory, picture: Image, box: PictureBox) -> Detection:
    """How much a box of a picture looks like what was accepted."""
    descriptor = describe_box(picture, box)
    similarity = compute_similarity(descriptor, memory.examples)
    total = similarity + compute_similarity(descriptor, memory.counterexamples)
    return Detection(box, similarity, similarity / total if total > 0.0 else 0.0)


def detect(memory: BoxMemory, picture: Image) -> list[Detection]:
    """A few places of a picture (H, W) that look most like the box, the most alike first.

    Another scale is looked at when those before show nothing that is surely the box.
    """
    found: list[tuple[float, PictureBox]] = []
    detections: list[Detection] = []
    for scale in _SCALES:
        found = sorted(found + _scan(memory, picture, scale), key=lambda one: -one[0])
        boxes: list[PictureBox] = []
        for _, box in found:
            if len(boxes) < _MOST_PLACES and all(box.overlap(other) < _APART for other in boxes):
                boxes.append(box)
        detections = [rate(memory, picture, box) for box in boxes]
        detections.sort(key=lambda one: -one.similarity)
        if detections and detections[0].similarity >= SURE:
            break
    return detections


def polish(memory: BoxMemory, picture: Image, box: PictureBox) -> Detection:
    """The box moved and scaled a little to where it looks most like what was accepted."""
    best = rate(memory, picture, box)
    for step in _POLISHING_STEPS:
        size = np.array([best.box.width, best.box.height])
        rated = [best]
        for columns, rows, grown in _NEIGHBOURS:
            near = best.box.move(step * (size * (columns, rows)), 1.0 + step * grown)
            rated.append(rate(memory, picture, near))
        best = max(rated, key=lambda one: one.similarity)
    return best


def _scan(memory: BoxMemory, picture: Image, scale: float) -> list[tuple[float, PictureBox]]:
    """Best places at one scale, each with its mean correlation."""
    import cv2

    box = PictureBox(0.0, 0.0, scale * memory.newest.width, scale * memory.newest.height)
    shape = np.array(picture.shape[::-1])
    size = np.round(shape * SIZE_PX / (box.width, box.height)).astype(int)
    size = np.maximum(size, SIZE_PX)
    view = cv2.resize(picture, size.tolist(), interpolation=cv2.INTER_AREA)
    # A box may lie half outside the picture.
    margin = SIZE_PX // 2
    view = cv2.copyMakeBorder(view, margin, margin, margin, margin, cv2.BORDER_REPLICATE)
    maps = _correlate(view.astype(np.float32), memory.examples[-1])
    loose = np.ones((2 * _LOOSE_PX + 1,) * 2, np.uint8)
    score = np.mean([np.asarray(cv2.dilate(one, loose)) for one in maps], axis=0)
    found = []
    for _ in range(_MOST_PLACES):
        _, best, _, (x, y) = cv2.minMaxLoc(score)
        if best < _LEAST_CORRELATION:
            break
        shift, rescale = _align_parts(maps, x, y)
        middle = (np.array([x, y]) + shift - margin + 0.5 * SIZE_PX) * shape / size - 0.5
        found.append((best, box.move(middle - box.centre, rescale)))
        reach = SIZE_PX // 3
        score[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1] = 0.0
    return found


def _correlate(view: NDArray[np.float32], example: Descriptors) -> NDArray[np.float32]:
    """(parts, h, w) correlation of every part, by the corner of the box; 0 where it is flat."""
    import cv2

    kernel, border = (PART_PX, PART_PX), cv2.BORDER_REPLICATE
    mean = cv2.boxFilter(view, -1, kernel, anchor=(0, 0), borderType=border)
    square = cv2.sqrBoxFilter(view, cv2.CV_32F, kernel, anchor=(0, 0), borderType=border)
    is_flat = square - mean * mean < LEAST_DEVIATION**2
    height, width = view.shape[0] - SIZE_PX + 1, view.shape[1] - SIZE_PX + 1
    maps = np.zeros((len(ORIGINS), height, width), np.float32)
    for k, (y, x) in enumerate(ORIGINS):
        part = example[k, :-2].reshape(kernel)
        if not part.any():
            continue
        inside = view[y : y + height + PART_PX - 1, x : x + width + PART_PX - 1]
        found = cv2.matchTemplate(inside, part, cv2.TM_CCOEFF_NORMED)
        found[is_flat[y : y + height, x : x + width]] = 0.0
        np.maximum(found, 0.0, out=maps[k])
    return maps


def _align_parts(maps: NDArray[np.float32], x: int, y: int) -> tuple[FloatArray, float]:
    """Shift (2,) in px of the view, and scale, by where the parts agree best near a place."""
    reach = _LOOSE_PX + 1
    y0, x0 = max(0, y - reach), max(0, x - reach)
    near = maps[:, y0 : y + reach + 1, x0 : x + reach + 1]
    flat = near.reshape(len(maps), -1)
    agrees = flat.max(axis=1) >= _PART_AGREES
    if agrees.sum() < _LEAST_PARTS:
        return np.zeros(2), 1.0
    rows, columns = np.unravel_index(flat.argmax(axis=1), near.shape[1:])
    shifts = np.column_stack([columns + x0 - x, rows + y0 - y])[agrees].astype(np.float64)
    places = np.array(ORIGINS, np.float64)[agrees][:, ::-1] + 0.5 * (PART_PX - SIZE_PX)
    spread = places - places.mean(axis=0)
    rescale = float((spread * (shifts - shifts.mean(axis=0))).sum() / (spread**2).sum())
    rescale = float(np.clip(rescale, -_LARGEST_RESCALE, _LARGEST_RESCALE))
    shift: FloatArray = np.mean(shifts - rescale * places, axis=0)
    return shift, 1.0 + rescale


def _boxes_around(box: PictureBox) -> list[PictureBox]:
    """Boxes beside a box, half a box away, and of twice and half its size."""
    places = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]
    half = 0.5 * np.array([box.width, box.height])
    beside = [box.move(half * place) for place in places]
    return [*beside, box.move(np.zeros(2), 2.0), box.move(np.zeros(2), 0.5)]
