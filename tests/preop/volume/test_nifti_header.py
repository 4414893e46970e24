import gzip
import struct

import numpy as np
import pytest

from navapp.preop.volume.nifti_header import read_nifti_header


def nifti(version, order, extents, bits):
    """A header by the standard's layout, and the voxels it promises."""
    n_axes, dims = len(extents), [len(extents), *extents, *[0] * (7 - len(extents))]
    n_bytes = bits // 8
    for extent in extents[:n_axes]:
        n_bytes *= extent
    if version == 1:
        header = bytearray(352)
        struct.pack_into(f"{order}i", header, 0, 348)
        struct.pack_into(f"{order}8h", header, 40, *dims)
        struct.pack_into(f"{order}hh", header, 70, 4, bits)
        struct.pack_into(f"{order}f", header, 108, 352.0)
    else:
        header = bytearray(544)
        struct.pack_into(f"{order}i", header, 0, 540)
        struct.pack_into(f"{order}hh", header, 12, 4, bits)
        struct.pack_into(f"{order}8q", header, 16, *dims)
        struct.pack_into(f"{order}q", header, 168, 544)
    return bytes(header) + bytes(n_bytes)


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("extents", [(4, 5, 6), (7, 3), (2, 3, 4, 5)])
@pytest.mark.parametrize("pack", [bytes, gzip.compress])
def test_one_byte_less_is_not_whole(tmp_path, version, order, extents, pack):
    content = nifti(version, order, extents, 16)
    path = tmp_path / "any"
    path.write_bytes(pack(content))
    assert read_nifti_header(path).is_whole
    path.write_bytes(pack(content + b"more"))
    assert read_nifti_header(path).is_whole
    path.write_bytes(pack(content[:-1]))
    assert not read_nifti_header(path).is_whole
    path.write_bytes(pack(content)[:-1])
    header = read_nifti_header(path)
    assert header is None or not header.is_whole


@pytest.mark.parametrize("content", [b"", b"\0" * 400, b"\x1f\x8b", b"text " * 200])
def test_something_else_is_not_whole(tmp_path, content):
    path = tmp_path / "any"
    path.write_bytes(content)
    assert read_nifti_header(path) is None
    assert read_nifti_header(tmp_path / "missing") is None


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(("unit", "in_mm"), [(0, 1.0), (1, 1000.0), (2 + 8, 1.0), (3, 0.001)])
def test_the_affine_map_is_in_lps_and_mm(tmp_path, version, order, unit, in_mm):
    content = bytearray(nifti(version, order, (4, 5, 6), 16))
    ras = np.array([[0.5, 0.0, 0.25, 1.0], [0.0, 2.0, 0.0, -3.0], [0.0, 0.0, 4.0, 7.0]])
    (tmp_path / "any").write_bytes(content)
    assert read_nifti_header(tmp_path / "any").lps_from_index is None
    at = (254, "h", 280, "12f", 123, "b") if version == 1 else (348, "i", 400, "12d", 500, "i")
    struct.pack_into(order + at[1], content, at[0], 2)
    struct.pack_into(order + at[3], content, at[2], *ras.ravel())
    struct.pack_into(order + at[5], content, at[4], unit)
    (tmp_path / "any").write_bytes(content)
    expected = in_mm * ras * [[-1.0], [-1.0], [1.0]]
    np.testing.assert_allclose(read_nifti_header(tmp_path / "any").lps_from_index[:3], expected)
