"""Composes a picture from the video, the layers of a scene and a banner."""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.display_model_view import EyeView
from navapp.geometry.transform import FloatArray
from navapp.overlay.colours import CANDIDATE, GUIDE, TARGET
from navapp.overlay.labels import LabelBoard, put_text, text_size
from navapp.overlay.painting import paint_layers
from navapp.overlay.scene import Scene
from navapp.overlay.strokes import draw_cross_px

Image = NDArray[np.uint8]

_MARK = "research - not for clinical use"
# In the mirror letters are 18 px high on a display of 1080 rows.
_MIRROR_TEXT_SIZE, _STRIP_SHARE = 0.85, 0.04
# Of a picture of 1280 columns.
_TEXT_SIZE, _LEAST_TEXT_SIZE = 0.7, 0.45
_RIM_PX = 12
# Of letters of size 1, with what hangs below the line.
_LETTER_PX, _BELOW_PX = 26, 12


def compose_video(
    left: Image,
    scene: Scene | None,
    banner: str,
    mark: str = "",
    cross_px: FloatArray | None = None,
) -> Image:
    """The left picture with guides, or without any when `scene` is None.

    Args:
        left: (H, W) or (H, W, 3) uint8, not rectified; not changed.
        scene: what to draw; None draws no guide.
        banner: one line at the top, for example why there are no guides.
        mark: further words for the corner, for example that the devices are simulated.
        cross_px: (2,) of a point to be marked.

    Raises:
        ValueError: a picture of another size than the scene's camera takes.
    """
    height, width = left.shape[:2]
    size, make_image = _text_size(width), partial(_copy_in_colour, left)
    if scene is None:
        image = make_image()
    elif (height, width) != (scene.camera.height, scene.camera.width):
        raise ValueError(f"the picture is not the camera's: {left.shape[:2]}")
    else:
        board = LabelBoard(_LEAST_TEXT_SIZE, text_boxes(width, height))
        image = paint_layers(make_image, scene, board)
    if cross_px is not None and np.isfinite(cross_px).all():
        draw_cross_px(image, cross_px, TARGET)
    is_guiding = scene is not None and not scene.is_candidate
    at = _RIM_PX, round(_RIM_PX + _LETTER_PX * size)
    put_text(image, banner, at, size, GUIDE if is_guiding else CANDIDATE)
    text = " - ".join(part for part in (mark, _MARK) if part)
    put_text(image, text, (_RIM_PX, height - _RIM_PX), 0.7 * size, (230, 230, 230))
    return image


def compose_mirror(
    scene: Scene | None,
    view: EyeView,
    status: str,
    *,
    is_guiding: bool,
    cross_px: FloatArray | None = None,
) -> Image:
    """The picture for a display seen in the half-silvered mirror: guides and status on black.

    Args:
        scene: seen from the calibrated eye; None draws no guide.
        view: of that eye; it turns the picture for the display.
        status: one line at the bottom.
        is_guiding: guides may be shown.
        cross_px: (2,) of a cross to be compared with its point, as the eye reads the picture.
    """
    height, width = view.camera.height, view.camera.width

    def make_image() -> Image:
        return np.zeros((height, width, 3), dtype=np.uint8)

    strip_px = round(_STRIP_SHARE * height)
    if scene is None:
        image = make_image()
    else:
        rims = [Box(0, height - strip_px, width, strip_px)]
        board = LabelBoard(_MIRROR_TEXT_SIZE * height / 1080.0, rims)
        image = paint_layers(make_image, scene, board)
    if cross_px is not None and np.isfinite(cross_px).all():
        draw_cross_px(image, cross_px, TARGET)
    size = _MIRROR_TEXT_SIZE * height / 1080.0
    colour = GUIDE if is_guiding else CANDIDATE
    put_text(image, status, (12, height - round(0.3 * strip_px)), size, colour)
    return view.to_display(image)


def _copy_in_colour(image: Image) -> Image:
    """A copy (H, W, 3) of a picture in grey or in colour."""
    return np.repeat(image[:, :, None], 3, axis=2) if image.ndim == 2 else image.copy()


def text_boxes(width: int, height: int) -> list[Box]:
    """Rows of a picture that belong to the banner and to the mark."""
    size = _text_size(width)
    banner_px = round(_RIM_PX + (_LETTER_PX + _BELOW_PX) * size)
    mark_px = round(_RIM_PX + 3 + 0.7 * _LETTER_PX * size)
    return [Box(0, 0, width, banner_px), Box(0, height - mark_px, width, mark_px)]


def _text_size(width: int) -> float:
    return max(_LEAST_TEXT_SIZE, _TEXT_SIZE * width / 1280.0)


def put_mark(image: Image, text: str) -> Image:
    """A copy of a picture with a line in its upper right corner."""
    marked = image.copy()
    size = max(_LEAST_TEXT_SIZE, 0.7 * _text_size(image.shape[1]))
    width, height = text_size(text, size)
    at = image.shape[1] - width - _RIM_PX, 10 + height
    put_text(marked, text, at, size, (230, 230, 230))
    return marked
