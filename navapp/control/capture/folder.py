"""The folder of a capture: every pair as soon as it is kept, the board beside them."""

import contextlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drivers.frames import Image, StereoFrame
from navapp.errors import InputError
from navapp.geometry.whole_files import write_whole

_BOARD = "board.json"


@dataclass(frozen=True, slots=True)
class CaptureFolder:
    """Where pairs are kept: left_0000.png, right_0000.png, ..., and board.json."""

    path: Path

    def begin(self, board: dict[str, Any]) -> None:
        """Make it, with the board's description in it.

        Raises:
            InputError: it cannot be written, or holds pairs already.
        """
        if self._holds_pictures():
            raise InputError(
                f"folder {self.path} already holds pictures",
                subject=str(self.path),
                remedy="name a new folder, or solve these with `navapp calibrate stereo`",
            )
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            write_whole(self.path / _BOARD, (json.dumps(board, indent=1) + "\n").encode())
        except OSError as error:
            raise self._refusal(error) from error

    def keep(self, index: int, frame: StereoFrame) -> None:
        """Write both pictures as they came.

        Raises:
            InputError: there is no room, or no right to.
        """
        try:
            for path, picture in zip(self._files(index), (frame.left, frame.right), strict=True):
                write_whole(path, _png(picture))
        except OSError as error:
            self.drop(index)
            raise self._refusal(error) from error

    def drop(self, index: int) -> None:
        """Delete both pictures of a pair."""
        for path in self._files(index):
            path.unlink(missing_ok=True)

    def discard_if_empty(self) -> None:
        """Remove it when no pair was kept, so that its name is free again."""
        if self._holds_pictures():
            return
        (self.path / _BOARD).unlink(missing_ok=True)
        # Whatever else lies there is not ours.
        with contextlib.suppress(OSError):
            self.path.rmdir()

    def _holds_pictures(self) -> bool:
        return any(self.path.glob("left[_-]*")) or any(self.path.glob("right[_-]*"))

    def _files(self, index: int) -> tuple[Path, Path]:
        return self.path / f"left_{index:04d}.png", self.path / f"right_{index:04d}.png"

    def _refusal(self, error: OSError) -> InputError:
        return InputError(
            f"folder {self.path} cannot be written ({error.strerror})",
            subject=str(self.path),
            remedy="name a folder that you may write to, with room in it",
        )


def _png(picture: Image) -> bytes:
    import cv2

    # Quickly rather than small: the picture goes on meanwhile.
    _, encoded = cv2.imencode(".png", picture, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    return bytes(encoded)
