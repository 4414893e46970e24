import struct

import numpy as np
import pytest

from navapp.errors import InputError
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.ply import write_ply
from navapp.geometry.surface_files import read_surface_file
from tests.geometry.pcd_bytes import CLOUD, lines, pcd
from tests.geometry.shapes import cube, sphere

TILTED = np.array([[1.0, 1.0, 1.0], [0.0, 0.0, 5.0], [0.0, -2.0, 0.0]])
UNIT = np.array([[3**-0.5] * 3, [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def stl_binary(mesh, header=b"made by hand", n=None):
    content = header.ljust(80) + struct.pack("<I", len(mesh.faces) if n is None else n)
    for corners in mesh.vertices_mm[mesh.faces]:
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        content += struct.pack("<12fH", *normal, *corners.ravel(), 0)
    return content


def stl_text(mesh):
    content = "solid a facet of bone\n"
    for corners in mesh.vertices_mm[mesh.faces].tolist():
        content += " facet normal 0 0 0\n  outer loop\n"
        content += "".join(f"   vertex {x!r} {y!r} {z!r}\n" for x, y, z in corners)
        content += "  endloop\n endfacet\n"
    return (content + "endsolid a facet of bone\n").encode()


def obj(mesh):
    content = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in mesh.vertices_mm.tolist())
    content += "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in mesh.faces.tolist())
    return content.encode()


def ply(table, fields="x y z nx ny nz", comment="", faces=()):
    names = "".join(f"property double {name}\n" for name in fields.split())
    rows = [(len(face), *face) for face in faces]
    return (
        f"ply\nformat ascii 1.0\n{comment}element vertex {len(table)}\n{names}"
        f"element face {len(rows)}\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode() + lines([*table, *rows])


@pytest.fixture
def read(tmp_path):
    def reader(name, content):
        (tmp_path / name).write_bytes(content)
        return read_surface_file(tmp_path / name)

    return reader


def assert_same_triangles(found, expected):
    """The same corners in the same order, however the vertices are numbered."""
    np.testing.assert_array_equal(
        found.vertices_mm[found.faces], expected.vertices_mm[expected.faces]
    )


# ------------------------------------------------------------------ every format


MESHES = {
    "binary.stl": stl_binary(cube()),
    "text.STL": stl_text(cube()),
    "a.obj": obj(cube()),
    "a.Ply": ply(cube().vertices_mm, "x y z", faces=cube().faces.tolist()),
}
CLOUDS = {
    "ascii.pcd": pcd("ascii"),
    "binary.PCD": pcd("binary"),
    "packed.pcd": pcd("binary_compressed"),
    "a.xyz": lines(CLOUD),
    "a.csv": lines(CLOUD).replace(b" ", b", "),
    "a.obj": b"".join(b"v " + line + b"\n" for line in lines(CLOUD).splitlines()),
    "a.ply": ply(CLOUD, "x y z"),
}
WITH_NORMALS = np.hstack([CLOUD, TILTED])
CLOUDS_WITH_NORMALS = {
    "ascii.pcd": pcd("ascii", WITH_NORMALS, "x y z normal_x normal_y normal_z"),
    "binary.pcd": pcd("binary", WITH_NORMALS, "x y z normal_x normal_y normal_z"),
    "packed.pcd": pcd("binary_compressed", WITH_NORMALS, "x y z normal_x normal_y normal_z"),
    "a.xyzn": lines(WITH_NORMALS),
    "a.txt": b"# x y z nx ny nz\n\n" + lines(WITH_NORMALS).replace(b" ", b"\t"),
    "a.obj": CLOUDS["a.obj"] + b"vn 1 1 1\nvn 0 0 5\nvn 0 -2 0\n",
    "a.ply": ply(WITH_NORMALS),
    "a.vtk": b"# vtk DataFile Version 3.0\n\nASCII\nDATASET POLYDATA\nPOINTS 3 double\n"
    + lines(CLOUD)
    + b"POINT_DATA 3\nNORMALS n double\n"
    + lines(TILTED),
}


@pytest.mark.parametrize("name", MESHES)
def test_a_mesh_is_read_with_shared_vertices_and_normals_of_its_faces(read, name):
    found = read(name, MESHES[name])
    assert_same_triangles(found.mesh, cube())
    assert len(found.mesh.vertices_mm) == 8
    np.testing.assert_allclose(np.linalg.norm(found.mesh.normals, axis=1), 1.0)
    assert found.mesh.volume_mm3() == pytest.approx(8.0)
    assert found.has_normals
    assert (found.unit, found.n_dropped) == (None, 0)


@pytest.mark.parametrize("name", CLOUDS)
def test_a_cloud_is_read_without_faces_and_normals(read, name):
    found = read(name, CLOUDS[name])
    np.testing.assert_array_equal(found.mesh.vertices_mm, CLOUD)
    assert found.mesh.faces.shape == (0, 3)
    assert not found.has_normals
    np.testing.assert_array_equal(found.mesh.normals, np.zeros((3, 3)))


@pytest.mark.parametrize("name", CLOUDS_WITH_NORMALS)
def test_normals_of_a_cloud_are_made_unit_vectors(read, name):
    found = read(name, CLOUDS_WITH_NORMALS[name])
    np.testing.assert_array_equal(found.mesh.vertices_mm, CLOUD)
    assert found.has_normals
    np.testing.assert_allclose(found.mesh.normals, UNIT)


@pytest.mark.parametrize("name", [*MESHES, *CLOUDS, *CLOUDS_WITH_NORMALS])
def test_a_file_cut_anywhere_is_refused_or_ends_at_a_line(tmp_path, name):
    contents = {**CLOUDS_WITH_NORMALS, **CLOUDS, **MESHES}
    content = contents[name].rstrip(b"\n") if contents[name].endswith(b"\n") else contents[name]
    path = tmp_path / f"cut.{name.split('.')[1]}"
    # Formats that count nothing are whole at the end of every line.
    counts_nothing = path.suffix in (".obj", ".xyz", ".xyzn", ".txt", ".csv", ".vtk")
    n_refused = 0
    for length in range(len(content)):
        path.write_bytes(content[:length])
        if counts_nothing and content[length - 1 : length] == b"\n":
            continue
        if b"endsolid" in content[:length] and name == "text.STL":
            continue
        with pytest.raises(InputError, match=r"cut\.") as caught:
            read_surface_file(path)
        assert caught.value.subject == str(path)
        assert caught.value.remedy
        n_refused += 1
    assert n_refused > 0.8 * len(content)


@pytest.mark.parametrize("suffix", ["ply", "stl", "obj", "vtk", "pcd", "xyz", "txt", "csv"])
@pytest.mark.parametrize(
    "content",
    [b"", b"\n\n", b"hello, bone\n", bytes(range(256)) * 4, b"solid\nendsolid\n", bytes(84)],
)
def test_what_is_no_surface_is_refused(read, suffix, content):
    with pytest.raises(
        InputError, match=rf"a\.{suffix} is not a usable [A-Z]+ file, its? .*: export"
    ):
        read(f"a.{suffix}", content)


@pytest.mark.parametrize("suffix", ["ply", "stl", "obj", "vtk", "pcd", "xyz"])
def test_missing_files_and_folders_cannot_be_read(tmp_path, suffix):
    path = tmp_path / f"bone.{suffix}"
    with pytest.raises(InputError, match=r"bone\.\w+ cannot be read \(No such file"):
        read_surface_file(path)
    path.mkdir()
    with pytest.raises(InputError, match="cannot be read"):
        read_surface_file(path)
    with pytest.raises(InputError, match="cannot be read"):
        read_surface_file(str(tmp_path))


@pytest.mark.parametrize("name", ["bone.step", "bone", "bone.ply.gz"])
def test_an_unknown_suffix_names_the_known_ones(read, name):
    with pytest.raises(InputError, match=r"\.ply, \.stl, \.obj, \.vtk, \.pcd, \.xyz, \.xyzn"):
        read(name, CLOUDS["a.ply"])


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.ply", ply([["nan", "nan", "nan"]], "x y z")),
        ("a.ply", ply([], "x y z")),
        ("a.pcd", pcd("ascii", [["nan", "nan", "nan"]] * 2)),
        ("a.pcd", pcd("binary", np.full((2, 3), np.nan))),
        ("a.pcd", pcd("ascii", np.empty((0, 3)))),
        ("a.pcd", pcd("binary", np.empty((0, 3)))),
        ("a.pcd", pcd("binary_compressed", np.empty((0, 3)))),
        ("a.xyz", b"nan nan nan\n1 inf 2\n"),
        ("a.obj", b"v nan 0 0\n"),
        ("a.obj", b"# nothing\n"),
        ("a.stl", stl_binary(TriangleMesh(np.empty((0, 3)), np.empty((0, 3), dtype=int)))),
        ("a.stl", stl_text(cube()).replace(b"1.0", b"nan")),
    ],
)
def test_a_file_without_any_finite_point_is_refused(read, name, content):
    with pytest.raises(InputError, match="it holds no point with finite coordinates"):
        read(name, content)


def test_bytes_changed_at_random_never_raise_anything_else(read):
    rng = np.random.default_rng(7)
    for name, original in {**CLOUDS_WITH_NORMALS, **MESHES}.items():
        refused = 0
        for _ in range(100):
            content = bytearray(original)
            for place in rng.integers(0, len(content), 3):
                content[place] = rng.integers(0, 256)
            try:
                found = read(name, bytes(content))
            except InputError:
                refused += 1
            else:
                assert np.isfinite(found.mesh.vertices_mm).all()
        assert refused > 3 or name.endswith("binary.stl")


# ------------------------------------------------------------------ points and normals


def test_points_that_are_not_finite_are_left_out_and_counted(read):
    table = np.vstack([[np.nan] * 3, CLOUD, [1.0, np.inf, 2.0]])
    for kind in ("ascii", "binary", "binary_compressed"):
        found = read("a.pcd", pcd(kind, table))
        np.testing.assert_array_equal(found.mesh.vertices_mm, CLOUD)
        assert found.n_dropped == 2


def test_faces_of_points_left_out_go_with_them(read):
    vertices = np.array(cube().vertices_mm)
    vertices[3] = np.nan
    found = read("a.ply", ply(vertices, "x y z", faces=cube().faces.tolist()))
    kept = cube().faces[(cube().faces != 3).all(axis=1)]
    assert_same_triangles(found.mesh, TriangleMesh(cube().vertices_mm, kept))
    assert found.n_dropped == 1
    assert len(found.mesh.vertices_mm) == 7


@pytest.mark.parametrize("face", ["1 2 4", "1 2 0", "1 2 -4"])
def test_faces_that_name_no_vertex_are_refused(read, face):
    with pytest.raises(InputError, match="a face names a vertex that does not exist"):
        read("a.obj", CLOUDS["a.obj"] + f"f {face}\n".encode())


def test_a_vertex_of_no_face_stays_and_does_no_harm(read):
    vertices = np.vstack([cube().vertices_mm, CLOUD])
    found = read("a.obj", obj(TriangleMesh(vertices, cube().faces)))
    assert len(found.mesh.vertices_mm) == 11
    assert found.has_normals
    np.testing.assert_allclose(found.mesh.normals[:8], cube().normals)
    np.testing.assert_array_equal(found.mesh.normals[8:], np.zeros((3, 3)))


@pytest.mark.parametrize("n_absent", [0, 2, 3, 200])
@pytest.mark.parametrize("absent", ["0 0 0", "nan 0 1", "inf 0 1"])
def test_a_cloud_with_more_than_a_few_normals_absent_has_none(read, n_absent, absent):
    rows = [f"{i} 0 1 0 -3 4" for i in range(200)]
    rows[:n_absent] = [f"{i} 0 1 {absent}" for i in range(n_absent)]
    found = read("a.xyz", ("\n".join(rows) + "\n").encode())
    assert found.has_normals == (n_absent <= 2)
    expected = np.tile([0.0, -0.6, 0.8], (200, 1)) * found.has_normals
    expected[:n_absent] = 0.0
    np.testing.assert_allclose(found.mesh.normals, expected)


def test_a_mesh_takes_from_its_faces_what_its_file_leaves_out(read):
    mesh = sphere()
    given = np.tile([0.0, 0.0, 1.0], (len(mesh.vertices_mm), 1))
    given[5] = 0.0
    found = read("a.ply", ply(np.hstack([mesh.vertices_mm, given]), faces=mesh.faces.tolist()))
    np.testing.assert_array_equal(found.mesh.normals[:5], given[:5])
    np.testing.assert_allclose(found.mesh.normals[5], mesh.normals[5])
    found = read("a.ply", ply(np.hstack([mesh.vertices_mm, 0 * given]), faces=mesh.faces.tolist()))
    np.testing.assert_allclose(found.mesh.normals, mesh.normals)
    assert found.has_normals


def test_a_mesh_of_triangles_without_area_has_no_normals(read):
    found = read("a.obj", CLOUDS["a.obj"] + b"f 1 1 2\nf 3 3 3\n")
    assert not found.has_normals


# ------------------------------------------------------------------ what is special to a format


def test_a_ply_says_its_unit(read):
    assert read("a.ply", ply(CLOUD, "x y z", "comment UNIT=MM\n")).unit == "mm"
    assert read("a.ply", ply(CLOUD, "x y z", "comment UNIT=\n")).unit is None


def test_a_ply_of_lists_for_coordinates_is_refused(read):
    content = ply([[3, 1, 2, 3, 4, 5]], "x y z").replace(b"double x", b"list uchar float x")
    with pytest.raises(InputError, match="cut short or its numbers are broken"):
        read("a.ply", content)


def test_what_is_written_as_ply_reads_back(tmp_path):
    write_ply(tmp_path / "a.ply", sphere())
    found = read_surface_file(tmp_path / "a.ply")
    np.testing.assert_array_equal(found.mesh.vertices_mm, sphere().vertices_mm)
    assert found.unit == "mm"


def test_a_binary_stl_may_begin_like_a_text(read):
    assert_same_triangles(read("a.stl", stl_binary(cube(), b"solid bone")).mesh, cube())


@pytest.mark.parametrize("n", [0, 11, 13, 2**32 - 1])
def test_a_binary_stl_of_another_length_than_it_says_is_refused(read, n):
    with pytest.raises(InputError, match="it is cut short, or no STL at all"):
        read("a.stl", stl_binary(cube(), n=n))


def test_stl_corners_are_welded_when_exactly_equal_only(read):
    nearly = TriangleMesh(
        np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [-0.0, 0, 0], [2.0**-20, 1, 0], [1, 1, 0]]),
        np.array([[0, 1, 2], [3, 4, 5]]),
    )
    found = read("a.stl", stl_binary(nearly))
    assert len(found.mesh.vertices_mm) == 5
    assert_same_triangles(found.mesh, nearly)


