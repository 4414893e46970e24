"""Reads scene and model of a registration from users' files, with notes of what was changed."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from navapp.cli.surface_cleaning import estimate_normals, mend, thin, thin_evenly
from navapp.errors import InputError
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.surface_files import SurfaceFile, merge_rows, read_surface_file
from navapp.geometry.transform import FloatArray

MOST_SCENE_POINTS = 20_000
# Models are thinned only when it saves much.
MOST_MODEL_POINTS = 60_000
_THINNED_MODEL_POINTS = 50_000
_LEAST_MODEL_POINTS = 4
_SEED = 0
# Larger numbers are damage, and their squares soon overflow.
_LARGEST_COORDINATE = 1e12


@dataclass(frozen=True, slots=True, eq=False)
class SceneFile:
    """Points of a scene, in the file's unit."""

    points: FloatArray  # (N, 3), no two equal
    unit: str | None  # what the file says of it, or None
    notes: tuple[str, ...]  # what was done, in words for people


@dataclass(frozen=True, slots=True, eq=False)
class ModelFile:
    """A model, in the file's unit."""

    whole: TriangleMesh  # as the file holds it
    mesh: TriangleMesh  # mended and thinned, with normals; without faces for a cloud
    is_removed: NDArray[np.bool_]  # (V,) vertices without a normal
    unit: str | None  # what the file says of it, or None
    notes: tuple[str, ...]  # what was done, in words for people


def read_scene(path: str | Path) -> SceneFile:
    """The points of a cloud or mesh, at most `MOST_SCENE_POINTS` of them.

    Raises:
        InputError: the file is missing or damaged, or holds no usable point.
    """
    file = _read(path)
    notes = _make_dropped_notes(file)
    points = file.mesh.vertices_mm
    first, _ = merge_rows(points)
    if len(first) < len(points):
        notes.append(f"{len(points) - len(first)} of {len(points)} points repeat others and count "
                     "once")  # fmt: skip
        points = points[first]
    if len(points) > MOST_SCENE_POINTS:
        notes.append(f"{MOST_SCENE_POINTS} of {len(points)} points are used")
        # Drawn, as every n-th point of a picture would come from few of its columns.
        drawn = np.random.default_rng(_SEED).choice(len(points), MOST_SCENE_POINTS, replace=False)
        points = points[np.sort(drawn)]
    return SceneFile(points, file.unit, tuple(notes))


def read_model(path: str | Path) -> ModelFile:
    """A mesh or cloud as a model.

    Raises:
        InputError: the file is missing or damaged, or holds no surface.
    """
    file = _read(path)
    notes = _make_dropped_notes(file)
    mesh = _mesh(file, notes) if len(file.mesh.faces) else _cloud(file, notes)
    is_removed = np.asarray(~mesh.normals.any(axis=1))
    if len(mesh.vertices_mm) < _LEAST_MODEL_POINTS or is_removed.all():
        raise InputError(
            f"model {path} is no surface: it has {len(mesh.vertices_mm)} different points, "
            f"{int((~is_removed).sum())} of them with a normal",
            subject=str(path),
            remedy="give the bone's surface as triangles or as a cloud",
        )
    return ModelFile(file.mesh, mesh, is_removed, file.unit, tuple(notes))


def size_of(points: FloatArray) -> float:
    """How large a cloud is, whatever lies about: twice the median distance from its middle."""
    return 2.0 * float(np.median(np.linalg.norm(points - np.median(points, axis=0), axis=1)))


def _read(path: str | Path) -> SurfaceFile:
    """The file, unless its numbers are beyond all measure."""
    file = read_surface_file(path)
    largest = float(np.abs(file.mesh.vertices_mm).max())
    if largest > _LARGEST_COORDINATE:
        raise InputError(
            f"surface {path} has a coordinate of {largest:.0e}",
            subject=str(path),
            remedy="export it again, or remove that point",
        )
    return file


def _make_dropped_notes(file: SurfaceFile) -> list[str]:
    n = file.n_dropped
    return [f"{n} points are not finite and were left out"] if n else []


def _mesh(file: SurfaceFile, notes: list[str]) -> TriangleMesh:
    result = mend(file.mesh)
    notes += result.notes
    n = len(result.mesh.vertices_mm)
    if n <= MOST_MODEL_POINTS:
        return result.mesh
    coarse = thin(result.mesh, _THINNED_MODEL_POINTS)
    notes.append(f"its {n} vertices were thinned to {len(coarse.vertices_mm)}")
    return coarse


def _cloud(file: SurfaceFile, notes: list[str]) -> TriangleMesh:
    first, _ = merge_rows(file.mesh.vertices_mm)
    points, normals = file.mesh.vertices_mm[first], file.mesh.normals[first]
    if len(points) > MOST_MODEL_POINTS:
        kept = thin_evenly(points, _THINNED_MODEL_POINTS)
        notes.append(f"its {len(points)} points were thinned to {len(kept)}")
        points, normals = points[kept], normals[kept]
    if not file.has_normals and len(points) >= _LEAST_MODEL_POINTS:
        notes.append(
            "it has no normals; they were estimated, and what counts as facing the camera "
            "depends on them"
        )
        normals = estimate_normals(points)
    return TriangleMesh(points, np.empty((0, 3), dtype=np.int32), normals)
