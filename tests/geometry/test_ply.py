import struct

import numpy as np
import pytest

from navapp.errors import InputError
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.ply import read_ply, write_ply
from tests.geometry.shapes import cube, sphere

QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def head(kind, *lines):
    return "\n".join(["ply", f"format {kind} 1.0", *lines, "end_header"]).encode() + b"\n"


def xyz(kind="float"):
    return [f"property {kind} {axis}" for axis in "xyz"]


def binary(mesh, order, kind="double", polygons=None):
    """A file made by hand, number by number."""
    polygons = [tuple(face) for face in mesh.faces] if polygons is None else polygons
    name = "binary_little_endian" if order == "<" else "binary_big_endian"
    letter = {"float": "f", "double": "d"}[kind]
    content = head(
        name,
        f"element vertex {len(mesh.vertices_mm)}",
        *xyz(kind),
        f"element face {len(polygons)}",
        "property list uchar int vertex_indices",
    )
    for vertex in mesh.vertices_mm:
        content += struct.pack(f"{order}3{letter}", *vertex)
    for polygon in polygons:
        content += struct.pack(f"{order}B{len(polygon)}i", len(polygon), *polygon)
    return content


def ascii_file(mesh, polygons=None):
    polygons = [tuple(face) for face in mesh.faces] if polygons is None else polygons
    lines = [" ".join(repr(float(value)) for value in vertex) for vertex in mesh.vertices_mm]
    lines += [" ".join(str(int(n)) for n in (len(polygon), *polygon)) for polygon in polygons]
    content = head(
        "ascii",
        f"element vertex {len(mesh.vertices_mm)}",
        *xyz("double"),
        f"element face {len(polygons)}",
        "property list uchar int vertex_index",
    )
    return content + ("\n".join(lines) + "\n").encode()


@pytest.fixture
def read(tmp_path):
    def reader(content):
        (tmp_path / "bone.ply").write_bytes(content)
        return read_ply(tmp_path / "bone.ply")

    return reader


@pytest.mark.parametrize("order", ["<", ">"])
def test_binary_of_both_byte_orders_is_read(read, order):
    mesh, _ = read(binary(sphere(), order))
    np.testing.assert_array_equal(mesh.vertices_mm, sphere().vertices_mm)
    np.testing.assert_array_equal(mesh.faces, sphere().faces)


@pytest.mark.parametrize("order", ["<", ">"])
def test_single_precision_is_read(read, order):
    mesh, _ = read(binary(sphere(), order, "float"))
    np.testing.assert_array_equal(mesh.vertices_mm, sphere().vertices_mm.astype(np.float32))


def test_text_is_read(read):
    mesh, _ = read(ascii_file(sphere()))
    np.testing.assert_array_equal(mesh.vertices_mm, sphere().vertices_mm)
    np.testing.assert_array_equal(mesh.faces, sphere().faces)


@pytest.mark.parametrize("order", ["<", ">", "text"])
def test_quads_are_cut_in_two(read, order):
    content = (
        ascii_file(cube(), QUADS) if order == "text" else binary(cube(), order, polygons=QUADS)
    )
    mesh, _ = read(content)
    np.testing.assert_array_equal(mesh.faces, cube().faces)


@pytest.mark.parametrize("order", ["<", "text"])
def test_quads_and_triangles_may_be_mixed(read, order):
    mixed = [*QUADS[:-1], (1, 5, 7), (1, 7, 3)]
    content = (
        ascii_file(cube(), mixed) if order == "text" else binary(cube(), order, polygons=mixed)
    )
    mesh, _ = read(content)
    np.testing.assert_array_equal(mesh.faces, cube().faces)


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian"])
def test_other_properties_before_and_after_are_skipped(read, kind):
    content = head(
        kind,
        "element material 1",
        "property uchar shine",
        "element vertex 3",
        "property uchar red",
        "property float quality",
        *xyz(),
        "property float nx",
        "property short label",
        "element face 1",
        "property uchar flags",
        "property list uchar int vertex_indices",
        "property list uchar float texcoord",
        "element edge 1",
        "property int vertex1",
    )
    rows = [(200, 0.5, 1, 2, 3, 0.1, -7), (201, 0.6, 4, 5, 7, 0.2, -8), (0, 0.7, 8, 9, 1, 0.3, -9)]
    if kind == "ascii":
        text = "9\n" + "".join(" ".join(map(str, row)) + "\n" for row in rows)
        content += (text + "5 3 0 1 2 6 0 0 1 0 1 1\n1\n").encode()
    else:
        content += b"\x09" + b"".join(struct.pack("<B5fh", *row) for row in rows)
        content += struct.pack("<BB3iB6fi", 5, 3, 0, 1, 2, 6, 0, 0, 1, 0, 1, 1, 1)
    mesh, _ = read(content)
    np.testing.assert_array_equal(mesh.vertices_mm, [[1, 2, 3], [4, 5, 7], [8, 9, 1]])
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2]])


