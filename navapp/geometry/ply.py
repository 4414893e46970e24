"""PLY files, with the comments that say which space and unit the numbers are in."""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.raw_surface import RawSurface, damaged, surface_content
from navapp.geometry.transform import FloatArray
from navapp.geometry.whole_files import write_whole

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip


_END_OF_HEADER = re.compile(rb"^end_header[ \t]*\r?\n", re.MULTILINE)


class PlyHeader:
    """What the head of a PLY file says."""

    def __init__(self, path: Path, text: str) -> None:
        self.format = ""
        self.comments: list[str] = []
        self.elements: list[tuple[str, int, list[tuple[str, str, str]]]] = []
        for line in text.splitlines()[1:]:
            words = line.split()
            if not words:
                continue
            keyword = words[0].lower()
            if keyword == "format" and len(words) > 1:
                self.format = words[1].lower()
            elif keyword in ("comment", "obj_info"):
                self.comments.append(line.strip()[len(words[0]) :].strip())
            elif keyword == "element" and len(words) == 3 and words[2].isdigit():
                self.elements.append((words[1].lower(), int(words[2]), []))
            elif keyword == "property" and self.elements:
                self._add_property(path, words)
            elif keyword != "end_header":
                raise damaged(path, f"unknown header line '{line.strip()[:60]}'")
        if self.format not in ("ascii", "binary_little_endian", "binary_big_endian"):
            raise damaged(path, f"unknown format '{self.format}'")
        for name, count, properties in self.elements:
            names = [p for p, _, _ in properties]
            if len(set(names)) < len(names) or (count and not names):
                raise damaged(path, f"the properties of element '{name}' are missing or doubled")

    def _add_property(self, path: Path, words: list[str]) -> None:
        is_list = len(words) == 5 and words[1].lower() == "list"
        types = [word.lower() for word in (words[2:4] if is_list else words[1:2])]
        if any(name not in _TYPES for name in types) or (not is_list and len(words) != 3):
            raise damaged(path, f"unknown property '{' '.join(words[1:])[:60]}'")
        count = _TYPES[types[0]] if is_list else ""
        self.elements[-1][2].append((words[-1].lower(), _TYPES[types[-1]], count))

    def tag(self, key: str) -> str | None:
        """Value of a comment `KEY=value`, or None."""
        for comment in self.comments:
            name, equals, value = comment.partition("=")
            if equals and name.strip().upper() == key:
                return value.strip()
        return None


def read_ply(path: str | Path) -> tuple[TriangleMesh, PlyHeader]:
    """Read a triangle mesh; quads are cut in two. A cloud has no faces.

    Returns:
        The mesh with coordinates as stored, and the header (`tag("SPACE")`, `tag("UNIT")`).

    Raises:
        InputError: missing, not a PLY file, cut short, faces that name no vertex.
    """
    path = Path(path)
    raw, header = parse_ply(path, surface_content(path, "PLY"))
    try:
        mesh = TriangleMesh(raw.points, raw.faces.astype(np.int32))
    except (ValueError, OverflowError) as error:
        raise damaged(path, str(error)) from error
    return mesh, header


def parse_ply(path: Path, content: bytes) -> tuple[RawSurface, PlyHeader]:
    """Everything that a PLY file says of its surface, with normals when nx, ny and nz are there.

    Raises:
        InputError: not a PLY file, cut short, without coordinates.
    """
    end = _END_OF_HEADER.search(content)
    if not content[:3].lower() == b"ply" or end is None:
        raise damaged(path, "it does not begin with a PLY header")
    header = PlyHeader(path, content[: end.start()].decode("ascii", errors="replace"))
    try:
        columns = _read_elements(header, content, end.end())
        vertex = columns.get("vertex", {})
        points, normals = (_three(vertex, names) for names in (("x", "y", "z"), ("nx", "ny", "nz")))
    except (ValueError, IndexError, OverflowError) as error:
        raise damaged(path, "it is cut short or its numbers are broken") from error
    if points is None:
        raise damaged(path, "it has no vertices with x, y and z")
    face = columns.get("face", {})
    polygons = face.get("vertex_indices", face.get("vertex_index", np.empty((0, 3), dtype="i4")))
    try:
        triangles = _triangles(polygons)
    except (ValueError, OverflowError) as error:
        raise damaged(path, str(error)) from error
    unit = (header.tag("UNIT") or "").lower() or None
    return RawSurface(points, triangles, normals, unit), header


def write_ply(
    path: str | Path, mesh: TriangleMesh, *, space: str = "LPS", unit: str = "mm"
) -> None:
    """Write binary little-endian PLY whole (temporary file, flush, rename)."""
    vertices = np.empty(len(mesh.vertices_mm), dtype=[("x", "<f8"), ("y", "<f8"), ("z", "<f8")])
    for column, axis in enumerate("xyz"):
        vertices[axis] = mesh.vertices_mm[:, column]
    faces = np.empty(len(mesh.faces), dtype=[("n", "u1"), ("indices", "<i4", (3,))])
    faces["n"] = 3
    faces["indices"] = mesh.faces
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"comment SPACE={space}\ncomment UNIT={unit}\n"
        f"element vertex {len(vertices)}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    write_whole(path, header.encode("ascii") + vertices.tobytes() + faces.tobytes())


