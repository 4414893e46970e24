"""`navapp stereo`: files, figures and refusals."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from navapp.cli.main import run
from navapp.geometry import Rectifier, RigidTransform, write_rig
from navapp.geometry.ply import write_ply
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from sim_devices.world import World


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A simulated pair with its rig, the femur's surface and its true pose."""
    folder = tmp_path_factory.mktemp("scene")
    world, sensor = World(Scenario(seed=4)), SensorModel(seed=4)
    for eye in ("left", "right"):
        cv2.imwrite(str(folder / f"{eye}.png"), sensor.picture(world.render(eye, 0), eye, 0))
    write_rig(folder / "rig.yml", world.rig)
    write_ply(folder / "femur.ply", world.anatomy.bones["femur"])
    pose = world.left_from_body("femur", 0)
    (folder / "pose.json").write_text(json.dumps({"matrix": pose.to_list()}), encoding="utf-8")
    depth = world.depth("left", 0)
    np.save(folder / "depth.npy", np.where(depth.body == depth.bodies.index("femur"),
                                           depth.depth_mm, np.nan))  # fmt: skip
    return folder


def arguments(scene: Path, *more: str) -> list[str]:
    return [
        "--quiet", "stereo", str(scene / "left.png"), str(scene / "right.png"),
        "--rig", str(scene / "rig.yml"), *more,
    ]  # fmt: skip


def errors_mm(scene: Path, cloud: Path) -> np.ndarray:
    """Depth of the measured points minus the true depth of the femur in their pixels."""
    points, origin = read_cloud(cloud)
    points = points[origin == 1]
    camera = World(Scenario(seed=4)).rig.left
    pixels = camera.project(points)
    truth = np.load(scene / "depth.npy")
    column, row = np.floor(pixels + 0.5).astype(int).T
    inside = (column >= 0) & (row >= 0) & (column < truth.shape[1]) & (row < truth.shape[0])
    difference = points[inside, 2] - truth[row[inside], column[inside]]
    return difference[np.isfinite(difference)]


def read_cloud(path: Path) -> tuple[np.ndarray, np.ndarray]:
    content = path.read_bytes()
    start = content.index(b"end_header\n") + len(b"end_header\n")
    kind = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("sigma_mm", "<f4"), ("origin", "u1")]
    table = np.frombuffer(content, np.dtype(kind), offset=start)
    return np.column_stack([table["x"], table["y"], table["z"]]).astype(float), table["origin"]


@pytest.mark.slow
def test_a_pair_without_a_pose_gives_every_file(scene: Path, tmp_path: Path) -> None:
    names = ("out", "sigma", "origin", "picture", "cloud", "json")
    files = {name: tmp_path / f"{name}.x" for name in names}
    files["origin"], files["picture"] = tmp_path / "o.png", tmp_path / "p.png"
    more = [part for name, path in files.items() for part in (f"--{name}", str(path))]
    assert run(arguments(scene, *more)) == 0
    content = json.loads(files["json"].read_text(encoding="utf-8"))
    disparity, sigma = np.load(files["out"]), np.load(files["sigma"])
    origin = cv2.imread(str(files["origin"]), cv2.IMREAD_UNCHANGED)
    assert content["command"] == "stereo"
    assert disparity.dtype == sigma.dtype == np.float32
    assert disparity.shape == origin.shape == (content["height"], content["width"])
    np.testing.assert_array_equal(np.isfinite(disparity), origin != 0)
    assert content["density_matched"] == pytest.approx((origin == 1).mean())
    assert content["filled_border"] == (origin == 2).sum()
    p2 = np.array(content["rectified"]["P2"])
    geometry = Rectifier(World(Scenario(seed=4)).rig).geometry
    assert -p2[0, 3] / p2[0, 0] == pytest.approx(geometry.baseline_mm)
    off = errors_mm(scene, files["cloud"])
    assert len(off) > 10_000
    assert np.median(np.abs(off)) < 0.3
    assert abs(np.median(off)) < 0.1


@pytest.mark.slow
def test_a_pose_makes_it_finer_and_is_not_handed_back(scene: Path, tmp_path: Path) -> None:
    pose = json.loads((scene / "pose.json").read_text(encoding="utf-8"))["matrix"]
    true = RigidTransform("left", "model", pose)
    nearer = true.move((0.0, 0.0, -0.8, 0.0, 0.0, 0.0), true.translation_mm)
    (tmp_path / "pose.json").write_text(json.dumps({"matrix": nearer.to_list()}), encoding="utf-8")
    cloud = tmp_path / "c.ply"
    more = ["--model", str(scene / "femur.ply"), "--pose", str(tmp_path / "pose.json")]
    assert run(arguments(scene, *more, "--cloud", str(cloud))) == 0
    off = errors_mm(scene, cloud)
    assert len(off) > 10_000
    # The pose was 0.8 mm too near: a matcher that trusts it would be, too.
    assert abs(np.median(off)) < 0.08
    assert np.median(np.abs(off)) < 0.2


def refused(options: list[str], capsys: pytest.CaptureFixture[str], code: int, *words: str) -> None:
    capsys.readouterr()
    assert run(options) == code
    text = capsys.readouterr().err
    assert text.startswith("navapp: error: ")
    assert all(word in text for word in words), text


