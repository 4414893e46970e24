"""Reads and rectifies the pair of `navapp stereo` and finds its disparity range."""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from navapp.errors import InputError, PriorError, UsageError

if TYPE_CHECKING:
    from navapp.geometry.rectification import RectifiedPair, Rectifier

Image = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class StereoPair:
    """A pair ready to be matched."""

    rectified: "RectifiedPair"  # grey pictures
    rectifier: "Rectifier | None"  # of the rig; None where the pair was taken as it is
    rectify_ms: float  # how long that took


def read_pair(options: argparse.Namespace) -> StereoPair:
    """The two pictures that are named.

    Raises:
        InputError: missing, damaged, or no pair of this rig.
    """
    return _rectify(_read(options.left), _read(options.right), options)


def _read(path: str) -> Image:
    """A picture, grey or colour; decoded from memory, which notices files that are cut short."""
    import cv2

    try:
        content = np.frombuffer(Path(path).read_bytes(), dtype=np.uint8)
    except OSError as error:
        raise InputError(
            f"picture {path} cannot be read ({error.strerror})",
            subject=path,
            remedy="give an existing picture",
        ) from error
    picture = cv2.imdecode(content, cv2.IMREAD_UNCHANGED) if content.size else None
    if picture is None or picture.dtype != np.uint8:
        raise InputError(
            f"picture {path} is damaged or not an 8-bit picture",
            subject=path,
            remedy="export it again as 8-bit PNG or JPEG",
        )
    return np.asarray(picture[..., :3] if picture.ndim == 3 else picture, dtype=np.uint8)


def _rectify(left: Image, right: Image, options: argparse.Namespace) -> StereoPair:
    """Both pictures grey and rectified; without a rig they are taken as they are."""
    import time

    from navapp.geometry.box import Box
    from navapp.geometry.rectification import RectifiedGeometry, RectifiedPair, Rectifier, luma
    from navapp.geometry.rig_files import read_rig
    from navapp.geometry.transform import RigidTransform

    if left.shape != right.shape:
        raise InputError(
            f"the pictures differ: {left.shape[1]}x{left.shape[0]} with {_channels(left)} channels "
            f"against {right.shape[1]}x{right.shape[0]} with {_channels(right)}",
            subject=options.right,
            remedy="give two pictures of one camera pair",
        )
    grey = luma(left), luma(right)
    height, width = grey[0].shape
    if options.rig is None:
        nowhere = RigidTransform.identity("left_rect", "left")
        geometry = RectifiedGeometry(1.0, 0.0, 0.0, 1.0, width, height, nowhere)
        pair = RectifiedPair(*grey, geometry, Box(0, 0, width, height))
        return StereoPair(pair, None, 0.0)
    rig = read_rig(options.rig)
    if (rig.width, rig.height) != (width, height):
        raise InputError(
            f"the pictures are {width}x{height}, rig {options.rig} is {rig.width}x{rig.height}",
            subject=options.rig,
            remedy="use the rig file that belongs to these pictures",
        )
    rectifier = Rectifier(rig)
    started = time.perf_counter()
    pair = rectifier.rectify(*grey)
    return StereoPair(pair, rectifier, (time.perf_counter() - started) * 1e3)


def find_band(pair: StereoPair, options: argparse.Namespace) -> tuple[float, float]:
    """Smallest and largest disparity, px: as asked for, else of the configured depth range.

    Raises:
        UsageError: they do not fit into the pictures.
    """
    from navapp.config import find_file, load

    geometry = pair.rectified.geometry
    if options.disparities is not None:
        low = float(options.min_disparity or 0)
        band = (low, low + options.disparities - 1.0)
    else:
        near, far = load(find_file(options.config)).camera.depth_mm
        band = (geometry.disparity_px(far), geometry.disparity_px(near))
    if max(-band[0], band[1]) >= geometry.width:
        raise UsageError(
            f"disparities {band[0]:.0f} to {band[1]:.0f} px do not fit into pictures "
            f"{geometry.width} px wide",
            remedy="ask for other --disparities or --min-disparity",
        )
    return band


def render_expected_px(pair: StereoPair, options: argparse.Namespace) -> NDArray[np.float32]:
    """(h, w) disparity of the expected surface over the whole rectified left view.

    Raises:
        PriorError: the pose's file.
        InputError: the model's file.
    """
    from navapp.geometry.ply import read_ply
    from navapp.geometry.transform import RigidTransform
    from navapp.geometry.zbuffer import render_rectified

    try:
        content = json.loads(Path(options.pose).read_text(encoding="utf-8"))
        pose = RigidTransform("left", "model", content["matrix"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise PriorError(
            f"pose {options.pose} cannot be understood",
            subject=options.pose,
            remedy='it holds {"matrix": [[4x4]]}',
        ) from error
    geometry = pair.rectified.geometry
    mesh, _ = read_ply(options.model)
    rectified_from_model = geometry.rectified_from_left @ pose
    view = render_rectified(mesh, rectified_from_model, geometry, pair.rectified.box)
    return geometry.disparity_map_px(view.depth_mm)


def _channels(picture: Image) -> int:
    return 1 if picture.ndim == 2 else picture.shape[2]
