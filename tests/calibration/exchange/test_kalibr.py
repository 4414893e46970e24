"""Kalibr camchains, ours and as Kalibr writes them."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import yaml

from calibration.exchange.kalibr import read_kalibr, write_kalibr
from navapp.errors import RigError
from navapp.geometry.rig import StereoRig
from tests.geometry.shapes import STRONG, assert_same_rig, camera, toed_in_rig

FOREIGN = """\
cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.28368, 0.07451, -1.04e-04, -3.5e-05]
  distortion_model: radtan
  intrinsics: [458.654, 457.296, 367.215, 248.375]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [0.9999972564, 0.0023172067, 0.0003433931, -0.1100742801]
  - [-0.0023120473, 0.9998984240, -0.0140642918, 0.0003991216]
  - [-0.0003761733, 0.0140634412, 0.9999010354, -0.0008537026]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: pinhole
  distortion_coeffs: [-0.28340, 0.07395, 1.9e-04, 1.7e-05]
  distortion_model: radtan
  intrinsics: [457.587, 456.134, 379.999, 255.238]
  resolution: [752, 480]
  rostopic: /cam1/image_raw
"""


def plain_rig() -> StereoRig:
    """Four coefficients a lens, as radtan has them."""
    rig = toed_in_rig()
    return dataclasses.replace(
        rig, left=camera(STRONG[:4]), right=camera(-0.5 * STRONG[:4], focal_px=712.0)
    )


def test_a_chain_comes_back(tmp_path: Path) -> None:
    rig = plain_rig()
    write_kalibr(tmp_path / "camchain.yaml", rig)
    assert_same_rig(read_kalibr(tmp_path / "camchain.yaml"), rig)


def test_what_is_written_is_in_metres(tmp_path: Path) -> None:
    write_kalibr(tmp_path / "camchain.yaml", plain_rig())
    content = yaml.safe_load((tmp_path / "camchain.yaml").read_text(encoding="utf-8"))
    matrix = np.array(content["cam1"]["T_cn_cnm1"])
    rig = plain_rig()
    np.testing.assert_allclose(matrix[:3, 3], rig.right_from_left.translation_mm / 1000.0)
    np.testing.assert_array_equal(matrix[:3, :3], rig.right_from_left.rotation)
    assert set(content["cam0"]) == {
        "cam_overlaps", "camera_model", "distortion_coeffs", "distortion_model", "intrinsics",
        "resolution", "rostopic",
    }  # fmt: skip


def test_a_chain_of_kalibr_itself_is_read(tmp_path: Path) -> None:
    path = tmp_path / "today-camchain.yaml"
    path.write_text(FOREIGN, encoding="utf-8")
    rig = read_kalibr(path)
    assert (rig.width, rig.height) == (752, 480)
    np.testing.assert_allclose(
        rig.right_from_left.translation_mm, [-110.0742801, 0.3991216, -0.8537026], rtol=1e-9
    )
    # cam1_from_cam0: a point far ahead of cam0 moves as the rotation says.
    np.testing.assert_allclose(
        rig.right_from_left.rotate([0.0, 0.0, 1.0]), [0.0003434, -0.0140643, 0.999901], atol=1e-6
    )
    np.testing.assert_array_equal(rig.left.distortion, [-0.28368, 0.07451, -1.04e-4, -3.5e-5])
    assert rig.right.matrix[1, 1] == 456.134
    assert rig.quality is None


def test_a_third_radial_coefficient_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RigError, match=r"knows 4 coefficients of distortion.*have 5"):
        write_kalibr(tmp_path / "camchain.yaml", toed_in_rig())
    assert list(tmp_path.iterdir()) == []


SPOILED = {
    "fisheye": (("radtan", "equidistant"), "cam0: distortion_model 'equidistant'"),
    "omni": (("pinhole", "omni"), "cam0: camera_model 'omni'"),
    "one camera": (("cam1:", "imu0:"), "has cam0, not cam0 and cam1"),
    "third camera": (("cam1:", "cam2: {}\ncam1:"), "has cam0, cam1, cam2"),
    "no chain": (("T_cn_cnm1", "T_cam_imu"), "lacks T_cn_cnm1"),
    "five intrinsics": (("458.654,", "458.654, 1,"), "has 5 numbers, 4 are expected"),
    "no rotation": (("0.9999972564", "0.4"), "not a rotation"),
    "other size": (("[752, 480]", "[640, 480]"), "same picture size"),
    "no camera": (("cam0:", "cam0: 5\nx:"), "cam0 holds no keys"),
    "no yaml": (("[752, 480]", "[752"), "is no YAML"),
    "swapped": (("-0.1100742801", "0.1100742801"), "cam1 at the left of cam0"),
}


@pytest.mark.parametrize("what", SPOILED)
def test_a_damaged_chain_is_refused(tmp_path: Path, what: str) -> None:
    (old, new), words = SPOILED[what]
    path = tmp_path / "camchain.yaml"
    path.write_text(FOREIGN.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(RigError, match=words):
        read_kalibr(path)