def test_space_and_unit_are_found_in_comments_of_any_case(read):
    content = ascii_file(cube()).replace(
        b"element vertex",
        b"COMMENT Exported by hand\nComment space = RAS\nobj_info UNIT=mm\nelement vertex",
    )
    _, header = read(content)
    assert header.tag("SPACE") == "RAS"
    assert header.tag("UNIT") == "mm"
    assert header.tag("DATE") is None
    assert header.comments[0] == "Exported by hand"


def test_a_comment_may_speak_of_the_end_of_the_header(read):
    content = binary(cube(), "<").replace(
        b"element vertex", b"comment the end_header line follows\nelement vertex"
    )
    np.testing.assert_array_equal(read(content)[0].faces, cube().faces)


def test_carriage_returns_are_no_part_of_the_header(read):
    header, body = binary(cube(), "<").split(b"end_header\n")
    header = (header + b"end_header\n").replace(b"\n", b"\r\n")
    np.testing.assert_array_equal(read(header + body)[0].vertices_mm, cube().vertices_mm)


def test_a_cloud_has_no_triangles(read):
    cloud, _ = read(head("ascii", "element vertex 2", *xyz()) + b"1 2 3\n4 5 6\n")
    assert cloud.vertices_mm.shape == (2, 3)
    assert cloud.faces.shape == (0, 3)


@pytest.mark.parametrize("kind", ["<", ">", "<quads", "text"])
def test_a_file_cut_anywhere_is_refused(tmp_path, kind):
    shape = cube(20.0)
    if kind == "text":
        content = ascii_file(shape)
    else:
        content = binary(shape, kind[0], polygons=QUADS if "quads" in kind else None)
    path = tmp_path / "cut.ply"
    for length in range(len(content)):
        path.write_bytes(content[:length])
        with pytest.raises(InputError, match=r"cut\.ply"):
            read_ply(path)


def test_a_cloud_cut_in_its_header_is_refused(tmp_path):
    content = head("binary_little_endian", "element vertex 2", *xyz()) + struct.pack(
        "<6f", *range(6)
    )
    path = tmp_path / "cut.ply"
    for length in range(len(content)):
        path.write_bytes(content[:length])
        with pytest.raises(InputError):
            read_ply(path)


def face_list(counter, kind, *values):
    """Three vertices and one face whose numbers are given as a struct."""
    return (
        head(
            "binary_little_endian",
            "element vertex 3",
            *xyz(),
            "element face 1",
            f"property list {counter} {kind} vertex_indices",
        )
        + struct.pack("<9f", *range(9))
        + struct.pack(*values)
    )


