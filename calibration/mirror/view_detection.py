"""Board and pattern in the pictures of one view."""

from dataclasses import dataclass

from calibration.mirror.screen_pattern import find_pattern
from calibration.mirror.seen_views import DroppedView, Scene, SeenView
from calibration.targets.detection import Image, find_board


@dataclass(frozen=True, slots=True, eq=False)
class ViewPictures:
    """Grey pictures (H, W) of one view."""

    index: int  # number of the view
    # eye_site, eye_screen: of the eye's camera, with the display dark, and with the pattern on it;
    # one picture for both where they do not overlap.
    eye_site: Image
    eye_screen: Image
    # left, right: of the stereo cameras, at the same moment as eye_site.
    left: Image
    right: Image
    is_eye: bool = False  # the camera stood where the viewing eye will be


def find_view(scene: Scene, pictures: ViewPictures) -> SeenView | DroppedView:
    """The marks of a view; or what is not seen, and where."""
    boards = {
        name: find_board(getattr(pictures, name), scene.board)
        for name in ("eye_site", "left", "right")
    }
    missing = [name for name, seen in boards.items() if seen is None]
    found = find_pattern(pictures.eye_screen, scene.pattern)
    eye_site, left, right = boards.values()
    if eye_site is None or left is None or right is None:
        return DroppedView(pictures.index, f"the board is not seen in {' and '.join(missing)}")
    if found is None:
        return DroppedView(pictures.index, "the pattern is not seen in eye_screen")
    return SeenView(pictures.index, eye_site, left, right, *found, pictures.is_eye)
