"""How far a pose is off because the surface from a CT is: `BoneModel.surface_sd_mm`.

usage: python -m tests.bench.ct_pose_error [--seeds N] [--first SEED]

CTs of simulated knees with other voxels and another blur each. Of every bone, patches that a camera
would see in an opening: of 18 to 40 mm radius, in what lies 40 mm or less from the joint, from
directions about the approach. The pose that fits the planned surface there best to the true one, by
least squares along the normals, is what a perfect measurement would be off; its error is the mean
over all that is seen from there.
"""

import argparse
from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.preop.plan_drafts import make_draft_from_ct
from navapp.values import BoneModel
from tests.bench.ct_surfaces import BONES, simulated

FIRST_SEED = 41
# Voxels and point spread of clinical knee protocols, fine to coarse.
SCANS = (
    ((0.4, 0.4, 0.5), 0.4), ((0.5, 0.5, 0.6), 0.4), ((0.6, 0.6, 0.8), 0.5), ((0.5, 0.5, 1.0), 0.5),
    ((0.7, 0.7, 1.0), 0.6), ((0.6, 0.6, 1.5), 0.5), ((0.9, 0.9, 1.2), 0.6), ((0.8, 0.8, 2.0), 0.7),
)  # fmt: skip
_N_VIEWS, _LEAST_POINTS = 100, 150
_JOINT_MM, _RADIUS_MM, _FACING = 40.0, (18.0, 40.0), 0.3
# Where the joint lies, and from where each bone is looked at.
_END = {"femur": -1.0, "tibia": 1.0, "patella": 0.0}
_APPROACH = {"femur": (0.0, -0.6, -0.8), "tibia": (0.0, -0.6, 0.8), "patella": (0.0, 0.9, -0.4)}
# A fit gives little weight to what is further away than this.
_ROBUST_MM = 0.3


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=len(SCANS))
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    options = parser.parse_args()
    print("| voxels mm | blur mm | bone | surface, rms | pose, median | 95 % | told (2 sd) |")
    print("|---|---|---|---|---|---|---|")
    for seed in range(options.first, options.first + options.seeds):
        spacing_mm, blur_mm = SCANS[(seed - FIRST_SEED) % len(SCANS)]
        voxels = " x ".join(f"{step:g}" for step in spacing_mm)
        case = simulated(seed, spacing_mm, blur_mm)
        draft = make_draft_from_ct(case.read)
        for name in BONES:
            bone = draft.bones[name]
            error_mm = surface_error_mm(bone.mesh, case.bones[name])
            off_mm = np.array(list(pose_errors_mm(bone, error_mm, seed)))
            print(
                f"| {voxels} | {blur_mm:g} | {name} "
                f"| {np.sqrt((error_mm**2).mean()):.3f} | {np.median(off_mm):.3f} "
                f"| {np.quantile(off_mm, 0.95):.3f} | {2.0 * bone.surface_sd_mm:.3f} |",
                flush=True,
            )


def surface_error_mm(planned: TriangleMesh, true: TriangleMesh) -> FloatArray:
    """(V,) how far each planned vertex lies outside the truth, as a robust fit bounds it."""
    _, nearest = cKDTree(true.vertices_mm).query(planned.vertices_mm)
    off = planned.vertices_mm - true.vertices_mm[nearest]
    along = np.einsum("ij,ij->i", off, true.normals[nearest])
    return np.clip(along, -_ROBUST_MM, _ROBUST_MM)


def pose_errors_mm(bone: BoneModel, error_mm: FloatArray, seed: int) -> Iterator[float]:
    """Of views drawn about the approach."""
    draw = np.random.default_rng(seed)
    mesh, end = bone.mesh, _END[bone.name]
    height = end * mesh.vertices_mm[:, 2]
    is_near = ~bone.is_removed & (height > height.max() - _JOINT_MM)
    for _ in range(_N_VIEWS):
        direction = np.array(_APPROACH[bone.name]) + draw.normal(0.0, 0.25, 3)
        direction /= np.linalg.norm(direction)
        is_seen = is_near & (mesh.normals @ direction > _FACING)
        seen = mesh.vertices_mm[is_seen]
        if len(seen) < _LEAST_POINTS:
            continue
        away_mm = np.linalg.norm(seen - seen[draw.integers(len(seen))], axis=1)
        is_open = away_mm < draw.uniform(*_RADIUS_MM)
        if is_open.sum() >= _LEAST_POINTS:
            yield _off_mm(seen, mesh.normals[is_seen], error_mm[is_seen], is_open)


def _off_mm(
    points_mm: FloatArray, normals: FloatArray, error_mm: FloatArray, is_open: FloatArray
) -> float:
    """Mean motion of the points by the twist that explains the errors of the open ones best."""
    offsets = points_mm - points_mm[is_open].mean(axis=0)
    rows = np.hstack([normals, np.cross(offsets, normals)])[is_open]
    twist, *_ = np.linalg.lstsq(rows, error_mm[is_open], rcond=None)
    moved = twist[:3] + np.cross(twist[3:], offsets)
    return float(np.linalg.norm(moved, axis=1).mean())


if __name__ == "__main__":
    main()
