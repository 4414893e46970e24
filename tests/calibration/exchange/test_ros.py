"""ROS camera_info pairs, ours and as camera_calibration writes them."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import yaml

from calibration.exchange.ros import read_ros, write_ros
from navapp.errors import RigError
from navapp.geometry.camera import Camera
from navapp.geometry.rig import RigQuality
from tests.geometry.shapes import STRONG, assert_same_rig, camera, toed_in_rig

# As ROS' camera_calibration prints it: six decimals, metres, 60 mm of baseline, no toe-in.
FOREIGN = """\
image_width: 640
image_height: 480
camera_name: narrow_stereo/{side}
camera_matrix:
  rows: 3
  cols: 3
  data: [533.416717,   0.      , 342.535218,
           0.      , 533.441919, 234.725135,
           0.      ,   0.      ,   1.      ]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.281972, 0.038865, 0.001209, -1.26e-04, 0.000000]
rectification_matrix:
  rows: 3
  cols: 3
  data: [ 0.999956, -0.007513,  0.005687,
          0.007533,  0.999965, -0.003529,
         -0.00566 ,  0.003572,  0.999978]
projection_matrix:
  rows: 3
  cols: 4
  data: [500., 0., 336.580933, {shift},
         0., 500., 244.407452, 0.,
         0., 0., 1., 0.]
"""


def foreign(folder: Path, left: str = FOREIGN, right: str = FOREIGN) -> Path:
    folder.mkdir()
    (folder / "left.yaml").write_text(left.format(side="left", shift="0."), encoding="utf-8")
    (folder / "right.yaml").write_text(right.format(side="right", shift="-30."), encoding="utf-8")
    return folder


def test_a_pair_comes_back(tmp_path: Path) -> None:
    rig = toed_in_rig()
    write_ros(tmp_path / "pair", rig)
    assert_same_rig(read_ros(tmp_path / "pair"), rig)
    assert sorted(path.name for path in (tmp_path / "pair").iterdir()) == [
        "left.yaml", "right.yaml",
    ]  # fmt: skip
    assert [path.name for path in tmp_path.iterdir()] == ["pair"]


def test_what_is_written_is_in_metres_with_the_baseline_in_the_right_projection(tmp_path) -> None:
    rig = toed_in_rig()
    write_ros(tmp_path / "pair", rig)
    left, right = (
        yaml.safe_load((tmp_path / "pair" / f"{side}.yaml").read_text(encoding="utf-8"))
        for side in ("left", "right")
    )
    projection = right["projection_matrix"]
    assert (projection["rows"], projection["cols"]) == (3, 4)
    focal_px, shift = projection["data"][0], projection["data"][3]
    assert -shift / focal_px == pytest.approx(rig.baseline_mm / 1000.0, rel=1e-12)
    assert left["projection_matrix"]["data"][3] == 0.0
    assert left["distortion_model"] == "plumb_bob"
    assert list(left) == [
        "image_width", "image_height", "camera_name", "camera_matrix", "distortion_model",
        "distortion_coefficients", "rectification_matrix", "projection_matrix",
    ]  # fmt: skip


def test_a_pair_of_ros_itself_is_read(tmp_path: Path) -> None:
    rig = read_ros(foreign(tmp_path / "pair"))
    # Both rotations are the same, so the cameras look the same way.
    np.testing.assert_allclose(rig.right_from_left.rotation, np.eye(3), atol=1e-5)
    # The baseline lies along the rectified x axis, which is the first row of the rotation.
    np.testing.assert_allclose(
        rig.right_from_left.translation_mm, [-59.997, 0.451, -0.341], atol=1e-3
    )
    assert rig.left.matrix[0, 2] == 342.535218
    assert rig.left.distortion[3] == -1.26e-4
    assert rig.name == "pair"
    assert (rig.quality, rig.serials) == (None, ("", ""))


@pytest.mark.parametrize("written", ["-1e-04", "-1E-4", "-0.0001"])
def test_numbers_as_other_programs_write_them(tmp_path: Path, written: str) -> None:
    text = FOREIGN.replace("-1.26e-04", written)
    assert read_ros(foreign(tmp_path / "p", text, text)).left.distortion[3] == -1e-4


def test_eight_coefficients_are_a_rational_polynomial(tmp_path: Path) -> None:
    rig = toed_in_rig()
    rig = dataclasses.replace(rig, left=Camera(rig.left.matrix, STRONG[:8], 640, 480))
    write_ros(tmp_path / "pair", rig)
    assert "rational_polynomial" in (tmp_path / "pair" / "left.yaml").read_text(encoding="utf-8")
    np.testing.assert_array_equal(read_ros(tmp_path / "pair").left.distortion, STRONG[:8])


def test_thin_prisms_are_refused_and_nothing_is_written(tmp_path: Path) -> None:
    rig = dataclasses.replace(toed_in_rig(), left=camera(STRONG), quality=RigQuality(True))
    with pytest.raises(RigError, match=r"knows 8 coefficients of distortion.*have 12"):
        write_ros(tmp_path / "pair", rig)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_with_something_in_it_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(RigError, match="exists already"):
        write_ros(tmp_path, toed_in_rig())
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


SPOILED = {
    "fisheye": (("plumb_bob", "equidistant"), "'equidistant' is not supported"),
    "no size": (("image_width: 640\n", ""), "lacks image_width"),
    "no matrix": (("rectification_matrix", "turn"), "lacks rectification_matrix"),
    "words": (("533.416717", "sharp"), "camera_matrix does not hold numbers alone"),
    "few numbers": (("533.416717,", ""), "camera_matrix has 8 numbers, 9 are expected"),
    "seven coefficients": (("0.001209", "0.001209, 0.1, 0.2"), "has 5 coefficients, not 7"),
    "no rotation": (("0.999956", "0.4"), "not a rotation"),
    "other size": (("image_width: 640", "image_width: 800"), "same picture size"),
    "no yaml": (("rows: 3", "rows: ["), "is no YAML"),
    "list": ((FOREIGN, "- 1\n- 2\n"), "holds no keys"),
}


@pytest.mark.parametrize("what", SPOILED)
def test_a_damaged_pair_is_refused(tmp_path: Path, what: str) -> None:
    (old, new), words = SPOILED[what]
    folder = foreign(tmp_path / "pair", left=FOREIGN.replace(old, new, 1))
    with pytest.raises(RigError, match=words):
        read_ros(folder)


def test_swapped_files_are_noticed(tmp_path: Path) -> None:
    folder = foreign(tmp_path / "pair")
    (folder / "left.yaml").rename(folder / "other.yaml")
    (folder / "right.yaml").rename(folder / "left.yaml")
    (folder / "other.yaml").rename(folder / "right.yaml")
    with pytest.raises(RigError, match="has the right camera at the left"):
        read_ros(folder)


def test_cameras_that_were_calibrated_alone_are_no_pair(tmp_path: Path) -> None:
    folder = foreign(tmp_path / "pair")
    text = (folder / "right.yaml").read_text(encoding="utf-8").replace("-30.", "0.")
    (folder / "right.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(RigError, match="holds no baseline"):
        read_ros(folder)


def test_half_a_pair_is_named(tmp_path: Path) -> None:
    (foreign(tmp_path / "pair") / "right.yaml").unlink()
    with pytest.raises(RigError, match=r"has no right\.yaml"):
        read_ros(tmp_path / "pair")
