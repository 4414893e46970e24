import json
import re
from pathlib import Path

import numpy as np
import pytest

from navapp.errors import InputError
from navapp.evaluation.recording.divots import measure_divots
from navapp.evaluation.recording.truth_files import (
    DivotTruth,
    PoseTruth,
    TrackerTruth,
    check_truth,
    read_truth,
)
from navapp.geometry.transform import RigidTransform

POSE = RigidTransform.from_parts(
    "left", "femur", [[0, -1, 0], [1, 0, 0], [0, 0, 1]], [1.5, -2.0, 400.0]
)
ROWS = POSE.to_list()
NUMBERS = ",".join(str(value) for row in ROWS for value in row)


def written(folder: Path, content: object, name: str = "truth.json") -> Path:
    path = folder / name
    path.write_text(content if isinstance(content, str) else json.dumps(content), "utf-8")
    return path


@pytest.mark.parametrize("key", ["camera_from_model", "T_leftcam_from_ct"])
def test_poses_as_json(tmp_path, key) -> None:
    frames = [{"index": 3, key: {"femur": ROWS, "tibia": ROWS}}, {"index": 7, key: {"femur": ROWS}}]
    truth = read_truth(written(tmp_path, {"sd_mm": 0.05, "frames": frames}))
    assert isinstance(truth, PoseTruth)
    assert set(truth.poses["femur"]) == {3, 7}
    assert set(truth.poses["tibia"]) == {3}
    assert np.array_equal(truth.poses["femur"][7].matrix, POSE.matrix)
    assert truth.own_error.sd_mm == 0.05
    assert truth.own_error.sd_deg is None


@pytest.mark.parametrize("head", ["", "index,body," + ",".join(f"m{n}" for n in range(16)) + "\n"])
def test_poses_as_csv(tmp_path, head) -> None:
    text = f"{head}3,femur,{NUMBERS}\n4,tibia,{NUMBERS}\n\n"
    truth = read_truth(written(tmp_path, text, "truth.csv"))
    assert isinstance(truth, PoseTruth)
    assert np.array_equal(truth.poses["femur"][3].matrix, POSE.matrix)
    assert set(truth.poses["tibia"]) == {4}


def test_another_tracker_as_json_and_as_csv(tmp_path) -> None:
    times_ns = [1_700_000_000_000_000_001, 1_700_000_000_020_000_000]
    poses = [{"time_ns": time_ns, "matrix": ROWS} for time_ns in times_ns]
    lines = "".join(f"{time_ns},{NUMBERS}\n" for time_ns in times_ns)
    for path in (
        written(tmp_path, {"poses": poses, "sd_deg": 0.1}),
        written(tmp_path, "time_ns," + "m," * 15 + "m\n" + lines, "truth.csv"),
    ):
        truth = read_truth(path)
        assert isinstance(truth, TrackerTruth)
        assert truth.times_ns.tolist() == times_ns
        assert np.array_equal(truth.matrices[1], POSE.matrix)


def test_touched_divots(tmp_path) -> None:
    content = {
        "divots": {"a": [10.0, 0.0, 0.0], "b": [0.0, 20.0, 0.0]},
        "touched": [
            {"index": 1, "name": "a", "left_mm": POSE.apply([10.0, 0, 2.0]).tolist()},
            {"index": 1, "name": "b", "left_mm": POSE.apply([4.0, 20.0, 0]).tolist()},
            {"index": 2, "name": "a", "left_mm": POSE.apply([10.0, 0, 0]).tolist()},
        ],
    }
    truth = read_truth(written(tmp_path, content))
    assert isinstance(truth, DivotTruth)
    errors_mm = measure_divots([POSE, POSE, None, POSE], [0, 1, 2, 3], truth)
    assert errors_mm[1] == pytest.approx(3.0)
    assert [errors_mm[n] for n in (0, 2, 3)] == [None, None, None]
    assert measure_divots([POSE], [2], truth)[0] == pytest.approx(0.0, abs=1e-12)


TURNED = [[2.0 * value for value in row] for row in ROWS[:3]] + [ROWS[3]]
NOT_FINITE = "0,femur," + NUMBERS.replace("400.0", "nan")


