"""Stereo on recorded bone: the error of a plain fit of the true model to the measured points.

usage: python -m tests.bench.stereo_on_bone [FOLDER] [--seeds N]

Points of the left bone mask (nearest neighbour into the rectified view, eroded 6 px), unweighted
point-to-plane fit started at the truth, nothing beyond 3 mm. Without a pose: our chain beside
OpenCV's SGBM on the same pictures. With a pose: the truth disturbed about the bone's centre, then
matched on the model and fitted, as in the line.
"""

import argparse
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial import cKDTree

from navapp.geometry import RectifiedPair, Rectifier, RigidTransform, TriangleMesh, read_rig
from navapp.geometry.ply import read_ply
from navapp.geometry.zbuffer import projected_box
from navapp.stereo import match_sgbm, reproject
from navapp.stereo.production import match_without_pose
from navapp.tracking import Line
from navapp.values import BoneModel, DisparityMap, visible_vertices

_SEQUENCES = ("registration", "patient", "instrument")
_DISTURBANCES = ((1.0, 0.6), (2.0, 2.0), (5.0, 5.0))


@dataclass(frozen=True)
class Scene:
    """One recorded pair with its truth, rectified."""

    pair: RectifiedPair
    mask: np.ndarray
    pose: RigidTransform


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "folder", nargs="?", default=os.environ.get("NAVAPP_DATA", "../shared/data")
    )
    parser.add_argument("--seeds", type=int, default=5)
    options = parser.parse_args()
    for phantom in sorted(Path(options.folder).glob("phantom_*")):
        mesh = read_ply(phantom / "femur.ply")[0]
        for sequence in _SEQUENCES:
            free(f"{phantom.name}/{sequence}", list(scenes(phantom, sequence, mesh)), mesh)
        line = Line(read_rig(phantom / "rig.yml"), BoneModel("femur", mesh))
        guided(phantom.name, list(scenes(phantom, "registration", mesh)), line, options.seeds)


def scenes(phantom: Path, sequence: str, mesh: TriangleMesh) -> Iterator[Scene]:
    """Every frame of a sequence."""
    rectifier = Rectifier(read_rig(phantom / "rig.yml"))
    folder = phantom / sequence
    for entry in json.loads((folder / "truth.json").read_text())["frames"]:
        number = f"{entry['index']:04d}"
        left, right, mask = (
            cv2.imread(str(next(folder.glob(f"{name}_{number}.*"))), cv2.IMREAD_GRAYSCALE)
            for name in ("left", "right", "bone_mask_left")
        )
        true = RigidTransform("left", "femur", entry["T_leftcam_from_ct"]["femur"])
        pose = rectifier.geometry.rectified_from_left @ true
        box = projected_box(mesh, pose, rectifier.geometry)
        x, y, *_ = rectifier.maps
        warped = cv2.remap(mask, x, y, cv2.INTER_NEAREST)
        eroded = cv2.erode(warped, np.ones((13, 13), np.uint8)) > 0
        yield Scene(rectifier.rectify(left, right, box.grown(40)), eroded, pose)


def free(name: str, frames: list[Scene], mesh: TriangleMesh) -> None:
    """Without a pose, beside SGBM."""
    ours, theirs, density = [], [], []
    for scene in frames:
        depths = scene.pose.apply(mesh.vertices_mm)[:, 2]
        geometry = scene.pair.geometry
        band = (geometry.disparity_px(depths.max() + 60), geometry.disparity_px(depths.min() - 60))
        matched = match_without_pose(scene.pair, band, fills=False).matched
        ours.append(fit_error_mm(scene, matched, mesh))
        theirs.append(fit_error_mm(scene, match_sgbm(scene.pair, band), mesh))
        density.append((on_bone(scene, matched).origin > 0).sum() / in_box(scene).sum())
    print(
        f"{name} without a pose: {np.median(ours):.3f} median {max(ours):.3f} worst mm, density "
        f"{min(density):.2f}; SGBM {np.median(theirs):.3f} {max(theirs):.3f}",
        flush=True,
    )


def guided(name: str, frames: list[Scene], line: Line, n_seeds: int) -> None:
    """With a pose that is disturbed by an angle and a length."""
    for angle_deg, length_mm in _DISTURBANCES:
        errors = []
        for scene in frames:
            for seed in range(n_seeds):
                start = disturbed(scene.pose, line.centre_mm, angle_deg, length_mm, seed)
                fit = line._follow(scene.pair, start)
                found = fit.estimate.camera_from_bone
                errors.append(tre_mm(found, scene.pose, line.model.bone.mesh))
        print(
            f"{name} from {angle_deg:g} deg {length_mm:g} mm: {np.median(errors):.3f} median "
            f"{max(errors):.3f} worst mm",
            flush=True,
        )


def disturbed(
    pose: RigidTransform, centre_mm: np.ndarray, angle_deg: float, length_mm: float, seed: int
) -> RigidTransform:
    """The pose turned and shifted by exactly that much, in random directions."""
    axis, direction = np.random.default_rng(seed).normal(size=(2, 3))
    shift = length_mm * direction / np.linalg.norm(direction)
    turn = np.radians(angle_deg) * axis / np.linalg.norm(axis)
    return pose.moved(np.concatenate([shift, turn]), pose.apply(centre_mm))


def fit_error_mm(scene: Scene, found: DisparityMap, mesh: TriangleMesh) -> float:
    """TRE of the plain fit to the points on the bone."""
    points = reproject(on_bone(scene, found), scene.pair.geometry, 2).points_mm
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
        pose = pose.inverse().moved(step, centre).inverse()
        if np.linalg.norm(step[:3]) < 1e-4:
            break
    return tre_mm(pose, scene.pose, mesh)


def tre_mm(pose: RigidTransform, true: RigidTransform, mesh: TriangleMesh) -> float:
    """Mean over the vertices that face the camera at the true pose."""
    seen = mesh.vertices_mm[visible_vertices(mesh, true)]
    return float(np.linalg.norm(pose.apply(seen) - true.apply(seen), axis=1).mean())


def in_box(scene: Scene) -> np.ndarray:
    """The eroded bone mask over the pair's box."""
    box = scene.pair.box
    return scene.mask[box.y : box.y + box.height, box.x : box.x + box.width]


def on_bone(scene: Scene, found: DisparityMap) -> DisparityMap:
    """Only what lies on the bone."""
    return replace(found, origin=np.where(in_box(scene), found.origin, 0).astype(np.uint8))


if __name__ == "__main__":
    main()
