"""A real `CalibrationHandler`, written and read back through its own file."""

import json

import numpy as np
import pytest

from drivers.depthai_calibration import make_factory_rig
from navapp.errors import RigError
from tests.drivers.host_oak import calibration, dai

# The maker's numbers are float32.
FLOAT32 = 1e-6


def test_centimetres_become_millimetres_and_the_board_drawing_is_not_used(tmp_path):
    calibration(turn_deg=0.5).eepromToJsonFile(tmp_path / "eeprom.json")
    rig = make_factory_rig(dai.CalibrationHandler(tmp_path / "eeprom.json"), 1280, 800, "ID")
    assert rig.right_from_left.translation_mm == pytest.approx([-75.0, 0.0, 0.0], rel=FLOAT32)
    assert np.degrees(np.arcsin(rig.right_from_left.rotation[0, 2])) == pytest.approx(0.5, rel=1e-5)
    assert rig.left.matrix[0, 0] == 800.0
    assert rig.right.matrix[0, 0] == 801.0
    assert rig.left.distortion[:5] == pytest.approx([0.1, -0.05, 0.001, 0.002, 0.01], rel=FLOAT32)
    assert not rig.left.distortion[5:].any()


def test_it_is_marked_as_the_factorys_and_not_accepted():
    rig = make_factory_rig(calibration(), 1280, 800, "ID")
    assert rig.name == "factory:ID"
    assert rig.serials == ("ID", "ID")
    assert rig.quality is not None
    assert not rig.quality.is_accepted
    assert "factory" in rig.quality.reasons[0]


def test_a_lower_picture_is_cropped_a_smaller_one_scaled():
    cropped = make_factory_rig(calibration(), 1280, 720, "ID")
    assert cropped.left.matrix[:2, 2] == pytest.approx([640.0, 360.0])
    assert cropped.left.matrix[0, 0] == 800.0
    scaled = make_factory_rig(calibration(), 640, 400, "ID")
    assert scaled.left.matrix[:2, 2] == pytest.approx([320.0, 200.0])
    assert scaled.left.matrix[0, 0] == 400.0


def test_a_camera_without_a_calibration_is_told_so():
    with pytest.raises(RigError, match=r"carries no usable calibration .*calibrate it"):
        make_factory_rig(dai.CalibrationHandler(), 1280, 800, "ID")
    anything = dai.CalibrationHandler.fromJson({"a": 1})
    with pytest.raises(RigError, match="carries no usable calibration"):
        make_factory_rig(anything, 1280, 800, "ID")


def test_a_lens_of_another_model_is_refused():
    handler = calibration()
    handler.setCameraType(dai.CameraBoardSocket.CAM_C, dai.CameraModel.Fisheye)
    with pytest.raises(RigError, match="a Fisheye lens"):
        make_factory_rig(handler, 1280, 800, "ID")


def test_a_table_with_a_reflection_is_refused():
    content = json.loads(json.dumps(calibration().eepromToJson()))
    for _, camera in content["cameraData"]:
        camera["extrinsics"]["rotationMatrix"] = np.diag([1.0, 1.0, -1.0]).tolist()
    with pytest.raises(RigError, match="a reflection"):
        make_factory_rig(dai.CalibrationHandler.fromJson(content), 1280, 800, "ID")
