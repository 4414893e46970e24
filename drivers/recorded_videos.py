"""Recorded stereo pairs in videos: one for each eye, or one with both side by side."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from drivers.frames import Image
from drivers.recorded_sources import RecordedTimes
from navapp.errors import SequenceError

# Some containers hold a duration only, and the count that follows from it is a little too long.
_COUNT_TOLERANCE = 2
_HIGHEST_RATE_HZ = 1000.0


class StereoVideo:
    """The frames of two videos, or of one that is split down the middle.

    Raises:
        SequenceError: a video that cannot be read or ends too early, two of different lengths.
    """

    times: tuple[RecordedTimes, ...] | None = None

    def __init__(self, paths: Sequence[Path]) -> None:
        """Open and count.

        Args:
            paths: left and right, or one video with both side by side.
        """
        self._videos: list[_Video] = []
        try:
            for path in paths:
                self._videos.append(_Video(path))
            counts = [video.n_frames for video in self._videos]
            if len(set(counts)) > 1:
                raise SequenceError(
                    f"videos {paths[0]} and {paths[1]} differ in length: "
                    f"{counts[0]} against {counts[1]} frames",
                    subject=str(paths[1]),
                    remedy="cut both to the same frames",
                )
        except BaseException:
            self.close()
            raise
        self.name = ",".join(path.name for path in paths)
        self.numbers = tuple(range(counts[0]))
        self.rate_hz = self._videos[0].rate_hz

    def load(self, place: int) -> tuple[Image, Image]:
        """Frame number `place` of both eyes."""
        pictures = [video.read(place) for video in self._videos]
        if len(pictures) == 2:
            return pictures[0], pictures[1]
        half, odd = divmod(pictures[0].shape[1], 2)
        if odd:
            raise SequenceError(
                f"video {self.name} has an odd width and cannot be split side by side",
                subject=self.name,
                remedy="give two videos LEFT,RIGHT instead",
            )
        left, right = pictures[0][:, :half], pictures[0][:, half:]
        return np.ascontiguousarray(left), np.ascontiguousarray(right)

    def close(self) -> None:
        """Release the videos."""
        for video in self._videos:
            video.close()


class _Video:
    """One video, read frame by frame or from anywhere."""

    def __init__(self, path: Path) -> None:
        import cv2

        self._path = path
        if not path.is_file():
            raise self._error("does not exist", "check the path")
        self._capture = cv2.VideoCapture(str(path))
        self._next = 0
        if not self._capture.isOpened():
            raise self._error("cannot be opened", "restore it or convert it to another format")
        rate_hz = float(self._capture.get(cv2.CAP_PROP_FPS))
        self.rate_hz = rate_hz if 0.0 < rate_hz <= _HIGHEST_RATE_HZ else None
        try:
            self.n_frames = self._count()
        except BaseException:
            self.close()
            raise

    def read(self, number: int) -> Image:
        """Decode a frame (H, W, 3); going on in order is fastest."""
        self._seek(number)
        is_read, picture = self._capture.read()
        self._next += 1
        if not is_read or picture is None:
            self._next = -1
            raise self._error(f"is damaged at frame {number}", "restore it or cut it there")
        return np.asarray(picture, dtype=np.uint8)

    def close(self) -> None:
        """Release the file."""
        self._capture.release()

    def _seek(self, number: int) -> None:
        import cv2

        if number != self._next:
            self._capture.set(cv2.CAP_PROP_POS_FRAMES, number)
            self._next = number

    def _count(self) -> int:
        """Number of frames: what the container says when its last frame is there, else counted."""
        import cv2

        told = int(self._capture.get(cv2.CAP_PROP_FRAME_COUNT))
        self._seek(max(0, told - 1))
        is_there = told > 0 and self._capture.grab()
        self._next = -1
        if is_there:
            return told
        self._capture.release()  # a decoder that failed once may not find back
        self._capture = cv2.VideoCapture(str(self._path))
        counted = 0
        while self._capture.grab():
            counted += 1
        self._next = -1
        if counted == 0:
            raise self._error("holds no frames", "restore it or convert it to another format")
        if counted < told - _COUNT_TOLERANCE:
            raise self._error(
                f"is truncated: {counted} of {told} frames are there", "restore it or convert it"
            )
        return counted

    def _error(self, problem: str, remedy: str) -> SequenceError:
        path = self._path
        return SequenceError(f"video {path} {problem}", subject=str(path), remedy=remedy)
