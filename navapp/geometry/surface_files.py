"""Surfaces and point clouds from the files of other programs: PLY, STL, OBJ, VTK, PCD, columns.

The readers are our own: Open3D leaves out the quads of an OBJ, parts an STL at its edges, and makes
points up when a PCD is cut short.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from navapp.errors import InputError
from navapp.geometry.mesh import TriangleMesh, vertex_normals
from navapp.geometry.number_tables import number_table, whole_text
from navapp.geometry.pcd_files import parse_pcd
from navapp.geometry.ply import parse_ply
from navapp.geometry.raw_surface import RawSurface, UnusableContentError, damaged, surface_content
from navapp.geometry.transform import FloatArray
from navapp.geometry.vtk_files import parse_vtk, triangles_of

_KIND_OF_SUFFIX = {
    ".ply": "PLY", ".stl": "STL", ".obj": "OBJ", ".vtk": "VTK", ".pcd": "PCD",
    ".xyz": "XYZ", ".xyzn": "XYZ", ".txt": "XYZ", ".csv": "XYZ", ".asc": "XYZ",
}  # fmt: skip

# Up to this share of missing normals a cloud or mesh counts as having normals.
_MISSING_NORMALS = 0.01

_NO_FACES = np.empty((0, 3), dtype=np.int64)

_STL_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceFile:
    """A surface or a cloud as a file holds it."""

    # coordinates as stored, in the file's unit; without faces for a cloud. The corners of an STL
    # that are exactly equal are one vertex.
    mesh: TriangleMesh
    # the normals came with the file or follow from the faces. Otherwise they are 0.
    has_normals: bool
    unit: str | None  # what the file says of its unit, lower case ("mm"), or None
    n_dropped: int  # points that were not finite; they and their faces were left out


def read_surface_file(path: str | Path) -> SurfaceFile:
    """Read a surface or a cloud; the suffix says the format.

    PLY, STL (text and binary), OBJ, legacy VTK (POLYDATA), PCD (all three kinds), and text of 3
    (x y z) or 6 numbers a line (x y z nx ny nz) as XYZ, XYZN, TXT, ASC or CSV. Polygons are cut
    into triangles. A file's own normals are made unit vectors; of OBJ and STL those of the faces
    are taken.

    Raises:
        InputError: an unknown suffix, a missing, empty, damaged or cut-short file, no finite point.
    """
    path = Path(path)
    kind = _KIND_OF_SUFFIX.get(path.suffix.lower(), "")
    if not kind and not path.is_dir():
        raise InputError(
            f"surface {path} has no suffix of a known format",
            subject=str(path),
            remedy=f"give a file of {', '.join(_KIND_OF_SUFFIX)}",
        )
    content = surface_content(path, kind or "surface")
    try:
        # Numbers that are not finite are expected here, and found in the end.
        with np.errstate(over="ignore", invalid="ignore"):
            return _surface(_parse(path, content, kind))
    except (ValueError, IndexError, OverflowError) as error:
        told = isinstance(error, UnusableContentError)
        why = str(error) if told else "it is cut short or its numbers are broken"
        raise damaged(path, why, kind) from error


def _parse(path: Path, content: bytes, kind: str) -> RawSurface:
    match kind:
        case "PLY":
            return parse_ply(path, content)[0]
        case "VTK":
            return parse_vtk(content)
        case "STL":
            return _parse_stl(content)
        case "OBJ":
            return _parse_obj(content)
        case "PCD":
            return parse_pcd(content)
        case _:
            return _parse_columns(content)


def _surface(raw: RawSurface) -> SurfaceFile:
    """Drop what is not finite, check what is left, settle the normals."""
    finite = np.asarray(np.isfinite(raw.points).all(axis=1))
    if not finite.any():
        raise UnusableContentError("it holds no point with finite coordinates")
    if len(raw.faces) and (raw.faces.min() < 0 or raw.faces.max() >= len(finite)):
        raise UnusableContentError("a face names a vertex that does not exist")
    new_index = np.cumsum(finite) - 1
    faces = new_index[raw.faces[finite[raw.faces].all(axis=1)]].astype(np.int32)
    points = raw.points[finite]
    normals, has_normals = np.zeros_like(points), False
    if raw.normals is not None:
        normals = _unit_or_zero(raw.normals[finite])
        has_normals = _enough(normals, faces)
    if len(faces):
        from_faces = vertex_normals(points, faces)
        if has_normals:
            normals = np.where(normals.any(axis=1, keepdims=True), normals, from_faces)
        else:
            normals, has_normals = from_faces, _enough(from_faces, faces)
    if not has_normals:
        normals = np.zeros_like(points)
    mesh = TriangleMesh(points, faces, normals)
    return SurfaceFile(mesh, has_normals, raw.unit, int(len(finite) - len(points)))


def _unit_or_zero(normals: FloatArray) -> FloatArray:
    """(V, 3) unit vectors; 0 for those that are not finite or have no length."""
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    good = np.isfinite(length) & (length > 0.0)
    unit: FloatArray = np.where(good, normals, 0.0) / np.where(good, length, 1.0)
    return unit


def _enough(normals: FloatArray, faces: NDArray[np.int32]) -> bool:
    """Whether all but a few vertices have a normal; in a mesh only those of a face count."""
    missing = np.asarray(~normals.any(axis=1))
    if len(faces):
        missing = missing[np.unique(faces)]
    return bool(missing.mean() <= _MISSING_NORMALS)


def _parse_stl(content: bytes) -> RawSurface:
    # Binary files may begin with "solid" too: the length decides.
    n_facets = int.from_bytes(content[80:84], "little")
    if len(content) >= 84 and len(content) == 84 + _STL_FACET.itemsize * n_facets:
        corners = np.frombuffer(content, _STL_FACET, n_facets, 84)["corners"].reshape(-1, 3)
    elif content.lstrip()[:5].lower() == b"solid":
        corners = _stl_text_corners(content)
    else:
        raise UnusableContentError("it is cut short, or no STL at all")
    return _weld(corners.astype(np.float64))


def _weld(corners: FloatArray) -> RawSurface:
    """A mesh of (3F, 3) corners in which those that are exactly equal are one point."""
    first, index = merge_rows(corners)
    return RawSurface(corners[first], index.reshape(-1, 3))


def merge_rows(points: NDArray[Any]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Which of (N, 3) points, or other rows, are exactly equal.

    Returns:
        (K,) index of the first of each kind, ascending; (N,) which of those kinds each point is.
    """
    order = np.lexsort(points.T)  # much faster than numpy's unique rows
    ordered = points[order]
    is_new = np.ones(len(points), dtype=bool)
    is_new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    first = order[is_new]
    place = np.empty(len(first), dtype=np.int64)
    place[np.argsort(first)] = np.arange(len(first))
    kind = np.empty(len(points), dtype=np.int64)
    kind[order] = place[np.cumsum(is_new) - 1]
    return np.sort(first), kind


