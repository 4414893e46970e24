"""Where the board is in both pictures of a frame."""

from dataclasses import dataclass

from calibration.targets.boards import Board
from calibration.targets.detection import SeenBoard, find_board
from calibration.targets.seen_pairs import SeenPair
from drivers.frames import StereoFrame
from navapp.geometry.bands import begin_on_helper
from navapp.geometry.rectification import luma


@dataclass(frozen=True, slots=True, eq=False)
class BoardView:
    """What one frame shows of the board."""

    frame: StereoFrame  # that shows it
    # left, right: None where the board is not seen.
    left: SeenBoard | None
    right: SeenBoard | None

    def to_pair(self, index: int) -> SeenPair | None:
        """As a pair of that number; None when a camera does not see the board."""
        if self.left is None or self.right is None:
            return None
        return SeenPair(index, self.left, self.right)


def detect_board(frame: StereoFrame, board: Board) -> BoardView:
    """Find the board in both pictures, at the same time."""
    with begin_on_helper(lambda: find_board(luma(frame.right), board)) as right:
        left = find_board(luma(frame.left), board)
        return BoardView(frame, left, right.result())
