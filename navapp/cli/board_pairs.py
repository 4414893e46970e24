"""Reads a folder of picture pairs and finds the board in both pictures of each."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from navapp.cli.diagnostics import Diagnostics
from navapp.errors import InputError, SequenceError

if TYPE_CHECKING:
    from calibration.rig.dropped_pairs import DroppedPair
    from calibration.targets.boards import Board
    from calibration.targets.seen_pairs import SeenPair
    from drivers.recorded_sources import PictureFiles


@dataclass(frozen=True, slots=True, eq=False)
class BoardPairs:
    """The board in the pictures of a folder."""

    seen: "list[SeenPair]"  # pairs that show the board, by their numbers
    unseen: "list[DroppedPair]"  # those that do not, and in which picture
    size: tuple[int, int]  # width and height of every picture, px


def read_pairs(folder: str, board: "Board", diagnostics: Diagnostics) -> BoardPairs:
    """Find a board in every picture of a folder.

    Raises:
        InputError: no such folder, no pairs, a damaged picture, mixed sizes.
        SequenceError: unequal counts.
    """
    from drivers.recorded_sources import open_folder

    if not Path(folder).is_dir():
        raise InputError(
            f"folder {folder} does not exist",
            subject=folder,
            remedy="name the folder that holds the pairs (left_0000.png, right_0000.png, ...)",
        )
    source = open_folder(Path(folder))
    seen: list[SeenPair] = []
    unseen: list[DroppedPair] = []
    size: tuple[int, int] | None = None
    with ThreadPoolExecutor(1) as beside:
        for place, number in enumerate(source.numbers):
            found, size = _look(source, place, board, size, beside)
            (seen if hasattr(found, "left") else unseen).append(found)  # type: ignore[arg-type]
            diagnostics.progress("pictures", (place + 1) / len(source.numbers))
            diagnostics.detail(f"pair {number}: {_describe(found)}")
    if size is None:
        raise SequenceError(f"folder {folder} holds no pairs", subject=folder, remedy="add some")
    return BoardPairs(seen, unseen, size)


def _look(
    source: "PictureFiles",
    place: int,
    board: "Board",
    size: tuple[int, int] | None,
    beside: ThreadPoolExecutor,
) -> "tuple[SeenPair | DroppedPair, tuple[int, int]]":
    """One pair: both pictures at once."""
    from calibration.rig.dropped_pairs import DroppedPair, Fault
    from calibration.targets.detection import find_board
    from calibration.targets.seen_pairs import SeenPair
    from navapp.geometry.rectification import luma

    number = source.numbers[place]
    grey = [luma(picture) for picture in source.load(place)]
    for picture, path in zip(grey, (source.left[place], source.right[place]), strict=True):
        found = (picture.shape[1], picture.shape[0])
        if found != (size or found):
            raise InputError(
                f"picture {path} is {found[0]}x{found[1]}, those before are {size[0]}x{size[1]}",  # type: ignore[index]
                subject=str(path),
                remedy="give pictures of one pair of cameras, all of one size",
            )
        size = found
    right = beside.submit(find_board, grey[1], board)
    left = find_board(grey[0], board)
    views = {"left": left, "right": right.result()}
    missing = [side for side, view in views.items() if view is None]
    if views["left"] is None or views["right"] is None:
        where = f"{' and '.join(missing)} picture{'s' if len(missing) > 1 else ''}"
        reason = f"the board is not seen in the {where}"
        return DroppedPair(number, Fault.NOT_SEEN, reason), size  # type: ignore[return-value]
    return SeenPair(number, views["left"], views["right"]), size  # type: ignore[return-value]


def _describe(found: "SeenPair | DroppedPair") -> str:
    reason = getattr(found, "reason", None)
    return str(reason) if reason else f"{len(found.left.ids)} and {len(found.right.ids)} marks"  # type: ignore[union-attr]
