import struct

import numpy as np
import pytest

from navapp.errors import InputError
from navapp.geometry.surface_files import read_surface_file
from navapp.geometry.vtk_files import triangles_of
from tests.geometry.shapes import cube

QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
MIXED = [*QUADS[:-1], (1, 5, 7), (1, 7, 3)]
LETTERS = {"float": "f", "double": "d", "int": "i", "short": "h", "vtktypeint64": "q"}


def head(kind="ASCII", version="3.0", dataset="POLYDATA", title="a surface"):
    return f"# vtk DataFile Version {version}\n{title}\n{kind}\nDATASET {dataset}\n".encode()


def block(kind, type_name, values):
    """Numbers as text or big-endian, with the line break that ends them."""
    if kind == "ASCII":
        return (" ".join(str(value) for value in values) + "\n").encode()
    return struct.pack(f">{len(values)}{LETTERS[type_name]}", *values) + b"\n"


def points(kind="ASCII", type_name="float", vertices=None):
    vertices = cube().vertices_mm if vertices is None else np.asarray(vertices)
    values = vertices.ravel().tolist()
    if type_name in ("int", "short"):
        values = [int(value) for value in values]
    line = f"POINTS {len(vertices)} {type_name}\n".encode()
    return line + block(kind, type_name, values)


def cells(kind="ASCII", polygons=QUADS, keyword="POLYGONS"):
    flat = [number for polygon in polygons for number in (len(polygon), *polygon)]
    return f"{keyword} {len(polygons)} {len(flat)}\n".encode() + block(kind, "int", flat)


def cells_51(kind="ASCII", polygons=QUADS, keyword="POLYGONS"):
    offsets = [0, *np.cumsum([len(polygon) for polygon in polygons]).tolist()]
    corners = [index for polygon in polygons for index in polygon]
    return (
        f"{keyword} {len(offsets)} {len(corners)}\nOFFSETS vtktypeint64\n".encode()
        + block(kind, "vtktypeint64", offsets)
        + b"CONNECTIVITY vtktypeint64\n"
        + block(kind, "vtktypeint64", corners)
    )


@pytest.fixture
def read(tmp_path):
    def reader(content):
        (tmp_path / "bone.vtk").write_bytes(content)
        return read_surface_file(tmp_path / "bone.vtk")

    return reader


@pytest.mark.parametrize("kind", ["ASCII", "BINARY"])
@pytest.mark.parametrize("layout", [cells, cells_51])
@pytest.mark.parametrize("polygons", [QUADS, MIXED, cube().faces.tolist()])
def test_both_cell_layouts_give_the_triangles(read, kind, layout, polygons):
    found = read(head(kind) + points(kind) + layout(kind, polygons))
    np.testing.assert_array_equal(found.mesh.vertices_mm, cube().vertices_mm)
    np.testing.assert_array_equal(found.mesh.faces, cube().faces)
    np.testing.assert_allclose(found.mesh.normals, cube().normals)
    assert found.has_normals
    assert (found.unit, found.n_dropped) == (None, 0)


@pytest.mark.parametrize("kind", ["ASCII", "BINARY"])
@pytest.mark.parametrize("type_name", ["float", "double", "int", "short"])
def test_points_may_be_of_any_type(read, kind, type_name):
    found = read(head(kind) + points(kind, type_name))
    np.testing.assert_array_equal(found.mesh.vertices_mm, cube().vertices_mm)
    assert not found.has_normals


def test_double_precision_is_kept(read):
    vertices = np.array([[1000.123456789, 1.0 / 3.0, -2e-9]])
    found = read(head("BINARY") + points("BINARY", "double", vertices))
    np.testing.assert_array_equal(found.mesh.vertices_mm, vertices)


@pytest.mark.parametrize("layout", [cells, cells_51])
def test_every_second_triangle_of_a_strip_is_turned(read, layout):
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0]]
    found = read(
        head() + points(vertices=vertices) + layout(polygons=[range(5)], keyword="TRIANGLE_STRIPS")
    )
    np.testing.assert_array_equal(found.mesh.faces, [[0, 1, 2], [2, 1, 3], [2, 3, 4]])
    np.testing.assert_array_equal(found.mesh.normals, [[0, 0, 1]] * 5)


