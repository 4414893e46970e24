"""Epipolar distances, and ratios of lengths on the board."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from calibration.targets.boards import Board
from calibration.targets.seen_pairs import SeenPair
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray
from navapp.geometry.triangulation import triangulate_mm


def compute_epipolar_px(rig: StereoRig, pairs: Sequence[SeenPair]) -> FloatArray:
    """(N,) signed distances of the right marks from the lines of the left ones, px."""
    rotation, t = rig.right_from_left.rotation, rig.right_from_left.translation_mm
    cross = np.array([[0.0, -t[2], t[1]], [t[2], 0.0, -t[0]], [-t[1], t[0], 0.0]])
    distances = []
    for pair in pairs:
        _, left, right = pair.common()
        lines = rig.left.rays(left) @ (cross @ rotation).T
        rays = rig.right.rays(right)
        distances.append(
            (lines * rays).sum(axis=1) / np.hypot(lines[:, 0], lines[:, 1]) * rig.right.focal_px
        )
    return np.concatenate(distances)


def compute_length_ratios(board: Board, rig: StereoRig, pairs: Sequence[SeenPair]) -> FloatArray:
    """Triangulated over true distance, for the far corners of what is seen of the board."""
    ratios = []
    for pair in pairs:
        ids, left, right = pair.common()
        if len(ids) < 4:
            continue
        true_mm, found_mm = board.points_mm[ids], triangulate_mm(rig, left, right)
        x, y = true_mm[:, 0], true_mm[:, 1]
        far = {
            int(np.argmin(x + y)),
            int(np.argmax(x + y)),
            int(np.argmin(x - y)),
            int(np.argmax(x - y)),
        }
        for i, j in combinations(sorted(far), 2):
            ratios.append(
                np.linalg.norm(found_mm[i] - found_mm[j]) / np.linalg.norm(true_mm[i] - true_mm[j])
            )
    return np.array(ratios)
