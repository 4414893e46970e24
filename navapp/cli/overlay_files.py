"""Writes the overlay of every frame: pictures in a folder, or a video; whole or not at all."""

import shutil
import tempfile
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from navapp.control.frame_result import FrameResult
from navapp.errors import InputError

Image = NDArray[np.uint8]

_JPEG_QUALITY = 92
_MARK = "not for clinical use"


class OverlayFolder:
    """Collects one picture a frame beside the folder, and moves them in when all went well.

    `overlay_00012_0003.jpg` is the thirteenth frame, and shows picture 3 of its sequence.

    Args:
        folder: for the pictures; what else is in it stays.
        is_lossless: PNG instead of JPEG.

    Raises:
        InputError: the folder cannot be made, or is a file.
    """

    def __init__(self, folder: str | Path, *, is_lossless: bool = False) -> None:
        self._folder = Path(folder)
        self._suffix = ".png" if is_lossless else ".jpg"
        self._n_pictures = 0
        try:
            if self._folder.exists() and not self._folder.is_dir():
                raise NotADirectoryError(20, "it is a file")
            self._folder.parent.mkdir(parents=True, exist_ok=True)
            self._unfinished = Path(
                tempfile.mkdtemp(dir=self._folder.parent, prefix=f".{self._folder.name}.")
            )
        except OSError as error:
            raise _cannot_write(
                "overlay folder", folder, str(error.strerror), "--overlay"
            ) from error

    def add(self, result: FrameResult) -> None:
        """Keep the picture of a frame."""
        import cv2

        quality = [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY] if self._suffix == ".jpg" else []
        is_encoded, encoded = cv2.imencode(self._suffix, result.picture.image, quality)
        if not is_encoded:
            raise _cannot_write(
                "overlay folder", self._folder, "no picture is encoded", "--overlay"
            )
        name = f"overlay_{self._n_pictures:05d}_{result.frame.index:04d}{self._suffix}"
        (self._unfinished / name).write_bytes(encoded.tobytes())
        self._n_pictures += 1

    def __enter__(self) -> Self:
        """Nothing more to do."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Move the pictures into place, or throw them away after an error."""
        if kind is None:
            self._folder.mkdir(exist_ok=True)
            for picture in sorted(self._unfinished.iterdir()):
                picture.replace(self._folder / picture.name)
        shutil.rmtree(self._unfinished, ignore_errors=True)


class OverlayVideo:
    """Encodes one picture a frame as MPEG-4, marked as not for clinical use.

    Args:
        path: ends in `.mp4`; replaced when all went well.
        rate_hz: pictures in a second.

    Raises:
        InputError: another ending, or the file cannot be written.
    """

    def __init__(self, path: str | Path, rate_hz: float) -> None:
        self._path = Path(path)
        if self._path.suffix.lower() != ".mp4":
            raise InputError(
                f"video {path} is not a .mp4", subject=str(path), remedy="name a .mp4 file"
            )
        self._rate_hz = rate_hz
        self._unfinished = self._path.with_name(f".{self._path.stem}.unfinished.mp4")
        try:
            if self._path.is_dir():
                raise IsADirectoryError(21, "it is a folder")
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._unfinished.write_bytes(b"")
        except OSError as error:
            raise _cannot_write("video", path, str(error.strerror), "--video") from error
        self._writer: Any = None

    def add(self, result: FrameResult) -> None:
        """Encode the picture of a frame."""
        image = _with_mark(result.picture.image)
        if self._writer is None:
            self._writer = self._open(image)
        self._writer.write(image)

    def _open(self, image: Image) -> Any:
        import cv2

        code = cv2.VideoWriter.fourcc(*"mp4v")
        size = image.shape[1], image.shape[0]
        writer = cv2.VideoWriter(str(self._unfinished), code, self._rate_hz, size)
        if not writer.isOpened():
            raise _cannot_write("video", self._path, "it cannot be encoded", "--video")
        return writer

    def __enter__(self) -> Self:
        """Nothing more to do."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Finish the file and move it into place, or throw it away after an error."""
        if self._writer is not None:
            self._writer.release()
        if kind is None and self._writer is not None:
            self._unfinished.replace(self._path)
        self._unfinished.unlink(missing_ok=True)


def _with_mark(image: Image) -> Image:
    """The picture with the mark in its upper right corner."""
    from navapp.overlay import put_mark

    return put_mark(image, _MARK)


def _cannot_write(what: str, path: str | Path, why: str, option: str) -> InputError:
    return InputError(
        f"{what} {path} cannot be written ({why})",
        subject=str(path),
        remedy=f"choose another {option}",
    )