def _stl_text_corners(content: bytes) -> FloatArray:
    corners: list[list[float]] = []
    n_facets = 0
    keyword = b""
    for line in content.splitlines():
        words = line.split()
        if not words:
            continue
        keyword = words[0].lower()
        if keyword == b"vertex" and len(words) == 4:
            corners.append([float(word) for word in words[1:]])
        elif keyword == b"endfacet":
            n_facets += 1
            if len(corners) != 3 * n_facets:
                raise UnusableContentError("a facet has not three corners")
        elif keyword not in (b"solid", b"facet", b"outer", b"endloop", b"endsolid"):
            raise UnusableContentError("it is cut short or damaged")
    if keyword != b"endsolid" or len(corners) != 3 * n_facets:
        raise UnusableContentError("it is cut short")
    return np.array(corners, dtype=np.float64).reshape(-1, 3)


def _parse_obj(content: bytes) -> RawSurface:
    points: list[list[float]] = []
    normals: list[list[float]] = []
    corners: list[int] = []
    offsets = [0]
    text = whole_text(content).replace("\\\r\n", " ").replace("\\\n", " ")
    for line in text.splitlines():
        words = line.partition("#")[0].split()
        if not words:
            continue
        if words[0] in ("v", "vn"):
            if len(words) < 4:
                raise UnusableContentError("a vertex has not three coordinates")
            (points if words[0] == "v" else normals).append([float(word) for word in words[1:4]])
        elif words[0] == "f":
            named = [int(word.partition("/")[0]) for word in words[1:]]
            # From 1 on, or backwards from the last vertex so far; 0 names none.
            corners += [n - 1 if n > 0 else len(points) + n if n else -1 for n in named]
            offsets.append(len(corners))
    faces = triangles_of(np.array(offsets), np.array(corners, dtype=np.int64))
    # The normals of faces are named per corner; only a cloud's belong to its points one by one.
    is_cloud = not len(faces) and len(normals) == len(points)
    return RawSurface(
        np.array(points, dtype=np.float64).reshape(-1, 3),
        faces,
        np.array(normals, dtype=np.float64).reshape(-1, 3) if is_cloud else None,
    )


def _parse_columns(content: bytes) -> RawSurface:
    """Text of 3 or 6 numbers a line."""
    table = number_table(whole_text(content))
    if table.shape[1] not in (3, 6):
        raise UnusableContentError(f"it has {table.shape[1]} numbers a line, not 3 or 6")
    more = table[:, 3:]
    if more.size == 0 or _are_colours(more):
        return RawSurface(table[:, :3], _NO_FACES)
    return RawSurface(table[:, :3], _NO_FACES, more)


def _are_colours(numbers: FloatArray) -> bool:
    """Whole numbers from 0 to 255, other than the 0 and 1 of normals along an axis."""
    in_range = (numbers >= 0.0) & (numbers <= 255.0) & (numbers == np.trunc(numbers))
    return bool(in_range.all() and numbers.max() > 1.0)