def test_a_text_stl_may_hold_several_solids_in_capitals(read):
    moved = cube(2.0, (9.0, 0.0, 0.0))
    content = stl_text(cube()) + stl_text(moved)
    found = read("a.stl", content.upper().replace(b"\n", b"\r\n"))
    assert len(found.mesh.faces) == 24
    assert len(found.mesh.vertices_mm) == 16


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"vertex 1.0 1.0 -1.0", b"vertex 1.0 one -1.0"),
        (b"vertex 1.0 1.0 -1.0", b"vertex 1.0 -1.0"),
        (b"vertex 1.0 1.0 -1.0", b""),
        (b"endfacet", b""),
        (b"endfacet", b"edge"),
        (b"endsolid", b""),
    ],
)
def test_a_damaged_text_stl_is_refused(read, old, new):
    content = stl_text(cube())
    assert old in content
    with pytest.raises(InputError, match="not a usable STL file"):
        read("a.stl", content.replace(old, new, 1))


def test_polygons_indices_from_the_end_and_other_lines_of_an_obj(read):
    content = b"""\xef\xbb\xbf# a table
mtllib wood.mtl
o table
v 0 0 0 0.5 0.5 0.5
v 2 0 0
v 2 2 0 # a corner
v 0 2 0
vt 0 0
vn 0 0 1
usemtl wood
s off
f 1/1/1 2/1/1 3//1 \\
  4/1
v 0 0 1
f -1 1 2
l 1 2
# end"""
    found = read("a.obj", content)
    np.testing.assert_array_equal(found.mesh.faces, [[0, 1, 2], [0, 2, 3], [4, 0, 1]])
    assert len(found.mesh.vertices_mm) == 5


