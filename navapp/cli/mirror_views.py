"""Reads the views of a mirror's calibration: pictures of three cameras, and the eye's lens."""

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from navapp.cli.diagnostics import Diagnostics
from navapp.errors import InputError, RigError, SequenceError

if TYPE_CHECKING:
    from calibration.mirror.seen_views import DroppedView, Scene, SeenView
    from calibration.mirror.view_detection import ViewPictures
    from calibration.targets.boards import Board
    from calibration.targets.detection import Image
    from navapp.geometry.camera import Camera
    from navapp.geometry.rig import StereoRig

_SIDES = ("eye_site", "eye_screen", "left", "right")
_NAME = re.compile(
    rf"(?P<side>{'|'.join(_SIDES)})[_-]?(?P<number>\d+)\.(jpg|jpeg|png|bmp|tif|tiff)", re.IGNORECASE
)


def read_views(
    folder: str,
    board: "Board",
    rig: "StereoRig",
    display_size: tuple[int, int],
    eye_views: set[int],
    diagnostics: Diagnostics,
) -> "tuple[Scene, list[SeenView], list[DroppedView]]":
    """Find board and pattern in every view of a folder.

    Args:
        folder: of `eye_site_N`, `eye_screen_N`, `left_N` and `right_N`.
        board: at the site.
        rig: that took left and right.
        display_size: of its picture, px.
        eye_views: numbers of views whose camera stood where the eye will be.
        diagnostics: told of the progress.

    Raises:
        InputError: no such folder, pictures of several sizes, or not of the rig.
        SequenceError: no views, or some of which a picture is missing or damaged.
    """
    from calibration.mirror.screen_pattern import make_pattern
    from calibration.mirror.seen_views import Scene, SeenView
    from calibration.mirror.view_detection import find_view

    files = _find_files(Path(folder), eye_views)
    scene: Scene | None = None
    seen: list[SeenView] = []
    dropped: list[DroppedView] = []
    for place, (number, paths) in enumerate(sorted(files.items())):
        pictures = _load(number, paths, number in eye_views)
        if scene is None:
            size = (pictures.eye_site.shape[1], pictures.eye_site.shape[0])
            scene = Scene(board, make_pattern(*display_size, board), rig, size)
        _check_sizes(pictures, scene, folder)
        found = find_view(scene, pictures)
        if isinstance(found, SeenView):
            seen.append(found)
        else:
            dropped.append(found)
            diagnostics.warn(f"view {found.index} is not used: {found.reason}")
        diagnostics.progress("pictures", (place + 1) / len(files))
    assert scene is not None  # noqa: S101 (for the type checker: there is at least one view)
    return scene, seen, dropped


def read_lens(path: str, size: tuple[int, int]) -> "Camera":
    """The eye's camera from OpenCV's storage: camera_matrix, distortion_coefficients and size.

    Raises:
        InputError: missing, damaged, of another picture size, or with more than k1 k2 p1 p2.
    """
    import cv2

    from navapp.geometry.camera import Camera
    from navapp.geometry.sealed_storage import read_matrix, read_numbers

    problem = "does not exist"
    if Path(path).is_file():
        try:
            storage = cv2.FileStorage(path, cv2.FILE_STORAGE_READ)
            matrix = read_matrix(storage, "camera_matrix")
            distortion = read_matrix(storage, "distortion_coefficients")
            sizes = read_numbers(storage, ("image_width", "image_height"))
            given = (int(sizes["image_width"]), int(sizes["image_height"]))
            coefficients = np.zeros(4) if distortion is None else distortion.ravel()
            if given == size and not coefficients[4:].any():
                return Camera(matrix, coefficients[:4], *size)
            problem = f"is not of pictures of {size[0]}x{size[1]} px with k1 k2 p1 p2 alone"
        except (cv2.error, SystemError, ValueError, KeyError, TypeError):
            problem = "is damaged or lacks camera_matrix, image_width or image_height"
    raise InputError(
        f"lens file {path} {problem}",
        subject=path,
        remedy="leave --lens away: the eye's camera is then solved for",
    )


def _find_files(folder: Path, eye_views: set[int]) -> dict[int, dict[str, Path]]:
    """The four files of every view, by its number; those named as the eye's must be there."""
    if not folder.is_dir():
        raise InputError(
            f"folder {folder} does not exist",
            subject=str(folder),
            remedy="name the folder that holds the views (eye_site_0000.png, ...)",
        )
    files: dict[int, dict[str, Path]] = {}
    for path in sorted(folder.iterdir()):
        match = _NAME.fullmatch(path.name)
        if match is not None and path.is_file():
            files.setdefault(int(match["number"]), {})[match["side"].lower()] = path
    if not files:
        raise SequenceError(
            f"folder {folder} holds no views",
            subject=str(folder),
            remedy="its pictures must be named like eye_site_0000.png, eye_screen_0000.png, "
            "left_0000.png and right_0000.png",
        )
    for number, paths in sorted(files.items()):
        if missing := [side for side in _SIDES if side not in paths]:
            raise SequenceError(
                f"view {number} of {folder} has no {' and no '.join(missing)} picture",
                subject=str(folder),
                remedy="add it, or remove the other pictures of this view",
            )
    if unknown := sorted(eye_views - set(files)):
        raise InputError(
            f"folder {folder} has no view {', '.join(map(str, unknown))}",
            subject=str(folder),
            remedy="name views of the folder with --eye-views",
        )
    return files


def _load(number: int, paths: dict[str, Path], is_eye: bool) -> "ViewPictures":
    from calibration.mirror.view_detection import ViewPictures
    from drivers.recorded_sources import read_picture
    from navapp.geometry.rectification import luma

    grey: dict[str, Image] = {side: luma(read_picture(paths[side])) for side in _SIDES}
    return ViewPictures(number, **grey, is_eye=is_eye)


def _check_sizes(pictures: "ViewPictures", scene: "Scene", folder: str) -> None:
    for side in _SIDES:
        found = getattr(pictures, side).shape[1::-1]
        is_eye = side.startswith("eye")
        wanted = scene.eye_size if is_eye else (scene.rig.width, scene.rig.height)
        if found != wanted:
            kind = InputError if is_eye else RigError
            raise kind(
                f"picture {side} of view {pictures.index} in {folder} is {found[0]}x{found[1]}, "
                f"{wanted[0]}x{wanted[1]} is needed",
                subject=folder,
                remedy="give pictures of one camera at the eye, and of the rig's own cameras",
            )
