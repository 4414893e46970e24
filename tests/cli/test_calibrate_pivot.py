"""`navapp calibrate pivot`: files that it reads, and recorded poses with a published solution."""

import json
from pathlib import Path

import numpy as np
import pytest

from navapp.cli.main import run
from navapp.cli.tool_poses import read_tool_poses
from navapp.devices.simulated_tool import SIMULATED_PLATES, make_shape
from navapp.errors import InputError
from navapp.geometry.transform import rotation_from_vector
from navapp.tools.tool_files import read_tool
from tests.calibration.test_pivot import TIP_MM, poses

HEADER = "time_ns," + ",".join(f"m{row}{column}" for row in range(4) for column in range(4))


def csv_lines(matrices: np.ndarray) -> list[str]:
    return [
        f"{number * 10**7}," + ",".join(repr(float(value)) for value in matrix.ravel())
        for number, matrix in enumerate(matrices)
    ]


@pytest.fixture
def given() -> np.ndarray:
    return poses(np.random.default_rng(4), 30)


def test_csv_with_and_without_a_header_and_json_are_the_same(given, tmp_path) -> None:
    lines = csv_lines(given)
    (tmp_path / "a.csv").write_text("\n".join([HEADER, *lines]) + "\n", encoding="utf-8")
    (tmp_path / "b.csv").write_text("\r\n".join(lines) + "\r\n", encoding="utf-8")
    content = {"poses": [{"time_ns": 5, "matrix": matrix.tolist()} for matrix in given]}
    (tmp_path / "c.json").write_text(json.dumps(content), encoding="utf-8")
    for name in ("a.csv", "b.csv", "c.json"):
        np.testing.assert_allclose(read_tool_poses(tmp_path / name), given, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("p.csv", "", "no poses"),
        ("p.csv", HEADER + "\n", "no poses"),
        ("p.csv", "1,2,3\n", "pose 0 has 3 columns"),
        ("p.csv", "1," + ",".join(["x"] * 16) + "\n", "could not convert"),
        ("p.csv", "1," + ",".join(["1.0"] * 16) + "\n", "pose 0, tracker_from_tool"),
        ("p.csv", "1," + ",".join(["nan"] * 16) + "\n", "pose 0, tracker_from_tool"),
        ("p.json", "{", "cannot be understood"),
        ("p.json", "[]", "no list of poses"),
        ("p.json", '{"poses": [{"time_ns": 1}]}', "matrix"),
        ("p.json", '{"poses": [7]}', "cannot be understood"),
    ],
)
def test_what_holds_no_poses_is_refused_by_name(tmp_path, name, text, words) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words) as caught:
        read_tool_poses(tmp_path / name)
    assert name in str(caught.value)


def test_a_missing_file_is_one_sentence(tmp_path, capsys) -> None:
    assert run(["calibrate", "pivot", str(tmp_path / "none.csv")]) == 3
    assert "none.csv cannot be read" in capsys.readouterr().err


def test_too_little_motion_is_an_exit_code_of_its_own(tmp_path, capsys) -> None:
    still = poses(np.random.default_rng(4), 30, cone_deg=2.0, spin_deg=2.0)
    (tmp_path / "p.csv").write_text("\n".join(csv_lines(still)), encoding="utf-8")
    out = tmp_path / "o.json"
    assert run(["calibrate", "pivot", str(tmp_path / "p.csv"), "--json", str(out)]) == 4
    assert "hardly turned" in capsys.readouterr().err
    assert not out.exists()


def test_the_result_names_the_outliers(given, tmp_path, capsys) -> None:
    given[7, :3, 3] += 9.0
    (tmp_path / "p.csv").write_text("\n".join(csv_lines(given)), encoding="utf-8")
    out = tmp_path / "o.json"
    assert run(["calibrate", "pivot", str(tmp_path / "p.csv"), "--json", str(out)]) == 0
    assert "pose 7 is left out" in capsys.readouterr().out
    content = json.loads(out.read_text(encoding="utf-8"))
    assert content["command"] == "calibrate pivot"
    assert [one["index"] for one in content["outliers"]] == [7]
    assert np.linalg.norm(np.array(content["tip_mm"]) - TIP_MM) < content["bound_mm"]


