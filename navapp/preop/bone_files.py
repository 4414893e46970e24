"""Reads and writes a plan's bone as one PLY file: surface and per-vertex values."""

from pathlib import Path

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.ply import read_ply, write_ply
from navapp.geometry.transform import FloatArray
from navapp.geometry.whole_files import write_whole
from navapp.values import BoneModel

# Vertex properties after the coordinates, all of them or none.
_PROPERTIES = ("cartilage_mm", "cartilage_sd_mm")
_END_OF_HEADER = b"end_header\n"


def write_bone(path: Path, bone: BoneModel) -> None:
    """Write binary little-endian PLY; cartilage as vertex properties when there is some."""
    properties = [getattr(bone, name) for name in _PROPERTIES]
    if not any(values.any() for values in properties):
        write_ply(path, bone.mesh)
        return
    vertices = np.column_stack([bone.mesh.vertices_mm, *properties]).astype("<f8")
    faces = np.empty(len(bone.mesh.faces), dtype=[("n", "u1"), ("indices", "<i4", (3,))])
    faces["n"] = 3
    faces["indices"] = bone.mesh.faces
    names = "".join(f"property double {name}\n" for name in ("x", "y", "z", *_PROPERTIES))
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment SPACE=LPS\ncomment UNIT=mm\n"
        f"element vertex {len(vertices)}\n{names}"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\n"
    ).encode("ascii")
    write_whole(path, header + _END_OF_HEADER + vertices.tobytes() + faces.tobytes())


def read_bone(path: Path) -> tuple[TriangleMesh, FloatArray, FloatArray]:
    """Surface, thickness of the cartilage and its standard deviation; (V,) or empty when unknown.

    Raises:
        InputError: not a PLY file, or damaged.
    """
    mesh, header = read_ply(path)
    _, count, declared = header.elements[0]
    if not {name for name, _, _ in declared}.issuperset(_PROPERTIES):
        return mesh, np.empty(0), np.empty(0)
    content = path.read_bytes()
    start = content.index(_END_OF_HEADER) + len(_END_OF_HEADER)
    columns = np.frombuffer(
        content, [(name, f"<{kind}") for name, kind, _ in declared], count, start
    )
    thickness, sd = (columns[name].astype(np.float64) for name in _PROPERTIES)
    return mesh, thickness, sd
