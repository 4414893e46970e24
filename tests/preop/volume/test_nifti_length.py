import gzip
import struct

import pytest

from navapp.preop.volume.nifti_length import nifti_is_whole


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
    assert nifti_is_whole(path)
    path.write_bytes(pack(content + b"more"))
    assert nifti_is_whole(path)
    path.write_bytes(pack(content[:-1]))
    assert not nifti_is_whole(path)
    path.write_bytes(pack(content)[:-1])
    assert not nifti_is_whole(path)


@pytest.mark.parametrize("content", [b"", b"\0" * 400, b"\x1f\x8b", b"text " * 200])
def test_something_else_is_not_whole(tmp_path, content):
    path = tmp_path / "any"
    path.write_bytes(content)
    assert not nifti_is_whole(path)
    assert not nifti_is_whole(tmp_path / "missing")
