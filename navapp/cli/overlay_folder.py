"""Writes overlay pictures to a folder that appears only when all of them are written."""

import shutil
import tempfile
from pathlib import Path
from types import TracebackType
from typing import Self

from navapp.control.frame_result import FrameResult
from navapp.errors import InputError

_JPEG_QUALITY = 92


class OverlayFolder:
    """Collects one picture a frame beside the folder, and moves them in when all went well.

    Raises:
        InputError: the folder cannot be made, or is a file.
    """

    def __init__(self, folder: str | Path) -> None:
        self._folder = Path(folder)
        self._n_pictures = 0
        try:
            if self._folder.exists() and not self._folder.is_dir():
                raise NotADirectoryError(20, "it is a file")
            self._folder.parent.mkdir(parents=True, exist_ok=True)
            self._unfinished = Path(
                tempfile.mkdtemp(dir=self._folder.parent, prefix=f".{self._folder.name}.")
            )
        except OSError as error:
            raise InputError(
                f"overlay folder {folder} cannot be written ({error.strerror})",
                subject=str(folder),
                remedy="choose another --overlay",
            ) from error

    def add(self, result: FrameResult) -> None:
        """Keep the picture of a frame."""
        import cv2

        quality = [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY]
        _, encoded = cv2.imencode(".jpg", result.picture.image, quality)
        name = f"overlay_{self._n_pictures:04d}.jpg"
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