@pytest.mark.data
def test_the_published_solution_is_found_again(data: Path, tmp_path: Path, capsys) -> None:
    out = tmp_path / "o.json"
    source = data / "calib" / "pivot" / "poses.csv"
    assert run(["calibrate", "pivot", str(source), "--json", str(out)]) == 0
    content = json.loads(out.read_text(encoding="utf-8"))
    linear = content["linear"]
    assert np.round(linear["tip_mm"], 3).tolist() == [-14.473, 394.634, -7.407]
    assert np.round(linear["pivot_mm"], 3).tolist() == [-804.742, -85.474, -2112.131]
    assert round(linear["rms_mm"], 3) == 1.761
    told = capsys.readouterr().out
    assert "(-14.473, 394.634, -7.407)" in told
    assert content["outliers"]
    assert content["rms_mm"] < linear["rms_mm"]
    for one in content["outliers"]:
        assert f"pose {one['index']} is left out" in told


SMALL = "[camera.simulated]\nscale = 0.6\n"


@pytest.mark.release
def test_a_simulated_pointer_is_calibrated_live(tmp_path, capsys) -> None:
    """Its tip is where the simulated maker has put it, with paper that a printer has stretched."""
    (tmp_path / "small.toml").write_text(SMALL, encoding="utf-8")
    out = tmp_path / "pointer.json"
    config = ["--config", str(tmp_path / "small.toml")]
    assert run([*config, "calibrate", "pivot", "--headless", "--out", str(out)]) == 0
    told = capsys.readouterr().out
    assert "name it in [tools] pointer" in told
    tool = read_tool(out)
    made = make_shape("pointer", SIMULATED_PLATES["pointer"], 1)
    assert np.linalg.norm(tool.tip_mm - made.tip_mm) < 0.15
    designed = np.array([2.0, 78.0, 112.0])
    assert np.linalg.norm(tool.tip_mm - designed) > 0.5  # which no drawing tells
    assert tool.axis is None
    assert tool.made_on is not None


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["poses.csv", "--out", "tool.json"], "recorded poses say nothing of a plate"),
        (["poses.csv", "--headless"], "recorded poses say nothing of a plate"),
        (["--turns", "poses.csv"], "--turns needs POSES"),
    ],
)
def test_options_that_contradict_are_refused(options, words, capsys) -> None:
    assert run(["calibrate", "pivot", *options]) == 2
    assert words in capsys.readouterr().err


def test_a_real_camera_needs_the_plate(tmp_path, capsys) -> None:
    (tmp_path / "real.toml").write_text('[camera]\nbackend = "opencv"\n', encoding="utf-8")
    config = ["--config", str(tmp_path / "real.toml")]
    assert run([*config, "calibrate", "pivot", "--out", str(tmp_path / "t.json")]) == 2
    assert "--board PLATE.json" in capsys.readouterr().err
    assert run([*config, "calibrate", "pivot", "--headless"]) == 2
    assert "nobody else leans the tool" in capsys.readouterr().err


def test_recorded_turns_give_the_axis(given, tmp_path, capsys) -> None:
    axis = np.array([0.0, 0.6, 0.8])
    turn = np.tile(np.eye(4), (40, 1, 1))
    turn[:, :3, :3] = [rotation_from_vector(a * axis) for a in np.linspace(-1.0, 1.0, 40)]
    for name, content in (("p.csv", given), ("t.csv", turn)):
        (tmp_path / name).write_text("\n".join(csv_lines(content)), encoding="utf-8")
    out = tmp_path / "o.json"
    paths = [str(tmp_path / "p.csv"), "--turns", str(tmp_path / "t.csv"), "--json", str(out)]
    assert run(["calibrate", "pivot", *paths]) == 0
    content = json.loads(out.read_text(encoding="utf-8"))
    assert abs(np.array(content["axis"]) @ axis) > 0.9999
    assert content["swept_deg"] == [pytest.approx(114.6, abs=0.5)]
    assert "turned by 115 deg" in capsys.readouterr().out
