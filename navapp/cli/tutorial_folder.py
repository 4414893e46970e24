"""The folder of `navapp tutorial`: what its steps make, and which of them are done."""

import json
from dataclasses import dataclass
from pathlib import Path

from navapp.errors import InputError, UsageError
from navapp.geometry.whole_files import write_whole

# A board that fits on A4.
_BOARD = {
    "type": "charuco",
    "squares_x": 11,
    "squares_y": 8,
    "square_mm": 15.0,
    "marker_mm": 11.0,
    "dictionary": "DICT_4X4_100",
}
# Nobody's own configuration takes part.
_CONFIGURATION = """\
# Devices of the tutorial: all simulated.
[camera]
backend = "simulated"
# The simulator computes its pictures: few enough that a slow computer has time to follow the bone.
rate_hz = 6.0
"""


@dataclass(frozen=True, slots=True)
class TutorialFolder:
    """Paths of everything in it."""

    path: Path

    @property
    def configuration(self) -> Path:
        """Of all steps."""
        return self.path / "navapp.toml"

    @property
    def board(self) -> Path:
        """The printed board's description."""
        return self.path / "board.json"

    @property
    def rig(self) -> Path:
        """What step 2 makes."""
        return self.path / "rig.yml"

    @property
    def report(self) -> Path:
        """How good that is."""
        return self.path / "rig.html"

    @property
    def ct(self) -> Path:
        """Of the simulated patient."""
        return self.path / "ct.nii.gz"

    @property
    def contents(self) -> Path:
        """What is planned on the bones."""
        return self.path / "contents.toml"

    @property
    def plan(self) -> Path:
        """What step 3 makes."""
        return self.path / "plan"

    @property
    def _record(self) -> Path:
        return self.path / "tutorial.json"

    def begin(self) -> None:
        """Make it, or go on with one that was begun.

        Raises:
            UsageError: it holds something else.
            InputError: it cannot be written.
        """
        if self._holds_something_else():
            raise UsageError(
                f"{self.path} exists and is no folder of a tutorial",
                subject=str(self.path),
                remedy="name a new folder with --out",
            )
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            # The record first: by it the folder is known, whenever this is interrupted.
            if not self._record.is_file():
                self._write(set())
            board = json.dumps(_BOARD, indent=1) + "\n"
            for path, text in ((self.configuration, _CONFIGURATION), (self.board, board)):
                if not path.is_file():
                    write_whole(path, text.encode("utf-8"))
        except OSError as error:
            raise InputError(
                f"folder {self.path} cannot be written ({error.strerror})",
                subject=str(self.path),
                remedy="name one that you may write to with --out",
            ) from error

    def _holds_something_else(self) -> bool:
        if not self.path.exists() or self._record.is_file():
            return False
        return not self.path.is_dir() or any(self.path.iterdir())

    def read_done(self) -> set[int]:
        """Numbers of the steps that are done.

        Raises:
            InputError: the record is damaged.
        """
        try:
            done = json.loads(self._record.read_text(encoding="utf-8"))["done"]
            return {int(number) for number in done}
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(
                f"{self._record} cannot be read",
                subject=str(self._record),
                remedy="begin in a new folder with --out",
            ) from error

    def mark_done(self, number: int) -> None:
        """A step is done."""
        self._write(self.read_done() | {number})

    def _write(self, done: set[int]) -> None:
        text = json.dumps({"done": sorted(done)}) + "\n"
        write_whole(self._record, text.encode("utf-8"))

    def find_capture(self) -> Path:
        """A folder for pairs in which none is yet."""
        number, path = 1, self.path / "capture"
        while path.exists():
            number += 1
            path = self.path / f"capture_{number}"
        return path
