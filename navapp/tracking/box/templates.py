"""Where a picture looks like the boxes of accepted frames, by OpenCV's template matching.

A hand may hide a part of the bone: a template is matched as a whole and in nine parts, and a part
that does not agree counts nothing rather than against.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import Image
from navapp.geometry.transform import FloatArray
from navapp.tracking.box.picture_box import PictureBox

# (n, turns, SIZE_PX, SIZE_PX) what the box looked like in accepted frames, the newest last: as it
# was, then with the picture turned about the box's middle.
Templates = NDArray[np.uint8]

# All chosen, on the simulated knees of `python -m tests.bench.box_tracking`, seeds 0 to 3 and 9 to
# 14. A box is looked at as so many pixels square, in parts of so many.
SIZE_PX, _PART_PX = 30, 10
_ORIGINS = [(y, x) for y in range(0, SIZE_PX, _PART_PX) for x in range(0, SIZE_PX, _PART_PX)]
# A part whose grey values deviate by less is flat, and like every other flat one.
_FLAT = 2.5
# The first template and so many newest ones are kept; one as similar to a kept one adds nothing.
_MOST_NEWEST, _KNOWN = 4, 0.8
# Sizes that are tried, and how far a box is moved, as a fraction of its own size.
_NEAR_SCALES, _NEAR_FRACTION = (1.0, 0.97, 1.03), 0.11
_ANY_SCALES = (1.0, 0.9, 1.11)
# Turns of the picture that a template is learned with, in its plane.
_TURNS_DEG = (0.0, -20.0, 20.0)


@dataclass(frozen=True, slots=True)
class Match:
    """Where the box may be, and how much it looks like that."""

    box: PictureBox  # in the picture
    similarity: float  # to the template that is most like it, 0 to 1


def learn(templates: Templates | None, picture: Image, box: PictureBox) -> Templates:
    """The templates, None before the first, after a picture (H, W) with the box accepted in it."""
    new = np.array([[_cut(picture, box, turn_deg=turn_deg) for turn_deg in _TURNS_DEG]])
    if templates is None:
        return new
    if find_near(templates, picture, box).similarity >= _KNOWN:
        return templates
    return np.concatenate([templates[:1], templates[1:][1 - _MOST_NEWEST :], new])


def find_near(templates: Templates, picture: Image, box: PictureBox) -> Match:
    """The box moved and scaled a little to where it looks most like what was accepted."""
    reach = _NEAR_FRACTION * np.array([box.width, box.height])
    return _find(templates[:, 0], picture, box, _NEAR_SCALES, reach)


def find_anywhere(templates: Templates, picture: Image, box: PictureBox) -> Match:
    """A box of about the given one's size, its middle anywhere in the picture (H, W)."""
    found = _find_anywhere(templates[:, 0], picture, box, _ANY_SCALES)
    return find_near(templates, picture, found.box)


def find_turned(templates: Templates, picture: Image, box: PictureBox) -> Match:
    """A box of the given one's size anywhere, of a bone that has turned in the picture's plane."""
    turned = templates[:, 1:].reshape(-1, SIZE_PX, SIZE_PX)
    return _find_anywhere(turned, picture, box, (1.0,))


def _find_anywhere(
    templates: NDArray[np.uint8], picture: Image, box: PictureBox, scales: tuple[float, ...]
) -> Match:
    """The best match of any template (n, SIZE_PX, SIZE_PX) in the whole picture."""
    reach = 0.5 * np.array(picture.shape[::-1])
    return _find(templates, picture, box.move(reach - 0.5 - box.centre), scales, reach)


def _find(
    templates: NDArray[np.uint8],
    picture: Image,
    box: PictureBox,
    scales: tuple[float, ...],
    reach: FloatArray,
) -> Match:
    """The best match of any template and scale, its middle within reach (2,), px of the picture."""
    import cv2

    best = Match(box, 0.0)
    for scale in scales:
        sized = box.move(np.zeros(2), scale)
        step = np.array([sized.width, sized.height]) / SIZE_PX
        margin = (reach / step).astype(int)
        view = _cut(picture, sized, margin)
        for template in templates:
            _, similarity, _, corner = cv2.minMaxLoc(_correlate(view, template))
            if similarity > best.similarity:
                best = Match(sized.move((corner - margin) * step), similarity)
    return best


def _correlate(view: Image, template: Image) -> NDArray[np.float32]:
    """(h, w) similarity of a template to what lies in a view, by the corner of the box.

    Its correlation in parts; as a whole, where nothing hides it, it is the surer: the mean of both.
    """
    whole = _correlate_patch(view, template)
    height, width = whole.shape[0] + _PART_PX - 1, whole.shape[1] + _PART_PX - 1
    parts = np.zeros(whole.shape, np.float32)
    for y, x in _ORIGINS:
        part = template[y : y + _PART_PX, x : x + _PART_PX]
        parts += _correlate_patch(view[y : y + height, x : x + width], part) / len(_ORIGINS)
    similarity: NDArray[np.float32] = np.maximum(parts, 0.5 * (parts + whole))
    return similarity


def _correlate_patch(view: Image, patch: Image) -> NDArray[np.float32]:
    """(h, w) normalised correlation by the patch's corner; 0 where it would be less."""
    import cv2

    if patch.std() < _FLAT:
        return np.zeros(np.array(view.shape) - patch.shape + 1, np.float32)
    found = np.asarray(cv2.matchTemplate(view, patch, cv2.TM_CCOEFF_NORMED), dtype=np.float32)
    return found.clip(min=0.0)


def _cut(
    picture: Image, box: PictureBox, margin: NDArray[np.int_] | None = None, turn_deg: float = 0.0
) -> Image:
    """A picture where a box of it is SIZE_PX square, with a margin (2,) of more such pixels.

    The picture is turned about the box's middle first. Beyond the picture its rim goes on.
    """
    import cv2

    step = np.array([box.width, box.height]) / SIZE_PX
    blur_px = np.maximum(np.round(step), 1).astype(int).tolist()
    blurred = cv2.blur(picture, blur_px, borderType=cv2.BORDER_REPLICATE)
    size = np.full(2, SIZE_PX) if margin is None else SIZE_PX + 2 * margin
    cos, sin = np.cos(np.deg2rad(turn_deg)), np.sin(np.deg2rad(turn_deg))
    turned = np.array([[cos, sin], [-sin, cos]]) * step
    matrix = np.column_stack([turned, box.centre - turned @ (0.5 * (size - 1))])
    cut = cv2.warpAffine(
        blurred, matrix, size.tolist(),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    return np.asarray(cut, dtype=np.uint8)
