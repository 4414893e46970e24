"""The pictures of a session folder and their table, `frames.csv`."""

import csv
import io
import re
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from drivers.frames import Image, StereoFrame
from navapp.errors import InputError, SequenceError

TABLE_NAME = "frames.csv"

_COLUMNS = ("sequence", "captured_ns", "skew_ns", "left", "right")
_PICTURE = re.compile(r"(left|right)[_-]?\d+\.", re.IGNORECASE)
# Stronger compression takes several times as long and saves little on noisy pictures.
_PNG_LEVEL = 1


@dataclass(frozen=True, slots=True)
class FrameRow:
    """One line of `frames.csv`: times of a frame and its two files, None when not recorded."""

    sequence: int
    captured_ns: int
    skew_ns: int
    left: Path | None
    right: Path | None


class SessionWriter:
    """Writes frames as they come: first the pictures, then their line, each line flushed.

    A recording that breaks off therefore never names a picture that is not there. The folder may
    hold other files of the session, but no frames yet. A context manager.

    Raises:
        InputError: the folder already holds a session, or cannot be written.
    """

    def __init__(self, folder: str | Path) -> None:
        self._folder = Path(folder)
        self._n_bytes = 0
        path = self._folder / TABLE_NAME
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            has_pictures = any(_PICTURE.match(file.name) for file in self._folder.iterdir())
            if path.exists() or has_pictures:
                raise InputError(
                    f"folder {self._folder} already holds a session or pictures",
                    subject=str(self._folder),
                    remedy="record into a new folder",
                )
            self._table = path.open("x", encoding="utf-8", newline="")
            self._write_line(_COLUMNS)
        except OSError as error:
            raise _not_writable(self._folder, error) from error

    def __enter__(self) -> Self:
        """The writer itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close."""
        self.close()

    @property
    def n_bytes(self) -> int:
        """So many were written, pictures and table."""
        return self._n_bytes

    def add(self, frame: StereoFrame, with_pictures: bool) -> None:
        """Append a frame; its pictures become lossless PNG files named after its sequence.

        Raises:
            InputError: the folder cannot be written (any more).
        """
        names = ("", "")
        if with_pictures:
            names = (f"left_{frame.sequence:06d}.png", f"right_{frame.sequence:06d}.png")
        try:
            if with_pictures:
                for name, picture in zip(names, (frame.left, frame.right), strict=True):
                    self._n_bytes += (self._folder / name).write_bytes(_png(picture))
            self._write_line((frame.sequence, frame.captured_ns, frame.skew_ns, *names))
        except OSError as error:
            raise _not_writable(self._folder, error) from error

    def close(self) -> None:
        """Finish; nothing happens when closed."""
        self._table.close()

    def _write_line(self, values: tuple[int | str, ...]) -> None:
        self._n_bytes += self._table.write(",".join(str(value) for value in values) + "\n")
        self._table.flush()


def read_frame_table(folder: str | Path) -> tuple[FrameRow, ...]:
    """Every line of a session's `frames.csv`; whether the files exist is not looked at.

    Raises:
        SequenceError: no such table, a broken line, times or numbers that go back.
    """
    path = Path(folder) / TABLE_NAME
    try:
        text = path.read_bytes().decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise _make_damage_error(
            path, "cannot be read", "give the folder of a recorded session"
        ) from error
    lines = list(csv.reader(io.StringIO(text)))
    if not lines or tuple(lines[0]) != _COLUMNS:
        raise _make_damage_error(
            path, "has no header", f"its first line must be {','.join(_COLUMNS)}"
        )
    rows: list[FrameRow] = []
    for number, values in enumerate(lines[1:], 2):
        is_cut = number == len(lines) and not text.endswith("\n")
        row = None if is_cut else _row(path.parent, values)
        if row is None:
            problem = "breaks off in" if number == len(lines) else "is damaged in"
            raise _make_damage_error(path, f"{problem} line {number}", "delete that line")
        # A stalled camera hands out new frames with an old capture time.
        is_later = not rows or row.captured_ns >= rows[-1].captured_ns
        if not is_later or (rows and row.sequence <= rows[-1].sequence):
            raise _make_damage_error(path, f"goes backwards in line {number}", "delete that line")
        rows.append(row)
    return tuple(rows)


def _row(folder: Path, values: list[str]) -> FrameRow | None:
    """A line's values; None when they are not those of a frame."""
    if len(values) != len(_COLUMNS) or (values[3] == "") != (values[4] == ""):
        return None
    # Names only: a table must not lead out of its folder.
    if any(Path(name).name != name for name in values[3:]):
        return None
    try:
        sequence, captured_ns, skew_ns = (int(value) for value in values[:3])
    except ValueError:
        return None
    if values[3] == "":
        return FrameRow(sequence, captured_ns, skew_ns, None, None)
    return FrameRow(sequence, captured_ns, skew_ns, folder / values[3], folder / values[4])


def _png(picture: Image) -> bytes:
    import cv2

    is_done, data = cv2.imencode(".png", picture, [cv2.IMWRITE_PNG_COMPRESSION, _PNG_LEVEL])
    if not is_done:
        raise OSError("the picture cannot be encoded as PNG")
    return data.tobytes()


def _not_writable(folder: Path, error: OSError) -> InputError:
    return InputError(
        f"session folder {folder} cannot be written ({error.strerror or error})",
        subject=str(folder),
        remedy="choose a folder on a disk with room and permission",
    )


def _make_damage_error(path: Path, problem: str, remedy: str) -> SequenceError:
    return SequenceError(f"frame table {path} {problem}", subject=str(path), remedy=remedy)