@pytest.mark.parametrize("line", [b"v 1 2", b"v 1 2 x", b"f 1 2 x", b"f 1.5 2 3", b"f 1 2 //3"])
def test_a_damaged_obj_is_refused(read, line):
    with pytest.raises(InputError, match="not a usable OBJ file"):
        read("a.obj", obj(cube()) + line + b"\n")


def test_double_precision_of_texts_is_kept(read):
    third = np.array([[1000.0 + 1.0 / 3.0, 1e-17, -7.1]])
    content = b"v " + lines(third)
    np.testing.assert_array_equal(read("a.obj", content).mesh.vertices_mm, third)
    np.testing.assert_array_equal(read("a.xyz", lines(third)).mesh.vertices_mm, third)


@pytest.mark.parametrize(
    "content",
    [
        b"1 2\n",
        b"1 2 3 4\n",
        b"1 2 3 0 0 1 7\n",
        b"1 2 3\n4 5 6 7 8 9\n",
        b"x y z\n1 2 3\n",
        b"1,5 2,5 3,5\n",
        b"1,2,3\n4 5 6\n",
        b"1;2;3\n",
    ],
)
def test_lines_of_other_things_than_3_or_6_numbers_are_refused(read, content):
    with pytest.raises(InputError, match="not a usable XYZ file"):
        read("a.xyz", content)


