"""Pairs that show a bone whose pose and visible pixels are known: recorded and simulated."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial import cKDTree

from navapp.geometry import RectifiedPair, Rectifier, RigidTransform, TriangleMesh, read_rig
from navapp.geometry.ply import read_ply
from navapp.geometry.rig import StereoRig
from navapp.values import DisparityMap
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from sim_devices.world import World
from tests.knees import femur_of
from tests.recorded import read_true_poses
from tests.views import project_box

SEQUENCES = ("registration", "patient", "instrument")
_ERODED_PX = 6
_MARGIN_PX = 40
# Not the seeds of any test or default.
_SIMULATED = {
    "opening": Scenario(seed=71, contrast=0.05, blood=0.3, motion="patient"),
    "drilling": Scenario(
        seed=72, contrast=0.04, blood=0.6, motion="patient", stage="drilling", side="left"
    ),
}
_SIMULATED_NS = (0, 700_000_000, 1_500_000_000)


@dataclass(frozen=True)
class Scene:
    """One pair with its truth, rectified.

    Attributes:
        pair: its box is around the bone.
        is_bone: (h, w) bone over the box, 6 px inside its visible part.
        pose: true, rectified camera from bone.
    """

    pair: RectifiedPair
    is_bone: np.ndarray
    pose: RigidTransform


@dataclass(frozen=True)
class Sequence:
    """Scenes of one bone under one rig."""

    name: str
    scenes: list[Scene]
    mesh: TriangleMesh
    rig: StereoRig


def sequences(folder: Path) -> Iterator[Sequence]:
    """Every recorded sequence in a folder of phantoms, then the simulated ones."""
    for phantom in sorted(folder.glob("phantom_*")):
        mesh, rig = read_ply(phantom / "femur.ply")[0], read_rig(phantom / "rig.yml")
        for sequence in SEQUENCES:
            yield Sequence(
                f"{phantom.name}/{sequence}", list(_recorded(phantom / sequence, mesh, rig)),
                mesh, rig,
            )  # fmt: skip
    for name in _SIMULATED:
        yield simulated_sequence(name)


def simulated_sequence(name: str) -> Sequence:
    """One of the simulated sequences."""
    world = World(_SIMULATED[name])
    mesh = femur_of(world).mesh
    return Sequence(f"simulated/{name}", list(_simulated(world, mesh)), mesh, world.rig)


def _recorded(folder: Path, mesh: TriangleMesh, rig: StereoRig) -> Iterator[Scene]:
    for number, true in read_true_poses(folder).items():
        left, right, mask = (
            cv2.imread(str(next(folder.glob(f"{name}_{number:04d}.*"))), cv2.IMREAD_GRAYSCALE)
            for name in ("left", "right", "bone_mask_left")
        )
        yield _scene(Rectifier(rig), (left, right, mask), true, mesh)


def _simulated(world: World, mesh: TriangleMesh) -> Iterator[Scene]:
    sensor = SensorModel(seed=world.scenario.seed)
    for number, time_ns in enumerate(_SIMULATED_NS):
        left, right = (
            cv2.cvtColor(
                sensor.picture(world.render(eye, time_ns), eye, number), cv2.COLOR_BGR2GRAY
            )
            for eye in ("left", "right")
        )
        seen = world.depth("left", time_ns)
        mask = (seen.body == seen.bodies.index("femur")).astype(np.uint8)
        true = world.left_from_body("femur", time_ns)
        yield _scene(Rectifier(world.rig), (left, right, mask), true, mesh)


def _scene(
    rectifier: Rectifier,
    pictures: tuple[np.ndarray, np.ndarray, np.ndarray],
    left_from_bone: RigidTransform,
    mesh: TriangleMesh,
) -> Scene:
    left, right, mask = pictures
    geometry = rectifier.geometry
    pose = geometry.rectified_from_left @ left_from_bone
    box = project_box(mesh, pose, geometry).grow(_MARGIN_PX)
    box = box.clip(geometry.width, geometry.height)
    x, y, *_ = rectifier.maps
    warped = cv2.remap(mask, x, y, cv2.INTER_NEAREST)
    size = 2 * _ERODED_PX + 1
    eroded = cv2.erode(warped, np.ones((size, size), np.uint8)) > 0
    inside = eroded[box.y : box.y + box.height, box.x : box.x + box.width]
    return Scene(rectifier.rectify(left, right, box), inside, pose)


def fit_error_mm(scene: Scene, found: DisparityMap, mesh: TriangleMesh) -> float:
    """TRE of the plain point-to-plane fit of the true model to the points on the bone.

    Unweighted, started at the truth, nothing beyond 3 mm, until the step is below 1e-4 mm.
    """
    points = on_bone(scene, found).reproject(scene.pair.geometry, 2).points_mm
    tree = cKDTree(mesh.vertices_mm)
    pose = scene.pose
    for _ in range(60):
        moved = pose.inverse().apply(points)
        distance, nearest = tree.query(moved)
        near, index = moved[distance < 3.0], nearest[distance < 3.0]
        normals, centre = mesh.normals[index], near.mean(axis=0)
        residual = np.einsum("ij,ij->i", normals, near - mesh.vertices_mm[index])
        jacobian = np.hstack([normals, np.cross(near - centre, normals)])
        step = -np.linalg.lstsq(jacobian, residual, rcond=None)[0]
        pose = pose.inverse().move(step, centre).inverse()
        if np.linalg.norm(step[:3]) < 1e-4:
            break
    return tre_mm(pose, scene.pose, mesh)


def on_bone(scene: Scene, found: DisparityMap) -> DisparityMap:
    """Only what was matched on the bone, over the scene's box."""
    box = scene.pair.box
    inside = replace(found.box, x=found.x - box.x, y=found.y - box.y)
    part = inside.clip(box.width, box.height)
    here = np.s_[part.y : part.y + part.height, part.x : part.x + part.width]
    x, y = part.x - inside.x, part.y - inside.y
    there = np.s_[y : y + part.height, x : x + part.width]
    is_matched = np.zeros_like(scene.is_bone)
    is_matched[here] = scene.is_bone[here] & (found.origin[there] == 1)
    disparity, sigma = (np.full(is_matched.shape, np.nan, np.float32) for _ in range(2))
    disparity[here], sigma[here] = found.disparity_px[there], found.sigma_px[there]
    disparity[~is_matched], sigma[~is_matched] = np.nan, np.nan
    return DisparityMap(disparity, sigma, is_matched.astype(np.uint8), box.x, box.y)


def tre_mm(pose: RigidTransform, true: RigidTransform, mesh: TriangleMesh) -> float:
    """Mean over the vertices that face the camera at the true pose."""
    seen = mesh.vertices_mm[mesh.visible_vertices(true)]
    return float(np.linalg.norm(pose.apply(seen) - true.apply(seen), axis=1).mean())


def disturbed(
    pose: RigidTransform, centre_mm: np.ndarray, angle_deg: float, length_mm: float, seed: int
) -> RigidTransform:
    """The pose turned and shifted by exactly that much, in random directions."""
    axis, direction = np.random.default_rng(seed).normal(size=(2, 3))
    shift = length_mm * direction / np.linalg.norm(direction)
    turn = np.radians(angle_deg) * axis / np.linalg.norm(axis)
    return pose.move(np.concatenate([shift, turn]), pose.apply(centre_mm))