def text_face(line, kind="int"):
    return (
        head(
            "ascii",
            "element vertex 3",
            *xyz(),
            "element face 1",
            f"property list uchar {kind} vertex_indices",
        )
        + b"0 0 0\n1 0 0\n0 1 0\n"
        + line
        + b"\n"
    )


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"ply",
        b"solid bone\nfacet normal 0 0 1\n",
        bytes(range(256)) * 4,
        b"ply\nend_header\n",
        head("ascii"),
        head("ascii", "element face 0", "property list uchar int vertex_indices"),
        head("ascii", "element vertex 1", "property float x", "property float y") + b"1 2\n",
        head("ascii", "element vertex many", *xyz()),
        head("ascii", "element vertex -1", *xyz()),
        head("ascii", "property float x"),
        head("ascii", "element vertex 1", "property quaternion x"),
        head("ascii", "element vertex 1", "property"),
        head("ascii", "element vertex 1", "property float"),
        head("ascii", "element vertex 1", *xyz(), *xyz()) + b"1 2 3 4 5 6\n",
        head("ascii", "element vertex 1", *xyz(), "texture wood") + b"1 2 3\n",
        head("ebcdic", "element vertex 1", *xyz()) + b"1 2 3\n",
        head("ascii", "element vertex 1", *xyz()) + b"1 2 three\n",
        head("ascii", "element vertex 1", *xyz()) + b"1 2 nan\n",
        head("ascii", "element vertex 99999999999999999", *xyz()) + b"1 2 3\n",
        head("ascii", "element vertex 99999999999999999") + b"1 2 3\n",
        head("binary_little_endian", "element vertex 99999999999999999", *xyz()) + bytes(12),
        head("binary_little_endian", "element vertex 9") + bytes(12),
        text_face(b"3 0 1 3"),
        text_face(b"3 0 1 -1"),
        text_face(b"3 0 1 1.5"),
        text_face(b"3 0 1 nan"),
        text_face(b"3 0 1 1e300"),
        text_face(b"-3 0 1 2"),
        text_face(b"3 0 1 4294967295", "uint"),
        text_face(b"3 0 1 nan", "float"),
        text_face(b"3 0 1 inf", "float"),
        face_list("uchar", "uint", "<B3I", 3, 0, 1, 2**32 - 1),
        face_list("uchar", "uint", "<B4I", 4, 0, 1, 2, 2**32 - 1),
        face_list("char", "int", "<b3i", -1, 0, 1, 2),
        face_list("char", "int", "<b3i", -128, 0, 1, 2),
        face_list("float", "int", "<f3i", float("nan"), 0, 1, 2),
        face_list("float", "int", "<f3i", float("inf"), 0, 1, 2),
        face_list("uchar", "float", "<B3f", 3, 0, 1, float("nan")),
        face_list("uchar", "double", "<B4d", 4, 0, 1, 2, float("inf")),
    ],
)
def test_garbage_is_refused_by_name(read, content):
    with pytest.raises(InputError, match=r"bone\.ply is not a usable PLY file"):
        read(content)


def test_bytes_changed_at_random_never_raise_anything_else(read):
    rng = np.random.default_rng(5)
    for original in (binary(cube(), "<"), binary(cube(), ">", polygons=QUADS), ascii_file(cube())):
        refused = 0
        for _ in range(150):
            content = bytearray(original)
            for place in rng.integers(0, len(content), 2):
                content[place] = rng.integers(0, 256)
            try:
                mesh, _ = read(bytes(content))
            except InputError:
                refused += 1
            else:
                assert np.isfinite(mesh.vertices_mm).all()
        assert refused > 30


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"femur\.ply cannot be read") as caught:
        read_ply(tmp_path / "femur.ply")
    assert caught.value.subject == str(tmp_path / "femur.ply")
    assert caught.value.remedy


def test_a_folder_is_no_surface(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_ply(tmp_path)


def test_what_was_written_reads_back_bit_for_bit(tmp_path):
    rng = np.random.default_rng(4)
    mesh = TriangleMesh(rng.normal(size=(100, 3)) / 3.0, rng.integers(0, 100, (50, 3)))
    write_ply(tmp_path / "a.ply", mesh, space="RAS")
    again, header = read_ply(str(tmp_path / "a.ply"))
    assert again.vertices_mm.tobytes() == mesh.vertices_mm.tobytes()
    assert again.faces.tobytes() == mesh.faces.tobytes()
    assert (header.tag("SPACE"), header.tag("UNIT")) == ("RAS", "mm")
    write_ply(tmp_path / "b.ply", again, space="RAS")
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()


def test_an_empty_mesh_can_be_written_and_read(tmp_path):
    empty = TriangleMesh(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32))
    write_ply(tmp_path / "a.ply", empty)
    assert len(read_ply(tmp_path / "a.ply")[0].vertices_mm) == 0


def test_open3d_reads_what_is_written(tmp_path):
    open3d = pytest.importorskip("open3d")
    write_ply(tmp_path / "a.ply", sphere())
    mesh = open3d.io.read_triangle_mesh(str(tmp_path / "a.ply"))
    np.testing.assert_allclose(np.asarray(mesh.vertices), sphere().vertices_mm)
    np.testing.assert_array_equal(np.asarray(mesh.triangles), sphere().faces)


@pytest.mark.parametrize("as_text", [False, True])
def test_what_open3d_writes_is_read(tmp_path, as_text):
    open3d = pytest.importorskip("open3d")
    mesh = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(np.array(sphere().vertices_mm)),
        open3d.utility.Vector3iVector(np.array(sphere().faces)),
    )
    mesh.compute_vertex_normals()
    open3d.io.write_triangle_mesh(str(tmp_path / "a.ply"), mesh, write_ascii=as_text)
    again, _ = read_ply(tmp_path / "a.ply")
    np.testing.assert_allclose(again.vertices_mm, sphere().vertices_mm, atol=1e-4)
    np.testing.assert_array_equal(again.faces, sphere().faces)
