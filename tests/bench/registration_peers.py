"""The peers of the registration benchmark: Open3D and small_gicp, at several radii each."""

from collections.abc import Callable
from typing import Any

import numpy as np

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration import RegistrationModel

RADII_MM = (5.0, 10.0, 20.0)
_MAX_ITERATIONS = 100
_NEIGHBOURS = 10
_N_THREADS = 2


# Scene points, model and start to the pose found.
Peer = Callable[[FloatArray, RegistrationModel, RigidTransform], RigidTransform]


def peers() -> dict[str, dict[str, Peer]]:
    """Family -> setting -> peer. A Tukey loss of 2 mm is exact, one as wide as the radius far."""
    plane = {f"r {radius:g}, loss {loss:g}": open3d_plane(radius, loss)
             for radius in RADII_MM for loss in (2.0, radius)}  # fmt: skip
    point = {f"r {radius:g}": _point(radius) for radius in RADII_MM}
    gicp = {f"r {radius:g}": _gicp(radius) for radius in RADII_MM}
    return {
        "Open3D point-to-plane, Tukey": plane,
        "Open3D point-to-point": point,
        "small_gicp GICP": gicp,
    }


def open3d_plane(
    radius_mm: float, loss_mm: float, stop: float = 1e-6, most_steps: int = _MAX_ITERATIONS
) -> Peer:
    """Point-to-plane with a Tukey loss; it ends when fitness and rms change by less than `stop`."""
    import open3d

    registration = open3d.pipelines.registration
    loss = registration.TukeyLoss(k=loss_mm)
    estimation = registration.TransformationEstimationPointToPlane
    return _open3d(radius_mm, lambda: estimation(loss), stop, most_steps)


def _point(radius_mm: float) -> Peer:
    import open3d

    registration = open3d.pipelines.registration
    return _open3d(radius_mm, registration.TransformationEstimationPointToPoint)


def _open3d(
    radius_mm: float,
    estimation: Callable[[], Any],
    stop: float = 1e-6,
    most_steps: int = _MAX_ITERATIONS,
) -> Peer:
    import open3d

    targets: dict[int, Any] = {}

    def fit(
        points_mm: FloatArray, model: RegistrationModel, start: RigidTransform
    ) -> RigidTransform:
        if id(model) not in targets:
            target = open3d.geometry.PointCloud(
                open3d.utility.Vector3dVector(np.array(model.points_mm))
            )
            target.normals = open3d.utility.Vector3dVector(np.array(model.normals))
            targets[id(model)] = target
        source = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points_mm))
        found = open3d.pipelines.registration.registration_icp(
            source, targets[id(model)], radius_mm, start.inverse().matrix, estimation(),
            open3d.pipelines.registration.ICPConvergenceCriteria(stop, stop, most_steps),
        )  # fmt: skip
        return _as_pose(found.transformation, start)

    return fit


def _gicp(radius_mm: float) -> Peer:
    import small_gicp

    targets: dict[int, Any] = {}

    def fit(
        points_mm: FloatArray, model: RegistrationModel, start: RigidTransform
    ) -> RigidTransform:
        if id(model) not in targets:
            target = small_gicp.PointCloud(np.array(model.points_mm))
            tree = small_gicp.KdTree(target)
            small_gicp.estimate_normals_covariances(target, tree, _NEIGHBOURS, _N_THREADS)
            targets[id(model)] = target, tree
        target, tree = targets[id(model)]
        source = small_gicp.PointCloud(points_mm)
        small_gicp.estimate_normals_covariances(
            source, small_gicp.KdTree(source), _NEIGHBOURS, _N_THREADS
        )
        found = small_gicp.align(
            target, source, tree, start.inverse().matrix, max_correspondence_distance=radius_mm,
            num_threads=_N_THREADS, max_iterations=_MAX_ITERATIONS,
        )  # fmt: skip
        return _as_pose(found.T_target_source, start)

    return fit


def _as_pose(bone_from_scene: FloatArray, start: RigidTransform) -> RigidTransform:
    return RigidTransform(start.source, start.target, bone_from_scene).inverse()