def test_polygons_and_strips_add_up_and_lines_and_vertices_do_not_count(read):
    found = read(
        head()
        + points()
        + cells(polygons=[(0,), (1,)], keyword="VERTICES")
        + cells_51(polygons=[(0, 1, 2)], keyword="LINES")
        + cells(polygons=QUADS[:1])
        + cells(polygons=[(4, 6, 7)], keyword="TRIANGLE_STRIPS")
    )
    np.testing.assert_array_equal(found.mesh.faces, [[0, 1, 3], [0, 3, 2], [4, 6, 7]])


def test_cells_of_many_sizes_are_cut_in_fans():
    offsets = np.array([0, 2, 7, 7, 10, 11])
    corners = np.arange(10, 21)
    np.testing.assert_array_equal(
        triangles_of(offsets, corners),
        [[12, 13, 14], [12, 14, 15], [12, 15, 16], [17, 18, 19]],
    )


def test_what_else_a_file_holds_is_stepped_over(read):
    content = (
        head(version="5.1", title="")
        + b"FIELD FieldData 3\nSPACE 1 1 string\nRAS\nNULL_ARRAY\nn 2 1 long\n7 8\n"
        + b"METADATA\nCOMPONENT_NAMES\nfirst\nsecond\n\n"
        + points()
        + b"METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 1.7\n\n"
        + cells_51()
        + b"CELL_DATA 6\nNORMALS cells float\n"
        + b"5 0 0\n" * 6
        + b"POINT_DATA 8\nSCALARS height float\nLOOKUP_TABLE default\n0 1 2 3 4 5 6 7\n"
        + b"SCALARS pair int 2\nLOOKUP_TABLE mine\n"
        + b"0 1 2 3 4 5 6 7\n" * 2
        + b"LOOKUP_TABLE mine 2\n0 0 0 1\n1 1 1 1\nCOLOR_SCALARS rgb 3\n"
        + b"0 .5 1\n" * 8
        + b"TEXTURE_COORDINATES uv 2 float\n"
        + b"0 1\n" * 8
        + b"VECTORS flow double\n"
        + b"0 1 2\n" * 8
        + b"TENSORS stress double\n"
        + b"0 1 2 3 4 5 6 7 8\n" * 8
        + b"GLOBAL_IDS id vtkIdType\n0 1 2 3 4 5 6 7\nNORMALS Normals float\n"
        + b"0 2 0\n" * 8
    )
    found = read(content)
    np.testing.assert_array_equal(found.mesh.faces, cube().faces)
    np.testing.assert_array_equal(found.mesh.normals, [[0, 1, 0]] * 8)


def test_what_else_a_binary_file_holds_is_stepped_over(read):
    long_text = b"y" * 70
    content = (
        head("BINARY", "5.1")
        + b"FIELD FieldData 2\nSPACE 1 1 string\n\xc3RAS\n"
        + b"note 1 2 string\n\x80\x46"
        + long_text
        + b"\x40\x00\x00\x01z\n"
        + points("BINARY")
        + cells_51("BINARY")
        + b"POINT_DATA 8\nSCALARS mask bit\nLOOKUP_TABLE default\n\x0a\n"
        + b"SCALARS small unsigned_char\nLOOKUP_TABLE mine\nPOINT_DA\n"
        + b"LOOKUP_TABLE mine 1\nabcd\nCOLOR_SCALARS rgb 1\nNORMALS \n"
        + b"NORMALS n float\n"
        + struct.pack(">24f", *[0, 0, -3] * 8)
        + b"\n"
    )
    found = read(content)
    np.testing.assert_array_equal(found.mesh.faces, cube().faces)
    np.testing.assert_array_equal(found.mesh.normals, [[0, 0, -1]] * 8)


def test_no_cells_at_all_is_a_cloud(read):
    empty = b"POLYGONS 0 0\nOFFSETS vtktypeint64\nCONNECTIVITY vtktypeint64\n"
    for content in (points(), points() + b"POLYGONS 0 0\n", points() + empty):
        assert read(head() + content).mesh.faces.shape == (0, 3)


def test_line_ends_of_windows_do_not_matter(read):
    content = (head() + points() + cells()).replace(b"\n", b"\r\n")
    np.testing.assert_array_equal(read(content).mesh.faces, cube().faces)


def test_points_that_are_not_finite_go_with_their_faces(read):
    vertices = np.array(cube().vertices_mm)
    vertices[0] = np.nan
    found = read(head() + points(vertices=vertices) + cells())
    assert found.n_dropped == 1
    np.testing.assert_array_equal(found.mesh.vertices_mm, cube().vertices_mm[1:])
    kept = cube().faces[(cube().faces != 0).all(axis=1)] - 1
    np.testing.assert_array_equal(found.mesh.faces, kept)


