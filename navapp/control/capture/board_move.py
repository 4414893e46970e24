"""How the board must be moved to where it is wanted, in words for who looks at the picture."""

from dataclasses import dataclass

import numpy as np

from navapp.geometry.transform import FloatArray, RigidTransform, vector_from_rotation

# Less than this is not worth a word; as near, the board is where it is wanted.
_LEAST_MM, _LEAST_DEG = 10.0, 5.0
_NEAR_SHARE, _NEAR_DEG = 0.06, 8.0
_MOST_PARTS = 3

# Along x, y, z of the left camera: right, down, away.
_SHIFTS = (("to the left", "to the right"), ("up", "down"), ("nearer", "farther away"))
_TURNS = (
    ("tilt its top away by {:.0f} deg", "tilt its bottom away by {:.0f} deg"),
    ("turn its right side away by {:.0f} deg", "turn its left side away by {:.0f} deg"),
    ("turn it counter-clockwise by {:.0f} deg", "turn it clockwise by {:.0f} deg"),
)


@dataclass(frozen=True, slots=True, eq=False)
class BoardMove:
    """From one pose to another."""

    shift_mm: FloatArray  # (3,) of the board's middle, along the left camera's axes
    turn_deg: FloatArray  # (3,) rotation vector, about the left camera's axes
    is_there: bool  # the move that is left is small enough

    def __str__(self) -> str:
        """The three largest parts; directions as seen in the left picture."""
        shifts = [
            (abs(mm) / _LEAST_MM, f"{abs(mm):.0f} mm {words[int(mm > 0.0)]}")
            for mm, words in zip(self.shift_mm, _SHIFTS, strict=True)
        ]
        turns = [
            (abs(deg) / _LEAST_DEG, words[int(deg > 0.0)].format(abs(deg)))
            for deg, words in zip(self.turn_deg, _TURNS, strict=True)
        ]
        # Always in the same order: words that change places cannot be followed.
        least = max(1.0, sorted(size for size, _ in shifts + turns)[-_MOST_PARTS])
        moves = ", ".join(text for size, text in shifts if size >= least)
        said = ([f"move it {moves}"] if moves else []) + [
            text for size, text in turns if size >= least
        ]
        return "; ".join(said) if said else "hold it still"


def find_move(
    now: RigidTransform, wanted: RigidTransform, middle_mm: FloatArray, slack: float = 1.0
) -> BoardMove:
    """How a board gets from one pose to another.

    Args:
        now: left camera from board.
        wanted: left camera from board.
        middle_mm: (3,) of the board, in its frame.
        slack: how much farther away still counts as there.
    """
    shift_mm = wanted.apply(middle_mm) - now.apply(middle_mm)
    turn_deg = np.degrees(vector_from_rotation(wanted.rotation @ now.rotation.T))
    near_mm = slack * _NEAR_SHARE * float(np.linalg.norm(wanted.apply(middle_mm)))
    is_turned = bool(np.linalg.norm(turn_deg) < slack * _NEAR_DEG)
    return BoardMove(shift_mm, turn_deg, is_turned and bool(np.linalg.norm(shift_mm) < near_mm))
