"""Composes a picture from the video, the layers of a stage and a banner."""

import numpy as np
from numpy.typing import NDArray

from navapp.overlay.layers import GUIDE_COLOUR, LAYERS, Scene, put_text

Image = NDArray[np.uint8]

PREVIEW_WIDTH, PREVIEW_HEIGHT = 160, 96

_AMBER = (40, 180, 255)
_MARK = "research - not for clinical use"


def compose_video(left: Image, scene: Scene | None, banner: str, mark: str = "") -> Image:
    """The left picture with guides, or without any when `scene` is None.

    Args:
        left: (H, W) or (H, W, 3) uint8, not rectified; not changed.
        scene: what to draw; None draws no guide.
        banner: one line at the top, for example why there are no guides.
        mark: further words for the corner, for example that the devices are simulated.

    Raises:
        ValueError: a picture of another size than the scene's camera takes.
    """
    image = np.repeat(left[:, :, None], 3, axis=2) if left.ndim == 2 else left.copy()
    if scene is not None:
        if image.shape[:2] != (scene.camera.height, scene.camera.width):
            raise ValueError(f"the picture is not the camera's: {image.shape[:2]}")
        for name in scene.stage.layers:
            layer = LAYERS.get(name)
            if layer is not None:
                layer(image, scene)
    is_guiding = scene is not None and not scene.is_candidate
    scale = image.shape[1] / 1280.0
    size = max(0.45, 0.7 * scale)
    put_text(
        image, banner, (12, round(12 + 26 * size)), size, GUIDE_COLOUR if is_guiding else _AMBER
    )
    text = " - ".join(part for part in (mark, _MARK) if part)
    put_text(image, text, (12, image.shape[0] - 12), 0.7 * size, (230, 230, 230))
    return image


def make_preview(image: Image) -> Image:
    """The picture for the terminal: at most 160x96, area mean, aspect ratio kept."""
    import cv2

    height, width = image.shape[:2]
    factor = min(PREVIEW_WIDTH / width, PREVIEW_HEIGHT / height, 1.0)
    size = (max(1, round(width * factor)), max(1, round(height * factor)))
    small = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    small.setflags(write=False)
    return small
