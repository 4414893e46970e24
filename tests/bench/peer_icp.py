"""Chains of stereo matching and iterative closest points: Open3D's, and GICP of small_gicp."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from drivers.frames import StereoFrame
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import rectifier_of
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from tests.bench.peer_stereo import StereoSettings, find_points_mm

# Measured points (N, 3), mm, in the frame of the bone at its last pose, to the motion (4, 4) that
# takes them onto the bone's surface.
_Fit = Callable[[FloatArray], FloatArray]

_LEAST_POINTS = 100
_MOST_STEPS = 50  # of each round
_N_NEIGHBOURS, _N_THREADS = 10, 2


def make_open3d(
    stereo: StereoSettings, radii_mm: Sequence[float], losses_mm: Sequence[float]
) -> "partial[IcpTracker]":
    """Point-to-plane ICP of Open3D, in rounds.

    Args:
        stereo: how the points are made.
        radii_mm: largest distance of a pair, of each round.
        losses_mm: width of Tukey's weights, of each round.
    """
    import open3d

    library = open3d.pipelines.registration

    def make_fit(surface: TriangleMesh) -> _Fit:
        target = open3d.geometry.PointCloud(
            open3d.utility.Vector3dVector(np.array(surface.vertices_mm))
        )
        target.normals = open3d.utility.Vector3dVector(np.array(surface.normals))

        def fit(points_mm: FloatArray) -> FloatArray:
            source = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points_mm))
            motion = np.eye(4)
            for radius_mm, loss_mm in zip(radii_mm, losses_mm, strict=True):
                found = library.registration_icp(
                    source, target, radius_mm, motion,
                    library.TransformationEstimationPointToPlane(library.TukeyLoss(k=loss_mm)),
                    library.ICPConvergenceCriteria(1e-6, 1e-6, _MOST_STEPS),
                )  # fmt: skip
                motion = found.transformation
            return np.array(motion)

        return fit

    return partial(IcpTracker, stereo=stereo, make_fit=make_fit)


def make_gicp(stereo: StereoSettings, radii_mm: Sequence[float]) -> "partial[IcpTracker]":
    """Generalised ICP of small_gicp, in rounds.

    Args:
        stereo: how the points are made.
        radii_mm: largest distance of a pair, of each round.
    """
    import small_gicp

    def make_fit(surface: TriangleMesh) -> _Fit:
        target = small_gicp.PointCloud(np.array(surface.vertices_mm))
        tree = small_gicp.KdTree(target)
        small_gicp.estimate_normals_covariances(target, tree, _N_NEIGHBOURS, _N_THREADS)

        def fit(points_mm: FloatArray) -> FloatArray:
            source = small_gicp.PointCloud(points_mm)
            small_gicp.estimate_normals_covariances(
                source, small_gicp.KdTree(source), _N_NEIGHBOURS, _N_THREADS
            )
            motion = np.eye(4)
            for radius_mm in radii_mm:
                motion = small_gicp.align(
                    target, source, tree, motion, max_correspondence_distance=radius_mm,
                    num_threads=_N_THREADS, max_iterations=_MOST_STEPS,
                ).T_target_source  # fmt: skip
            return np.array(motion)

        return fit

    return partial(IcpTracker, stereo=stereo, make_fit=make_fit)


class IcpTracker:
    """Fits measured points around the last pose to the bone's surface.

    Args:
        rig: that takes the pictures.
        surface: of the bone.
        _frame: the first pair; only its pose is needed.
        pose: left camera from bone in it.
        stereo: how the points are made.
        make_fit: makes a fit to a surface.
    """

    def __init__(
        self,
        rig: StereoRig,
        surface: TriangleMesh,
        _frame: StereoFrame,
        pose: RigidTransform,
        stereo: StereoSettings,
        make_fit: Callable[[TriangleMesh], _Fit],
    ) -> None:
        self._rectifier, self._surface, self._stereo = rectifier_of(rig), surface, stereo
        self._fit = make_fit(surface)
        self._rectified_from_left = self._rectifier.geometry.rectified_from_left
        self._last = self._rectified_from_left @ pose

    def __call__(self, frame: StereoFrame) -> RigidTransform | None:
        """The pose in the next pair; None: too few points."""
        last = self._last
        points_mm = find_points_mm(
            frame, self._rectifier, self._surface.vertices_mm, last, self._stereo
        )
        if points_mm is None or len(points_mm) < _LEAST_POINTS:
            return None
        bone_from_rectified = last.inverse()
        motion = self._fit(bone_from_rectified.apply(points_mm))
        found = motion @ bone_from_rectified.matrix
        self._last = RigidTransform(last.source, last.target, found).inverse()
        return self._rectified_from_left.inverse() @ self._last
