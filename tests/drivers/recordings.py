"""Small recordings for tests."""

from pathlib import Path

import cv2
import numpy as np

from drivers.frames import Image, StereoFrame

WIDTH, HEIGHT = 48, 32


def picture(number: int, eye: str, is_grey: bool = False) -> Image:
    """Flat enough to survive lossy compression; tells its number and its eye."""
    level = 10 * number + (5 if eye == "right" else 0)
    image = np.full((HEIGHT, WIDTH, 3), level, np.uint8)
    image[:, : WIDTH // 2, 0] = 100
    return np.ascontiguousarray(image[..., 1]) if is_grey else image


def number_of(image: Image) -> float:
    """Number and eye (x.0 left, x.5 right) of a picture."""
    channel = image if image.ndim == 2 else image[..., 1]
    return round(float(channel.mean()) / 5.0) / 2.0


def frame(number: int, captured_ns: int, skew_ns: int = 0) -> StereoFrame:
    left, right = picture(number, "left"), picture(number, "right")
    return StereoFrame(left, right, captured_ns, captured_ns, skew_ns, number, "rig")


def write_picture(path: Path, image: Image) -> None:
    assert cv2.imwrite(str(path), image)


def write_pairs(folder: Path, numbers: range | list[int], pattern: str = "{}_{:04d}.png") -> Path:
    folder.mkdir(exist_ok=True)
    for number in numbers:
        for eye in ("left", "right"):
            write_picture(folder / pattern.format(eye, number), picture(number, eye))
    return folder


def write_video(path: Path, eyes: tuple[str, ...], n_frames: int, rate_hz: float = 25.0) -> Path:
    """MJPG avi; two eyes stand side by side."""
    size = (WIDTH * len(eyes), HEIGHT)
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), rate_hz, size)
    assert writer.isOpened()
    for number in range(n_frames):
        writer.write(np.hstack([picture(number, eye) for eye in eyes]))
    writer.release()
    return path
