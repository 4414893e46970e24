import os

import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813

from navapp.preop.volume.itk_package import (
    import_simple_itk,
    listen_to_codecs,
    lps_from_index_of,
    voxels_of,
)


def test_what_is_written_to_the_terminal_by_a_codec_is_heard_and_not_shown(capfd):
    with listen_to_codecs() as has_complained:
        assert not has_complained()
        os.write(2, b"progress 12 %\n")
        assert not has_complained()
        os.write(2, b"Corrupt JPEG data: premature end\n")
        assert has_complained()
        os.write(2, b"more\n")
        assert has_complained()
    os.write(2, b"after\n")
    assert capfd.readouterr().err == "after\n"


def test_the_terminal_comes_back_after_an_error(capfd):
    n_open = len(os.listdir("/proc/self/fd"))
    with pytest.raises(ZeroDivisionError), listen_to_codecs():
        os.write(2, b"hidden\n" * (1 // 0))
    os.write(2, b"shown\n")
    assert capfd.readouterr().err == "shown\n"
    assert len(os.listdir("/proc/self/fd")) == n_open


def test_warnings_of_the_package_are_off():
    assert not import_simple_itk().ProcessObject.GetGlobalWarningDisplay()


def test_a_matrix_is_what_simpleitk_does_with_an_index():
    image = sitk.GetImageFromArray(np.zeros((3, 4, 5), np.int16))
    image.SetSpacing((0.3, 0.4, 0.5))
    image.SetDirection((0.6, 0.0, 0.8, 0.0, -1.0, 0.0, 0.8, 0.0, -0.6))
    image.SetOrigin((1.0, -2.0, 3.0))
    matrix = lps_from_index_of(image)
    for index in [(0, 0, 0), (4, 0, 0), (0, 3, 0), (0, 0, 2), (4, 3, 2)]:
        expected = image.TransformIndexToPhysicalPoint(index)
        np.testing.assert_allclose(matrix @ [*index, 1.0], [*expected, 1.0])
    assert voxels_of(image).shape == (3, 4, 5)