def test_colours_are_no_normals(read):
    assert not read("a.txt", b"1 2 3 200 180 0\n4 5 6 0 0 1\n").has_normals
    assert read("a.txt", b"1 2 3 1 0 0\n4 5 6 0 0 1\n").has_normals


# ------------------------------------------------------------------ other programs


@pytest.mark.parametrize("suffix", ["stl", "obj"])
def test_what_open3d_writes_as_a_mesh_is_read(tmp_path, suffix):
    open3d = pytest.importorskip("open3d")
    mesh = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(np.array(sphere().vertices_mm)),
        open3d.utility.Vector3iVector(np.array(sphere().faces)),
    )
    mesh.compute_vertex_normals()
    mesh.compute_triangle_normals()
    path = tmp_path / f"a.{suffix}"
    assert open3d.io.write_triangle_mesh(str(path), mesh)
    found = read_surface_file(path)
    assert len(found.mesh.vertices_mm) == len(sphere().vertices_mm)
    corners = found.mesh.vertices_mm[found.mesh.faces]
    expected = sphere().vertices_mm[sphere().faces]
    np.testing.assert_allclose(corners, expected, atol=1e-4)


@pytest.mark.data
def test_recorded_clouds_are_read_with_their_normals(data):
    bunny = read_surface_file(data / "reg" / "pcl_bunny" / "bun0.pcd")
    assert bunny.mesh.vertices_mm.shape == (397, 3)
    assert bunny.has_normals
    cloud = read_surface_file(data / "reg" / "fricp_example" / "source.ply")
    assert cloud.mesh.vertices_mm.shape == (14806, 3)
    assert cloud.has_normals
    np.testing.assert_allclose(np.linalg.norm(cloud.mesh.normals, axis=1), 1.0)