def _three(columns: dict[str, NDArray[np.generic]], names: tuple[str, ...]) -> FloatArray | None:
    """(V, 3) of three columns, or None where one is missing."""
    if not all(name in columns for name in names):
        return None
    if any(columns[name].ndim != 1 or columns[name].dtype == object for name in names):
        raise ValueError("a number was expected, not a list")
    return np.column_stack([np.asarray(columns[name], dtype=np.float64) for name in names])


def _read_elements(
    header: PlyHeader, content: bytes, start: int
) -> dict[str, dict[str, NDArray[np.generic]]]:
    if header.format == "ascii":
        return _read_ascii(header, content[start:])
    order = "<" if header.format == "binary_little_endian" else ">"
    columns: dict[str, dict[str, NDArray[np.generic]]] = {}
    offset = start
    for name, count, properties in header.elements:
        lists = [p for p in properties if p[2]]
        if not lists:
            dtype = np.dtype([(p, order + kind) for p, kind, _ in properties])
            table = np.frombuffer(content, dtype, count, offset)
            columns[name] = {p: table[p] for p, _, _ in properties}
            offset += dtype.itemsize * count
        else:
            columns[name], offset = _read_lists(properties, order, content, offset, count)
    return columns


def _read_lists(
    properties: list[tuple[str, str, str]], order: str, content: bytes, offset: int, count: int
) -> tuple[dict[str, NDArray[np.generic]], int]:
    """An element with one list: fast when every list is a triangle, row by row otherwise."""
    dtype = np.dtype(
        [
            item
            for p, kind, counter in properties
            for item in (
                [(p + "#", order + counter), (p, order + kind, (3,))]
                if counter
                else [(p, order + kind)]
            )
        ]
    )
    if offset + dtype.itemsize * count <= len(content):
        table = np.frombuffer(content, dtype, count, offset)
        if all((table[p + "#"] == 3).all() for p, _, counter in properties if counter):
            return {p: table[p] for p, _, _ in properties}, offset + dtype.itemsize * count
    rows: dict[str, list[NDArray[np.generic]]] = {p: [] for p, _, _ in properties}
    for _ in range(count):
        for p, kind, counter in properties:
            length = 1
            if counter:
                length = int(np.frombuffer(content, order + counter, 1, offset)[0])
                if length < 0:  # to numpy, -1 would be the rest of the file
                    raise ValueError(f"a list of {length} numbers")
                offset += np.dtype(counter).itemsize
            rows[p].append(np.frombuffer(content, order + kind, length, offset))
            offset += np.dtype(kind).itemsize * length
    return {p: np.array(values, dtype=object) for p, values in rows.items()}, offset


def _read_ascii(header: PlyHeader, body: bytes) -> dict[str, dict[str, NDArray[np.generic]]]:
    # Without its last line break a file may have lost digits of its last number.
    if body.strip() and not body.endswith((b"\n", b"\r")):
        raise ValueError("cut short")
    words = body.split()
    position = 0
    columns: dict[str, dict[str, NDArray[np.generic]]] = {}
    for name, count, properties in header.elements:
        rows: dict[str, list[object]] = {p: [] for p, _, _ in properties}
        for _ in range(count):
            for p, kind, counter in properties:
                length = 1
                if counter:
                    length = int(words[position])
                    position += 1
                values = np.array([float(word) for word in words[position : position + length]])
                if len(values) != length:
                    raise IndexError(name)
                position += length
                rows[p].append(_exactly(values, kind) if counter else values[0])
        columns[name] = {
            p: np.array(rows[p], dtype=object if counter else kind)
            for p, kind, counter in properties
        }
    return columns


def _exactly(values: NDArray[np.float64], kind: str) -> NDArray[np.generic]:
    """Numbers of a text in the type that the header promises; whole where it says whole."""
    with np.errstate(invalid="ignore", over="ignore"):
        result = values.astype(kind)
    if kind[0] != "f" and not np.array_equal(result, values):
        raise ValueError("a whole number was expected")
    return result


def _triangles(polygons: NDArray[np.generic]) -> NDArray[np.int32]:
    """(F, 3) triangles; polygons are cut into fans."""
    kinds = {p.dtype.kind for p in polygons} if polygons.dtype == object else {polygons.dtype.kind}
    if "f" in kinds:
        raise ValueError("its faces do not name vertices by whole numbers")
    if polygons.dtype != object:
        return np.asarray(polygons, dtype=np.int64).reshape(-1, 3).astype(np.int32)
    triangles: list[tuple[int, int, int]] = []
    for polygon in polygons:
        corner = [int(index) for index in np.atleast_1d(polygon)]
        triangles += [(corner[0], corner[i], corner[i + 1]) for i in range(1, len(corner) - 1)]
    return np.array(triangles, dtype=np.int64).reshape(-1, 3).astype(np.int32)
