"""What a camera at the eye's place and the stereo cameras saw at one instant."""

from dataclasses import dataclass

import numpy as np

from calibration.mirror.screen_pattern import ScreenPattern
from calibration.targets.boards import Board
from calibration.targets.detection import SeenBoard
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SeenView:
    """Marks of one place of the eye's camera, which stood still for all of its pictures."""

    index: int  # number of the view, as its files are called
    # the board at the site, in the pictures of the three cameras.
    eye_site: SeenBoard
    left: SeenBoard
    right: SeenBoard
    eye_screen: SeenBoard  # the pattern on the display, seen in the mirror
    is_mirrored: bool = True  # the pattern is seen with left and right exchanged
    is_eye: bool = False  # the camera stood where the viewing eye will be


@dataclass(frozen=True, slots=True)
class DroppedView:
    """A view that is not used, and why."""

    index: int
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """What all views have in common."""

    board: Board  # at the site
    pattern: ScreenPattern  # on the display
    rig: StereoRig
    eye_size: tuple[int, int]  # width and height of the eye's camera, px


@dataclass(frozen=True, slots=True, eq=False)
class Marks:
    """All marks of one kind over all views, in one table."""

    places: FloatArray  # (n, k) on the board, mm (k = 3), or in the display's picture, px (k = 2)
    view: np.ndarray  # (n,) which view saw it
    pixels: FloatArray  # (n, 2) where
    sigma_px: FloatArray  # (n,) standard error of a coordinate


# What no detector knows of itself: light that is not even, a board that is not flat.
_LEAST_SIGMA_PX = 0.03

KINDS = ("eye_screen", "eye_site", "left", "right")


def gather(scene: Scene, views: list[SeenView]) -> dict[str, Marks]:
    """The tables of all kinds of marks."""
    places = dict.fromkeys(KINDS, scene.board.points_mm)
    places["eye_screen"] = scene.pattern.pixels
    tables = {}
    for kind in KINDS:
        seen: list[SeenBoard] = [getattr(view, kind) for view in views]
        tables[kind] = Marks(
            np.vstack([places[kind][one.ids] for one in seen]),
            np.concatenate([np.full(len(one.ids), k) for k, one in enumerate(seen)]),
            np.vstack([one.pixels for one in seen]),
            np.hypot(np.concatenate([one.sigma_px for one in seen]), _LEAST_SIGMA_PX),
        )
    return tables
