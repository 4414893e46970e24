"""Bone surfaces out of CTs beside their truth, and beside a fixed threshold.

usage: python -m tests.bench.ct_surfaces [--seeds N] [--first SEED] [--thresholds]

phantom_a's CT (NAVAPP_DATA) and CTs of simulated knees, each segmented without a seed. Errors are
those of the true vertices inside the volume: along the normal where the surface is near, the whole
distance where it is further than a millimetre away; 2 mm at the cut end of a shaft are left out.
`beyond` is how far the planned surface goes astray: 99.9 % of its vertices lie nearer to the truth.
A fixed threshold cannot tell the bones apart: its iso-surface is cut to each bone's surroundings.
"""

import argparse
import os
import resource
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.ply import read_ply
from navapp.geometry.transform import FloatArray
from navapp.preop.plan_drafts import CtSettings, Draft, make_draft_from_ct
from navapp.preop.volume import CtVolume, read_ct
from navapp.preop.volume.volume_reading import CtSource, ReadCt
from sim_devices.anatomy import KneeSpec, make_knee
from sim_devices.ct_volume import make_ct

FIRST_SEED = 1
FIXED_HU = 250.0
THRESHOLDS_HU = (150.0, 250.0, 350.0)
BONES = ("femur", "tibia", "patella")
_CUT_MM, _NEAR_MM, _AROUND_MM = 2.0, 1.0, 4.0
_N_SAMPLES = 600_000


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """A CT and the true surfaces of its bones."""

    name: str
    read: ReadCt
    bones: dict[str, TriangleMesh]


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    parser.add_argument("--thresholds", action="store_true", help="how far thresholds move it")
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.seeds)
    if options.thresholds:
        _thresholds(seeds)
        return
    print("| CT | bone | median mm | 95 % | signed | beyond | fixed 250 HU | s | GB |")
    print("|---|---|---|---|---|---|---|---|---|")
    for case in cases(seeds):
        for row in _rows(case):
            print(row, flush=True)


def cases(seeds: range) -> Iterator[Case]:
    """phantom_a, where there is recorded data, then simulated knees: left and right, both sexes."""
    folder = Path(os.environ.get("NAVAPP_DATA", "../shared/data")) / "phantom_a"
    if folder.is_dir():
        bones = {name: read_ply(folder / f"{name}.ply")[0] for name in BONES}
        yield Case("phantom_a", read_ct(folder / "ct.nii.gz"), bones)
    for seed in seeds:
        yield simulated(seed)


def simulated(
    seed: int,
    spacing_mm: tuple[float, float, float] = (0.5, 0.5, 0.8),
    psf_sigma_mm: float = 0.5,
) -> Case:
    """The CT of a simulated knee."""
    knee = make_knee(
        KneeSpec(seed, "left" if seed % 2 else "right", "male" if seed % 3 == 0 else "female")
    )
    ct = make_ct(knee, spacing_mm, seed, psf_sigma_mm)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = ct.direction * ct.spacing_mm, ct.origin_mm
    volume = CtVolume(ct.hounsfield, matrix, ct.spacing_mm)
    read = ReadCt(volume, (), CtSource("simulated", "", volume.size[2]))
    return Case(f"seed {seed}", read, dict(knee.bones))


def errors_mm(planned: TriangleMesh, true: TriangleMesh, is_lower: bool) -> tuple[float, ...]:
    """Median, 95 % and signed median of the true vertices; how far the planned ones go astray."""
    height = true.vertices_mm[:, 2]
    ends = planned.vertices_mm[:, 2].min(), planned.vertices_mm[:, 2].max()
    inside = height > ends[0] + _CUT_MM if is_lower else height < ends[1] - _CUT_MM
    error, signed = _off(samples(planned), true.vertices_mm[inside], true.normals[inside])
    beyond, _ = cKDTree(samples(true)).query(_within(planned, is_lower), workers=2)
    return (
        float(np.median(error)), float(np.quantile(error, 0.95)), float(np.median(signed)),
        float(np.quantile(beyond, 0.999)),
    )  # fmt: skip


