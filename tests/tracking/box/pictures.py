"""Small drawn pictures of something that can be followed."""

import cv2
import numpy as np

from navapp.tracking.box.picture_box import PictureBox

SHAPE = (180, 320)
BOX = PictureBox(120.0, 50.0, 64.0, 76.0)


def texture(shape: tuple[int, int], sigma: float, deviation: float, seed: int) -> np.ndarray:
    noise = np.random.default_rng(seed).standard_normal(shape)
    smooth = cv2.GaussianBlur(noise, (0, 0), sigma)
    return deviation * smooth / smooth.std()


def scene(
    shift=(0.0, 0.0),
    scale: float = 1.0,
    gain: float = 1.0,
    hidden_fraction: float = 0.0,
    seed: int = 0,
) -> np.ndarray:
    """A patterned box on a duller ground; a bright hand may lie over its lower part."""
    picture = 70.0 + texture(SHAPE, 6.0, 8.0, 1) + texture(SHAPE, 1.5, 2.0, 2)
    size = (int(BOX.height), int(BOX.width))
    thing = 130.0 + texture(size, 4.0, 30.0, 3) + texture(size, 1.5, 12.0, 4)
    matrix = np.array([[scale, 0.0, 0.0], [0.0, scale, 0.0]])
    box = box_at(shift, scale)
    matrix[:, 2] = box.x, box.y
    mask = cv2.warpAffine(np.ones(size), matrix, SHAPE[::-1])
    picture += mask * (cv2.warpAffine(thing, matrix, SHAPE[::-1], borderMode=1) - picture)
    top = int(box.y + (1.0 - hidden_fraction) * box.height)
    if hidden_fraction > 0.0:
        hand = 190.0 + texture(SHAPE, 4.0, 18.0, 5)
        columns = slice(max(0, int(box.x) - 20), int(box.x + box.width) + 20)
        picture[top : top + 70, columns] = hand[top : top + 70, columns]
    picture += np.random.default_rng(seed).normal(0.0, 0.7, SHAPE)
    return np.clip(gain * picture, 0.0, 255.0).astype(np.uint8)


def box_at(shift=(0.0, 0.0), scale: float = 1.0) -> PictureBox:
    return BOX.move(np.array(shift), scale)


def turned(picture: np.ndarray, box: PictureBox, turn_deg: float) -> np.ndarray:
    """A picture turned about a box's middle."""
    matrix = cv2.getRotationMatrix2D(box.centre.tolist(), turn_deg, 1.0)
    return cv2.warpAffine(picture, matrix, SHAPE[::-1], borderMode=cv2.BORDER_REPLICATE)


def empty(seed: int = 0) -> np.ndarray:
    """The ground alone, and a hand on it."""
    return scene(shift=(-3000.0, 0.0), seed=seed)


def clutter(sigma: float, deviation: float, seed: int) -> np.ndarray:
    """Another pattern all over the picture."""
    return np.clip(110.0 + texture(SHAPE, sigma, deviation, seed), 0.0, 255.0).astype(np.uint8)


def enlarged(picture: np.ndarray) -> np.ndarray:
    """As a camera takes it, four times as large."""
    return cv2.resize(picture, None, fx=4.0, fy=4.0, interpolation=cv2.INTER_CUBIC)