@pytest.mark.parametrize("kind", ["ASCII", "BINARY"])
@pytest.mark.parametrize("layout", [cells, cells_51])
def test_a_file_cut_within_its_numbers_is_refused(tmp_path, kind, layout):
    start = len(head(kind) + points(kind))
    normals = b"POINT_DATA 8\nNORMALS n float\n" + block(kind, "float", [1.5] * 24)
    content = head(kind) + points(kind) + layout(kind) + normals
    path = tmp_path / "cut.vtk"
    # Cut exactly between two sections, a file is whole and says less.
    whole = {start, start - 1, start + len(layout(kind)), start + len(layout(kind)) - 1}
    whole |= {len(content) - 1, len(content) - len(normals) + len("POINT_DATA 8\n")}
    whole |= {len(content) - len(normals) + len("POINT_DATA 8")}
    for length in sorted(set(range(len(content))) - whole):
        path.write_bytes(content[:length])
        with pytest.raises(InputError, match=r"cut\.vtk"):
            read_surface_file(path)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"# vtk DataFile Version 3.0\n",
        b'<?xml version="1.0"?>\n<VTKFile type="PolyData">\n</VTKFile>\n',
        bytes(range(256)) * 4,
        head(),
        head("BINARY"),
        head("EBCDIC") + points(),
        head(dataset="UNSTRUCTURED_GRID") + points(),
        head() + b"POINTS 0 float\n",
        head() + b"POINTS many float\n",
        head() + b"POINTS -1 float\n",
        head() + b"POINTS 1\n1 2 3\n",
        head() + b"POINTS 1 quaternion\n1 2 3\n",
        head() + b"POINTS 1 float\n1 2 three\n",
        head() + b"POINTS 2 float\nnan nan nan\ninf 0 0\n",
        head() + b"POINTS 99999999999999999999999 float\n1 2 3\n",
        head("BINARY") + b"POINTS 99999999999999999999999 float\n1 2 3\n",
        head("BINARY") + b"POINTS 9 float\n" + bytes(12),
        head() + points() + b"POLYGONS 1 4\n3 0 1 8\n",
        head() + points() + b"POLYGONS 1 4\n3 0 1 -1\n",
        head() + points() + b"POLYGONS 1 4\n3 0 1 1.5\n",
        head() + points() + b"POLYGONS 1 4\n3 0 1 nan\n",
        head() + points() + b"POLYGONS 1 4\n4 0 1 2\n",
        head() + points() + b"POLYGONS 2 4\n3 0 1 2\n",
        head() + points() + b"POLYGONS 1 5\n-4 0 1 2 3\n",
        head() + points() + b"POLYGONS 2 3\nOFFSETS vtktypeint64\n0 4\nCONNECTIVITY int\n0 1 2\n",
        head() + points() + b"POLYGONS 2 3\nOFFSETS vtktypeint64\n1 3\nCONNECTIVITY int\n0 1 2\n",
        head() + points() + b"POLYGONS 3 3\nOFFSETS int\n0 5 3\nCONNECTIVITY int\n0 1 2\n",
        head() + points() + b"POLYGONS 2 3\nOFFSETS int\n0 3\n",
        head() + points() + b"POINT_DATA 7\n",
        head() + points() + b"WHATEVER 7\n",
        head() + points() + b"POINT_DATA 8\nSCALARS a float\n1 2 3 4 5 6 7 8\n",
        head("BINARY") + b"FIELD f 1\nname 1 1 string\n\xd0abc\n",
    ],
)
def test_garbage_is_refused_by_name(read, content):
    with pytest.raises(InputError, match=r"bone\.vtk is not a usable VTK file, \w") as caught:
        read(content)
    assert caught.value.remedy


def test_another_data_set_is_named(read):
    with pytest.raises(InputError, match="it holds UNSTRUCTURED_GRID and no POLYDATA"):
        read(head(dataset="UNSTRUCTURED_GRID") + points())


def test_bytes_changed_at_random_never_raise_anything_else(read):
    rng = np.random.default_rng(6)
    for kind in ("ASCII", "BINARY"):
        for layout in (cells, cells_51):
            original = head(kind) + points(kind) + layout(kind)
            refused = 0
            for _ in range(150):
                content = bytearray(original)
                for place in rng.integers(0, len(content), 2):
                    content[place] = rng.integers(0, 256)
                try:
                    found = read(bytes(content))
                except InputError:
                    refused += 1
                else:
                    assert np.isfinite(found.mesh.vertices_mm).all()
            assert refused > 30