def _within(planned: TriangleMesh, is_lower: bool) -> FloatArray:
    height = planned.vertices_mm[:, 2]
    if is_lower:
        return planned.vertices_mm[height > height.min() + _CUT_MM]
    return planned.vertices_mm[height < height.max() - _CUT_MM]


def _off(
    surface_mm: FloatArray, points_mm: FloatArray, normals: FloatArray
) -> tuple[FloatArray, FloatArray]:
    away_mm, nearest = cKDTree(surface_mm).query(points_mm, workers=2)
    signed_mm = np.einsum("ij,ij->i", surface_mm[nearest] - points_mm, normals)
    return np.where(away_mm < _NEAR_MM, np.abs(signed_mm), away_mm), signed_mm


def samples(mesh: TriangleMesh) -> FloatArray:
    """Points spread over a surface."""
    draw = np.random.default_rng(0)
    a, b, c = (mesh.vertices_mm[mesh.faces[:, corner]] for corner in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    chosen = draw.choice(len(area), _N_SAMPLES, p=area / area.sum())
    u = draw.random((_N_SAMPLES, 2))
    u[u.sum(axis=1) > 1.0] = 1.0 - u[u.sum(axis=1) > 1.0]
    a, b, c = a[chosen], b[chosen], c[chosen]
    return np.asarray(a + u[:, :1] * (b - a) + u[:, 1:] * (c - a))


def at_threshold(ct: CtVolume, true: TriangleMesh, level_hu: float) -> FloatArray:
    """(N, 3) points of the marching-cubes surface of a CT around one bone."""
    import open3d

    found = open3d.t.geometry.TriangleMesh.create_isosurfaces(
        open3d.core.Tensor.from_numpy(np.ascontiguousarray(ct.hu.astype(np.float32))), [level_hu]
    )
    points = ct.points_lps_mm(found.vertex.positions.numpy().astype(np.float64))
    mesh = TriangleMesh(points, found.triangle.indices.numpy().astype(np.int32))
    spread = samples(mesh)
    away_mm, _ = cKDTree(true.vertices_mm).query(spread, workers=2)
    return spread[away_mm < _AROUND_MM]


def _rows(case: Case) -> Iterator[str]:
    started = time.process_time()
    draft = make_draft_from_ct(case.read)
    cpu_s = time.process_time() - started
    peak_gb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    for name in BONES:
        if name not in draft.bones:
            yield f"| {case.name} | {name} | not found | | | | | {cpu_s:.0f} | {peak_gb:.1f} |"
            continue
        true = case.bones[name]
        off = errors_mm(draft.bones[name].mesh, true, name == "tibia")
        fixed = at_threshold(case.read.volume, true, FIXED_HU)
        fixed_mm, _ = _off(fixed, true.vertices_mm, true.normals)
        yield (
            f"| {case.name} | {name} | {off[0]:.3f} | {off[1]:.3f} | {off[2]:+.3f} | {off[3]:.2f} "
            f"| {np.median(fixed_mm):.3f} | {cpu_s:.0f} | {peak_gb:.1f} |"
        )


def _thresholds(seeds: range) -> None:
    print("| CT | bone | 150 to 250 HU, median mm | 250 to 350 HU | 150 to 350 HU |")
    print("|---|---|---|---|---|")
    for case in cases(seeds):
        drafts = [
            make_draft_from_ct(case.read, CtSettings(threshold_hu=level)) for level in THRESHOLDS_HU
        ]
        for name in BONES:
            pairs = (drafts[:2], drafts[1:], drafts[::2])
            moved = " | ".join(f"{_moved_mm(*pair, name):.3f}" for pair in pairs)
            print(f"| {case.name} | {name} | {moved} |", flush=True)


def _moved_mm(one: Draft, other: Draft, name: str) -> float:
    mesh = one.bones[name].mesh
    off, _ = _off(samples(other.bones[name].mesh), mesh.vertices_mm, mesh.normals)
    return float(np.median(off))


if __name__ == "__main__":
    main()
