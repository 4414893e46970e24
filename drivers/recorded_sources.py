"""Recorded stereo pairs in folders of pictures and session folders, by index."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from drivers.frames import Image
from drivers.session_files import TABLE_NAME, read_frame_table
from navapp.errors import SequenceError

_PICTURE_NAME = re.compile(
    r"(?P<side>left|right)[_-]?(?P<number>\d+)\.(jpg|jpeg|png|bmp|tif|tiff)", re.IGNORECASE
)
_NAMED_AT_MOST = 5


@dataclass(frozen=True, slots=True)
class RecordedTimes:
    """When a pair was taken."""

    captured_ns: int
    skew_ns: int


class RecordedSource(Protocol):
    """Recorded pairs that can be loaded in any order."""

    @property
    def name(self) -> str:
        """For people."""
        ...

    @property
    def numbers(self) -> tuple[int, ...]:
        """Number of each picture, strictly increasing."""
        ...

    @property
    def times(self) -> tuple[RecordedTimes, ...] | None:
        """Of each pair; None when the source has none."""
        ...

    @property
    def rate_hz(self) -> float | None:
        """Rate of the source; None when it does not say."""
        ...

    def load(self, place: int) -> tuple[Image, Image]:
        """The pair at that place (0 is the first).

        Raises:
            SequenceError: a picture is missing or damaged.
        """
        ...

    def close(self) -> None:
        """Release what `load` holds open."""
        ...


@dataclass(frozen=True, slots=True)
class PictureFiles:
    """Pairs of picture files."""

    name: str
    numbers: tuple[int, ...]
    left: tuple[Path, ...]
    right: tuple[Path, ...]
    times: tuple[RecordedTimes, ...] | None = None
    rate_hz: float | None = None

    def load(self, place: int) -> tuple[Image, Image]:
        """Decode both files of a pair."""
        return read_picture(self.left[place]), read_picture(self.right[place])

    def close(self) -> None:
        """Nothing is held open."""


def open_folder(folder: Path) -> PictureFiles:
    """A session folder, or a plain folder of pairs; cheap checks of all files, nothing decoded.

    Raises:
        SequenceError: no pairs, unpaired numbers, missing or empty files, a damaged table.
    """
    source = _session(folder) if (folder / TABLE_NAME).exists() else _plain(folder)
    _check_files((*source.left, *source.right))
    return source


def read_picture(path: Path) -> Image:
    """A grey (H, W) or BGR (H, W, 3) picture as it is stored: not turned by any EXIF tag.

    Raises:
        SequenceError: missing, truncated or no picture at all.
    """
    import cv2

    try:
        data = np.frombuffer(path.read_bytes(), np.uint8)
    except OSError as error:
        raise _unusable(path, "cannot be read") from error
    # Decoded from memory: OpenCV fills up a truncated JPEG file with grey, without a word.
    flags = cv2.IMREAD_ANYCOLOR | cv2.IMREAD_IGNORE_ORIENTATION
    picture = cv2.imdecode(data, flags) if data.size else None
    if picture is None:
        raise _unusable(path, "is damaged, truncated or no picture")
    return np.asarray(picture, dtype=np.uint8)


def _plain(folder: Path) -> PictureFiles:
    files: dict[str, dict[int, Path]] = {"left": {}, "right": {}}
    for path in sorted(folder.iterdir()):
        match = _PICTURE_NAME.fullmatch(path.name)
        if match is None or not path.is_file():
            continue
        side, number = files[match["side"].lower()], int(match["number"])
        if number in side:
            raise SequenceError(
                f"folder {folder} has two pictures number {number}: {side[number].name} "
                f"and {path.name}",
                subject=str(folder),
                remedy="remove one of them",
            )
        side[number] = path
    if not files["left"] and not files["right"]:
        raise SequenceError(
            f"folder {folder} holds no stereo pairs",
            subject=str(folder),
            remedy="its pictures must be named like left_0000.png and right_0000.png",
        )
    odd = [
        f"{side} {_list_text(files[side].keys() - files[other].keys())}"
        for side, other in (("left", "right"), ("right", "left"))
        if files[side].keys() - files[other].keys()
    ]
    if odd:
        raise SequenceError(
            f"folder {folder} has pictures without a partner: {' and '.join(odd)}",
            subject=str(folder),
            remedy="add the other picture of each pair or remove the odd ones",
        )
    numbers = tuple(sorted(files["left"]))
    return PictureFiles(
        folder.name,
        numbers,
        tuple(files["left"][number] for number in numbers),
        tuple(files["right"][number] for number in numbers),
    )


def _session(folder: Path) -> PictureFiles:
    rows = read_frame_table(folder)
    pairs = [
        (row, row.left, row.right) for row in rows if row.left is not None and row.right is not None
    ]
    if not pairs:
        raise SequenceError(
            f"session {folder} holds no pictures",
            subject=str(folder),
            remedy="record it with pictures",
        )
    return PictureFiles(
        folder.name,
        tuple(row.sequence for row, _, _ in pairs),
        tuple(left for _, left, _ in pairs),
        tuple(right for _, _, right in pairs),
        tuple(RecordedTimes(row.captured_ns, row.skew_ns) for row, _, _ in pairs),
    )


def _check_files(paths: Iterable[Path]) -> None:
    for path in paths:
        if not path.is_file():
            raise _unusable(path, "is missing")
        if path.stat().st_size == 0:
            raise _unusable(path, "is empty")


def _unusable(path: Path, problem: str) -> SequenceError:
    return SequenceError(
        f"picture {path} {problem}",
        subject=str(path),
        remedy="restore it, or remove this pair from the sequence",
    )


def _list_text(numbers: Iterable[int]) -> str:
    """The smallest numbers, and how many more there are."""
    ordered = sorted(numbers)
    text = ", ".join(str(number) for number in ordered[:_NAMED_AT_MOST])
    more = len(ordered) - _NAMED_AT_MOST
    return f"{text} and {more} more" if more > 0 else text