@pytest.fixture
def small(tmp_path: Path) -> tuple[str, str]:
    noise = np.random.default_rng(2).integers(0, 255, (60, 120), dtype=np.uint8)
    paths = [str(tmp_path / f"{side}.png") for side in ("left", "right")]
    cv2.imwrite(paths[0], noise)
    cv2.imwrite(paths[1], np.roll(noise, -7, axis=1))
    return paths[0], paths[1]


def test_a_pair_of_which_nothing_is_kept_says_so(small, tmp_path: Path, capsys) -> None:
    assert run(["stereo", *small, "--disparities", "16"]) == 0
    assert "nothing is saved: name a file" in capsys.readouterr().err
    out = str(tmp_path / "d.npy")
    assert run(["stereo", *small, "--disparities", "16", "--out", out]) == 0
    assert "nothing is saved" not in capsys.readouterr().err


def test_a_rectified_pair_needs_no_rig(small, tmp_path: Path) -> None:
    out = tmp_path / "d.npy"
    assert run(["--quiet", "stereo", *small, "--disparities", "16", "--out", str(out)]) == 0
    inner = np.load(out)[10:-10, 30:-10]
    assert np.nanmedian(inner) == pytest.approx(7.0, abs=0.05)


@pytest.mark.parametrize(
    ("words", "is_filled"),
    [
        ([], True), (["--fill", "none"], False), (["--matcher", "gradient"], False),
        (["--matcher", "gradient", "--fill", "wls"], True),
    ],
    ids=str,
)  # fmt: skip
def test_occlusions_are_filled_but_for_the_baseline(words, is_filled, small, tmp_path) -> None:
    said = tmp_path / "said.json"
    options = ["--quiet", "stereo", *small, "--disparities", "16", *words, "--json", str(said)]
    assert run(options) == 0
    found = json.loads(said.read_text(encoding="utf-8"))
    assert (found["filled_border"] + found["filled_interior"] > 0) is is_filled


@pytest.mark.parametrize("matcher", ["gradient", "production"])
def test_black_pictures_give_nothing_and_say_so(matcher: str, tmp_path: Path, capsys) -> None:
    black = str(tmp_path / "b.png")
    cv2.imwrite(black, np.zeros((60, 120), dtype=np.uint8))
    options = ["--quiet", "stereo", black, black, "--disparities", "16", "--matcher", matcher]
    refused(options, capsys, 4, "pictures")


@pytest.mark.parametrize("matcher", ["gradient", "production"])
def test_swapped_pictures_are_found(matcher: str, small, capsys) -> None:
    options = ["--quiet", "stereo", small[1], small[0], "--disparities", "16"]
    refused([*options, "--matcher", matcher], capsys, 4, "swapped")


@pytest.mark.slow
def test_with_a_pose_swapped_pictures_are_found(scene: Path, capsys) -> None:
    options = ["--quiet", "stereo", str(scene / "right.png"), str(scene / "left.png")]
    options += ["--rig", str(scene / "rig.yml"), "--model", str(scene / "femur.ply")]
    refused([*options, "--pose", str(scene / "pose.json")], capsys, 4, "swapped")


@pytest.mark.slow
@pytest.mark.parametrize("nearer_mm", [4.0, 8.0, 16.0])
def test_a_pose_that_is_wrong_gives_no_surface(
    nearer_mm: float, scene: Path, tmp_path: Path, capsys
) -> None:
    """Chance confirms a few windows of any support; the fill must not spread them."""
    matrix = np.array(json.loads((scene / "pose.json").read_text(encoding="utf-8"))["matrix"])
    matrix[2, 3] -= nearer_mm
    wrong = tmp_path / "wrong.json"
    wrong.write_text(json.dumps({"matrix": matrix.tolist()}), encoding="utf-8")
    options = arguments(scene, "--model", str(scene / "femur.ply"), "--pose", str(wrong))
    refused(options, capsys, 4, "pose")


def test_pictures_of_different_sizes_and_kinds_are_refused(small, tmp_path, capsys) -> None:
    other = str(tmp_path / "other.png")
    cv2.imwrite(other, np.zeros((50, 120), dtype=np.uint8))
    refused(["stereo", small[0], other, "--disparities", "16"], capsys, 3, "120x50")
    cv2.imwrite(other, np.zeros((60, 120, 3), dtype=np.uint8))
    refused(["stereo", small[0], other, "--disparities", "16"], capsys, 3, "channels")


def test_impossible_requests_are_refused(small, tmp_path, capsys) -> None:
    refused(["stereo", *small], capsys, 2, "--disparities")
    refused(["stereo", *small, "--disparities", "500"], capsys, 2, "120 px")
    refused(["stereo", *small, "--disparities", "1"], capsys, 2, "--disparities")
    refused(["stereo", *small, "--min-disparity", "3"], capsys, 2, "--disparities")
    far = ["--disparities", "16", "--min-disparity", "-500"]
    refused(["stereo", *small, *far], capsys, 2, "120 px")
    refused(["stereo", *small, "--disparities", "9", "--cloud", "c.ply"], capsys, 2, "--rig")
    refused(["stereo", *small, "--disparities", "9", "--model", "m.ply"], capsys, 2, "--pose")
    refused(
        ["stereo", small[0], str(tmp_path / "no.png"), "--disparities", "9"], capsys, 3, "no.png"
    )
    broken = tmp_path / "broken.png"
    broken.write_bytes(Path(small[0]).read_bytes()[:900])
    refused(["stereo", small[0], str(broken), "--disparities", "9"], capsys, 3, "broken.png")
