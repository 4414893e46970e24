"""Which pixels have no partner in the other view, and why.

In the left view a border occlusion is the strip that the right camera does not see; an interior
occlusion stands left of something nearer, and no right pixel maps to it; the rest of the unmatched
pixels are mismatches. The class decides from which side a pixel may be filled. Matches at the left
edge of something nearer that look like what is behind it are interior occlusions, too: a matching
window hangs over the edge.
"""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import in_two_shares
from navapp.stereo.occlusion.classify_kernels import (
    class_rows,
    find_begins,
    mark_seen,
    project_rows,
)
from navapp.values import DisparityMap


def classify(
    left: DisparityMap,
    right_px: NDArray[np.float32],
    right_x0: int,
    picture_width: int,
    picture: NDArray[np.uint8],
) -> NDArray[np.uint8]:
    """Class of every pixel that is not, or not believably, matched.

    Args:
        left: of the left view.
        right_px: (h, W) float32 disparity of the right view in the same rows, NaN where unknown.
        right_x0: column of its first pixel in the rectified right picture.
        picture_width: of the rectified pictures.
        picture: (h, w) rectified grey left picture over the map: tells what looks alike.

    Returns:
        (h, w) 0 where the match stands and outside the picture, else the `Origin` that a filled
        pixel gets. A class on a matched pixel withdraws that match.

    Raises:
        ValueError: another number of rows, or a picture of another size.

    Source: the paper, section 3.2 (border and non-border occlusions); withdrawn matches are ours.
    """
    shape = left.disparity_px.shape
    if right_px.shape[0] != shape[0]:
        raise ValueError("classify needs both views over the same rows")
    if picture.shape != shape:
        raise ValueError("classify needs a grey picture of the map's size")
    disparity = np.ascontiguousarray(left.disparity_px, dtype=np.float32)
    origin = np.ascontiguousarray(left.origin)
    right_px = np.ascontiguousarray(right_px, dtype=np.float32)
    seen, begins = np.empty(shape, dtype=bool), np.empty(shape[0], dtype=np.int64)
    in_two_shares(lambda *rows: mark_seen(right_px, right_x0 - left.x, *rows, seen))
    find_begins(disparity, origin, left.x, begins)
    classes = np.empty(shape, dtype=np.uint8)
    picture = np.ascontiguousarray(picture)
    known = disparity, origin, begins, seen, picture
    in_two_shares(lambda *rows: class_rows(*known, *rows, classes))
    classes[:, : max(-left.x, 0)] = 0
    classes[:, max(picture_width - left.x, 0) :] = 0
    return classes


def project_to_right(
    left_px: NDArray[np.float32], left_x: int, picture_width: int
) -> NDArray[np.float32]:
    """(h, W) disparity of the right view of a surface known in the left one; NaN where unseen.

    Args:
        left_px: (h, w) float32 disparity of the left view, NaN where there is no surface.
        left_x: its first column in the left picture.
        picture_width: W.
    """
    left_px = np.ascontiguousarray(left_px, dtype=np.float32)
    right_px = np.empty((left_px.shape[0], picture_width), dtype=np.float32)
    in_two_shares(lambda *rows: project_rows(left_px, left_x, *rows, right_px))
    return right_px
