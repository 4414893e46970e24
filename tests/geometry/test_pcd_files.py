import struct

import numpy as np
import pytest

from navapp.errors import InputError
from navapp.geometry.surface_files import read_surface_file
from tests.geometry.pcd_bytes import pcd, pcd_head


@pytest.fixture
def read(tmp_path):
    def reader(name, content):
        (tmp_path / name).write_bytes(content)
        return read_surface_file(tmp_path / name)

    return reader


@pytest.mark.parametrize("kind", ["ascii", "binary", "binary_compressed"])
@pytest.mark.parametrize(("letter", "size"), [("F", 8), ("I", 2), ("U", 1), ("I", 8)])
def test_pcd_numbers_may_be_of_any_type(read, kind, letter, size):
    table = np.array([[1, 2, 3], [40, 50, 60]])
    found = read("a.pcd", pcd(kind, table, letter=letter, size=size))
    np.testing.assert_array_equal(found.mesh.vertices_mm, table)


@pytest.mark.parametrize("kind", ["ascii", "binary", "binary_compressed"])
def test_other_fields_and_padding_of_a_pcd_are_stepped_over(read, kind):
    table = np.arange(28.0).reshape(2, 14)
    fields, counts = "_ y label z _ x histogram", ["1", "1", "1", "1", "2", "1", "7"]
    found = read("a.pcd", pcd(kind, table, fields, counts=counts))
    np.testing.assert_array_equal(found.mesh.vertices_mm, table[:, [6, 1, 3]])


def test_packed_numbers_that_repeat_are_unpacked(read):
    # Twelve zero bytes as one byte and a reference that runs into itself, twice.
    for reference in (b"\x20\x00\x20\x00\x20\x00\x01\x00\x00", b"\xe0\x02\x00"):
        packed = b"\x00\x00" + reference
        content = pcd_head(1, "binary_compressed") + struct.pack("<II", len(packed), 12) + packed
        np.testing.assert_array_equal(read("a.pcd", content).mesh.vertices_mm, [[0, 0, 0]])


@pytest.mark.parametrize("packed", [b"\x20\x00", b"\x00\x00\x20\x07", b"\x00\x00\xe0", b"\x0bab"])
def test_damaged_packing_is_refused(read, packed):
    content = pcd_head(1, "binary_compressed") + struct.pack("<II", len(packed), 12) + packed
    with pytest.raises(InputError, match="not a usable PCD file"):
        read("a.pcd", content)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"POINTS 3", b"POINTS 4"),
        (b"WIDTH 3", b"WIDTH -3"),
        (b"WIDTH 3", b"WIDTH 99999999999999999999"),
        (b"WIDTH 3\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3", b"WIDTH 9999999999999\n"),
        (b"WIDTH 3", b""),
        (b"FIELDS x y z", b"FIELDS x y"),
        (b"FIELDS x y z", b"FIELDS x y q"),
        (b"FIELDS x y z", b"FIELDS x y y"),
        (b"SIZE 4 4 4", b"SIZE 4 4 3"),
        (b"SIZE 4 4 4", b"SIZE 4 4 four"),
        (b"TYPE F F F", b"TYPE F F S"),
        (b"COUNT 1 1 1", b"COUNT 1 1 0"),
        (b"DATA ", b"DATA morse"),
    ],
)
@pytest.mark.parametrize("kind", ["ascii", "binary", "binary_compressed"])
def test_a_damaged_pcd_header_is_refused(read, kind, old, new):
    content = pcd(kind)
    assert old in content
    with pytest.raises(InputError, match="not a usable PCD file"):
        read("a.pcd", content.replace(old, new))


@pytest.mark.parametrize("rows", [b"1 2 3\n4 5\n6 7 8\n", b"1 2 3\n4 5 x\n6 7 8\n", b"1 2 3\n" * 4])
def test_a_damaged_text_pcd_is_refused(read, rows):
    with pytest.raises(InputError, match="not a usable PCD file"):
        read("a.pcd", pcd_head(3, "ascii") + rows)


@pytest.mark.parametrize("options", [{"write_ascii": True}, {}, {"compressed": True}])
def test_what_open3d_writes_as_pcd_is_read(tmp_path, options):
    open3d = pytest.importorskip("open3d")
    rng = np.random.default_rng(8)
    # Rounded, so that the packing finds repetitions.
    points, normals = np.round(rng.normal(size=(2, 2000, 3)), 1) + 0.01
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    cloud.normals = open3d.utility.Vector3dVector(normals)
    open3d.io.write_point_cloud(str(tmp_path / "a.pcd"), cloud, **options)
    found = read_surface_file(tmp_path / "a.pcd")
    np.testing.assert_allclose(found.mesh.vertices_mm, points, atol=1e-6)
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    np.testing.assert_allclose(found.mesh.normals, unit, atol=1e-4)
