"""Other people's trackers, each wrapped so that it follows a bone from pair to pair.

A peer gets the rig, the surface of the bone that is left and the pose in the first pair, and then
one pair after the other. It has no registration, no judge and no truth; without a pose in a pair it
goes on from the last one that it had.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import cv2
import numpy as np

from drivers.frames import StereoFrame
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import RectifiedGeometry, luma, rectifier_of
from navapp.geometry.rig import StereoRig
from navapp.geometry.simplify import drawn
from navapp.geometry.transform import FloatArray, RigidTransform
from tests.bench.peer_stereo import StereoSettings, find_points_mm
from tests.bench.peer_visp import PROGRAM, VispTracker

# A pair to the pose of the bone in the left camera; None: it has none.
Follow = Callable[[StereoFrame], RigidTransform | None]
# Rig, surface of the bone, first pair and the pose in it.
Peer = Callable[[StereoRig, TriangleMesh, StereoFrame, RigidTransform], Follow]
# Points of the scene in the bone, where it was, to the motion that takes them onto its surface.
_Fit = Callable[[FloatArray], FloatArray]

_LEAST_POINTS, _LEAST_EDGES = 100, 12


@dataclass(frozen=True, slots=True)
class IcpSettings:
    """Rounds of iterative closest points, one after the other."""

    radii_mm: Sequence[float]  # of pairs, of each round
    losses_mm: Sequence[float] = ()  # of Tukey's weights, of each round; where there are any
    most_steps: int = 50


def make_open3d(stereo: StereoSettings, icp: IcpSettings) -> Peer:
    """Point-to-plane ICP of Open3D."""
    import open3d

    library = open3d.pipelines.registration

    def prepare(surface: TriangleMesh) -> _Fit:
        target = open3d.geometry.PointCloud(
            open3d.utility.Vector3dVector(np.array(surface.vertices_mm))
        )
        target.normals = open3d.utility.Vector3dVector(np.array(surface.normals))

        def fit(points_mm: FloatArray) -> FloatArray:
            source = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points_mm))
            motion = np.eye(4)
            for radius_mm, loss_mm in zip(icp.radii_mm, icp.losses_mm, strict=True):
                found = library.registration_icp(
                    source, target, radius_mm, motion,
                    library.TransformationEstimationPointToPlane(library.TukeyLoss(k=loss_mm)),
                    library.ICPConvergenceCriteria(1e-6, 1e-6, icp.most_steps),
                )  # fmt: skip
                motion = found.transformation
            return np.array(motion)

        return fit

    return _make_icp(stereo, prepare)


def make_gicp(stereo: StereoSettings, icp: IcpSettings) -> Peer:
    """Generalised ICP of small_gicp."""
    import small_gicp

    n_neighbours, n_threads = 10, 2

    def prepare(surface: TriangleMesh) -> _Fit:
        target = small_gicp.PointCloud(np.array(surface.vertices_mm))
        tree = small_gicp.KdTree(target)
        small_gicp.estimate_normals_covariances(target, tree, n_neighbours, n_threads)

        def fit(points_mm: FloatArray) -> FloatArray:
            source = small_gicp.PointCloud(points_mm)
            small_gicp.estimate_normals_covariances(
                source, small_gicp.KdTree(source), n_neighbours, n_threads
            )
            motion = np.eye(4)
            for radius_mm in icp.radii_mm:
                motion = small_gicp.align(
                    target, source, tree, motion, max_correspondence_distance=radius_mm,
                    num_threads=n_threads, max_iterations=icp.most_steps,
                ).T_target_source  # fmt: skip
            return np.array(motion)

        return fit

    return _make_icp(stereo, prepare)


def _make_icp(stereo: StereoSettings, prepare: Callable[[TriangleMesh], _Fit]) -> Peer:
    def begin(
        rig: StereoRig, surface: TriangleMesh, _: StereoFrame, first: RigidTransform
    ) -> Follow:
        rectifier, fit = rectifier_of(rig), prepare(surface)
        to_rectified = rectifier.geometry.rectified_from_left
        last = to_rectified @ first

        def follow(frame: StereoFrame) -> RigidTransform | None:
            nonlocal last
            points_mm = find_points_mm(frame, rectifier, surface.vertices_mm, last, stereo)
            if points_mm is None or len(points_mm) < _LEAST_POINTS:
                return None
            bone_from_rectified = last.inverse()
            motion = fit(bone_from_rectified.apply(points_mm))
            found = motion @ bone_from_rectified.matrix
            last = RigidTransform(last.source, last.target, found).inverse()
            return to_rectified.inverse() @ last

        return follow

    return begin


@dataclass(frozen=True, slots=True)
class RapidSettings:
    """How the outline is looked for with `cv2.rapid`."""

    n_lines: int  # across the outline
    reach_px: int  # of a line, to both sides
    n_steps: int
    least_response: float  # of an edge, by the Sobel filter
    agree_px: float  # edges that are as near to a pose speak for it


def make_rapid(settings: RapidSettings) -> Peer:
    """The outline in the left picture alone: lines across it and edges on them by `cv2.rapid`.

    Its own trackers fit to all edges alike and are drawn off by the outline that tissue covers;
    here a pose that many edges agree with is looked for (`solvePnPRansac`).
    """

    def begin(
        rig: StereoRig, surface: TriangleMesh, _: StereoFrame, first: RigidTransform
    ) -> Follow:
        rectifier = rectifier_of(rig)
        geometry, outline = rectifier.geometry, Outline(rectifier.geometry, drawn(surface))
        last = geometry.rectified_from_left @ first

        def follow(frame: StereoFrame) -> RigidTransform | None:
            nonlocal last
            picture = luma(rectifier.rectify(frame.left, frame.right).left)
            try:
                for _ in range(settings.n_steps):
                    found = outline.step(picture, last, settings)
                    if found is None:
                        return None
                    last = found
            except cv2.error:  # out of view, or no pose at all
                return None
            return geometry.rectified_from_left.inverse() @ last

        return follow

    return begin


class Outline:
    """A bone's outline in the rectified left picture.

    Args:
        geometry: of the rectified pair.
        mesh: of the bone.
    """

    def __init__(self, geometry: RectifiedGeometry, mesh: TriangleMesh) -> None:
        self._matrix, self._size = geometry.camera_matrix, (geometry.width, geometry.height)
        self._points_mm = np.array(mesh.vertices_mm, dtype=np.float32)
        self._faces = np.array(mesh.faces, dtype=np.int32)

    def step(
        self, picture: Any, pose: RigidTransform, settings: RapidSettings
    ) -> RigidTransform | None:
        """A pose that fits better to the edges around it; None: too few edges agree."""
        turn = cv2.Rodrigues(np.array(pose.rotation))[0]
        shift_mm = pose.translation_mm.reshape(3, 1).copy()
        places_px, points_mm = cv2.rapid.extractControlPoints(
            settings.n_lines, settings.reach_px, self._points_mm, turn, shift_mm, self._matrix,
            self._size, self._faces,
        )  # fmt: skip
        bundle, pixels = cv2.rapid.extractLineBundle(settings.reach_px, places_px, picture)
        columns, responses = cv2.rapid.findCorrespondencies(bundle)
        rows = np.flatnonzero((responses > settings.least_response) & (columns > 0))
        if len(rows) < _LEAST_EDGES:
            return None
        seen_px = pixels[rows, columns.ravel()[rows]].astype(np.float64)
        points_mm = points_mm[rows].astype(np.float64)
        is_found, turn, shift_mm, agreeing = cv2.solvePnPRansac(
            points_mm, seen_px, self._matrix, None, turn, shift_mm, True, 200, settings.agree_px
        )
        if not is_found or agreeing is None or len(agreeing) < _LEAST_EDGES:
            return None
        rows = agreeing.ravel()
        turn, shift_mm = cv2.solvePnPRefineLM(
            points_mm[rows], seen_px[rows], self._matrix, None, turn, shift_mm
        )
        return RigidTransform.from_parts(pose.target, pose.source, cv2.Rodrigues(turn)[0], shift_mm)


def make_peers() -> dict[str, Peer]:
    """All of them, by name, with the best settings that were found (docs/evaluation.md, Peers)."""
    stereo = StereoSettings(
        window_px=5, wls_lambda=None, margin_px=16, margin_mm=30.0, n_points=3000
    )
    peers = {
        "SGBM + WLS + Open3D ICP": make_open3d(
            replace(stereo, wls_lambda=10.0), IcpSettings((3.0,), (0.7,))
        ),
        "SGBM + GICP": make_gicp(stereo, IcpSettings((1.0,))),
        "cv2.rapid + RANSAC": make_rapid(
            RapidSettings(n_lines=150, reach_px=5, n_steps=3, least_response=15.0, agree_px=1.5)
        ),
    }
    if PROGRAM.is_file():
        peers["ViSP, KLT on the model"] = partial(VispTracker, n_faces=150)
    return peers