@pytest.mark.parametrize(
    ("content", "name", "words"),
    [
        ("{", "truth.json", "cannot be understood"),
        ([], "truth.json", "no object"),
        ({"frames": []}, "truth.json", "empty"),
        ({"frames": [{"index": 0}]}, "truth.json", "frame 0 has no camera_from_model"),
        ({"frames": [{"camera_from_model": {}}]}, "truth.json", "index is missing"),
        ({"frames": [{"index": -1, "camera_from_model": {}}]}, "truth.json", "whole number"),
        (
            {"frames": [{"index": 0, "camera_from_model": {"femru": ROWS}}]},
            "truth.json",
            "the body 'femru', known are femur",
        ),
        (
            {"frames": [{"index": 5, "camera_from_model": {"femur": TURNED}}]},
            "truth.json",
            "frame 5, left_from_femur: ",
        ),
        (
            {"frames": [{"index": 5, "camera_from_model": {"femur": ROWS}}] * 2},
            "truth.json",
            "frame 5 has the femur twice",
        ),
        ({"frames": [], "poses": []}, "truth.json", "has 2 of them"),
        ({"poses": [{"time_ns": 5, "matrix": ROWS}] * 2}, "truth.json", "pose 1 is not after"),
        ({"poses": [{"time_ns": 5, "matrix": TURNED}]}, "truth.json", "pose 0, "),
        (
            {"poses": [{"time_ns": 5, "matrix": ROWS}], "sd_mm": -1},
            "truth.json",
            "sd_mm is no number",
        ),
        (
            {"divots": {}, "touched": [{"index": 0, "name": "a", "left_mm": [0, 0, 0]}]},
            "truth.json",
            "none of the divots",
        ),
        (
            {"divots": {"a": [0, 0]}, "touched": [{"index": 0, "name": "a", "left_mm": [0] * 3}]},
            "truth.json",
            "the place of 'a'",
        ),
        ("", "truth.csv", "no poses"),
        ("1,2,3\n", "truth.csv", "3 columns"),
        (f"1,femur,{NUMBERS}\n2,{NUMBERS}\n", "truth.csv", "pose 1 has 17 columns"),
        (NOT_FINITE, "truth.csv", "frame 0, "),
        (f"0,femur,{NUMBERS.replace('400.0', 'far')}", "truth.csv", "far"),
    ],
)
def test_what_is_no_truth_is_refused_in_one_sentence(tmp_path, content, name, words) -> None:
    with pytest.raises(InputError) as error:
        read_truth(written(tmp_path, content, name))
    assert words in str(error.value)
    assert str(tmp_path / name) in str(error.value)
    assert "\n" not in str(error.value)
    assert error.value.remedy


def test_a_file_that_is_not_there(tmp_path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_truth(tmp_path / "none.json")


def test_a_truth_must_fit_the_recording(tmp_path) -> None:
    frames = [{"index": n, "camera_from_model": {"femur": ROWS}} for n in (0, 12)]
    truth = read_truth(written(tmp_path, {"frames": frames}))
    check_truth(truth, "t.json", range(13), "femur")
    with pytest.raises(InputError, match="picture 12") as error:
        check_truth(truth, "t.json", range(12), "femur")
    assert "0 to 11" in error.value.remedy
    with pytest.raises(InputError, match="nothing of the tibia") as error:
        check_truth(truth, "t.json", range(13), "tibia")
    assert "femur" in error.value.remedy


def test_the_examples_of_the_page_are_what_they_say(tmp_path) -> None:
    page = (Path(__file__).parents[3] / "docs" / "phantom-study.md").read_text("utf-8")
    examples = re.findall(r"^```json\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    kinds = [type(read_truth(written(tmp_path, example))) for example in examples]
    assert kinds == [PoseTruth, TrackerTruth, DivotTruth]


def test_phantoms_have_their_truth_beside_them(data) -> None:
    truth = read_truth(data / "phantom_a" / "patient" / "truth.json")
    assert isinstance(truth, PoseTruth)
    assert truth.numbers == set(range(12))
    assert set(truth.poses) == {"femur", "tibia"}
