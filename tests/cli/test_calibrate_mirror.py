"""`navapp calibrate mirror` and `calibrate check --display` on picture files."""

import dataclasses
import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from calibration.mirror.seen_views import Scene
from calibration.targets.boards import keys_of
from navapp.cli.main import run
from navapp.cli.mirror_views import read_lens
from navapp.devices.simulated_mirror import true_display
from navapp.errors import InputError
from navapp.geometry.display_model import DisplayModel
from navapp.geometry.display_model_files import read_display_model, write_display_model
from navapp.geometry.rig_files import write_rig
from sim_devices.mirror_setups import draw_setup
from sim_devices.rigs import make_default_rig
from tests.calibration.mirror.simulated_operators import SimulatedOperator
from tests.calibration.mirror.simulated_pictures import take_view
from tests.calibration.mirror.simulated_views import BOARD, PATTERN, eye_camera
from tests.e2e.test_bad_input import refused
from tests.geometry.test_display_model_errors import seen_beside_mm

pytestmark = pytest.mark.xdist_group("mirror views")
N_VIEWS, SEED = 6, 5
SIDES = ("eye_site", "eye_screen", "left", "right")


@dataclasses.dataclass
class Photographed:
    """A folder of views, files beside it, and the truth."""

    folder: Path
    true: DisplayModel
    site_mm: np.ndarray

    @property
    def common(self) -> list[str]:
        return ["--views", str(self.folder), "--board", str(self.folder.parent / "board.json"),
                "--rig", str(self.folder.parent / "rig.yml")]  # fmt: skip


@pytest.fixture(scope="module")
def views(tmp_path_factory: pytest.TempPathFactory) -> Photographed:
    return photograph(tmp_path_factory.mktemp("mirror") / "views", N_VIEWS)


def photograph(folder: Path, n_views: int) -> Photographed:
    folder.mkdir()
    rng = np.random.default_rng(SEED)
    setup, camera = draw_setup(rng), eye_camera(rng, 0.4)
    scene = Scene(BOARD, PATTERN, make_default_rig(), (camera.width, camera.height))
    centres = []
    for number in range(n_views):
        pictures, centre = take_view(rng, setup, scene, camera, number)
        centres += [centre] * pictures.is_eye
        for side in SIDES:
            cv2.imwrite(str(folder / f"{side}_{number:04d}.png"), getattr(pictures, side))
    (folder.parent / "board.json").write_text(json.dumps(keys_of(BOARD)), encoding="utf-8")
    write_rig(folder.parent / "rig.yml", scene.rig)
    true = dataclasses.replace(true_display(setup), eye_mm=np.mean(centres, axis=0))
    return Photographed(folder, true, setup.site_mm)


@pytest.fixture
def today(views: Photographed, tmp_path: Path) -> list[str]:
    """Options that name some of the views, as if they were new."""
    folder = tmp_path / "today"
    folder.mkdir()
    for number in (0, 1, 3):
        for side in SIDES:
            shutil.copy(views.folder / f"{side}_{number:04d}.png", folder)
    return ["--views", str(folder), *views.common[2:]]


@pytest.fixture(scope="module")
def solved(views: Photographed) -> Path:
    """The display file that the command wrote, told.json and report.html beside it."""
    place = views.folder.parent
    command = ["calibrate", "mirror", "--out", str(place / "display.yml"), *views.common]
    command += ["--size", "1920x1080", "--diagonal-inch", "24", "--eye-views", "0,2,4"]
    command += ["--json", str(place / "told.json"), "--report", str(place / "report.html")]
    assert run(command) == 0
    return place / "display.yml"


@pytest.mark.release
def test_the_file_draws_where_the_eye_sees(solved: Path, views: Photographed) -> None:
    model = read_display_model(solved)
    points = views.site_mm + np.random.default_rng(1).uniform(-30.0, 30.0, (40, 3))
    assert np.quantile(seen_beside_mm(model, views.true, points, points), 0.95) < 0.15
    assert model.quality is not None
    assert model.quality.is_accepted
    assert model.quality.expires_on is not None
    told = json.loads((solved.parent / "told.json").read_text(encoding="utf-8"))
    assert (told["command"], told["accepted"]) == ("calibrate mirror", True)
    assert told["views_used"] + len(told["views_dropped"]) == N_VIEWS
    np.testing.assert_allclose(told["eye_mm"], model.eye_mm)
    report = (solved.parent / "report.html").read_text(encoding="utf-8")
    assert "<b>Accepted.</b>" in report
    assert report.count("<svg") == 3


@pytest.mark.release
def test_a_display_that_did_not_move_passes(solved: Path, today: list[str], capsys) -> None:
    assert run(["calibrate", "check", "--display", str(solved), *today]) == 0
    assert "the display still holds: guides appear within 0." in capsys.readouterr().out


def test_a_mirror_that_has_turned_is_told(tmp_path: Path, capsys) -> None:
    seen = photograph(tmp_path / "today", 3)
    change = np.zeros(14)
    # The mirror turned by 0.1 deg: the screen in it by twice as much, 1.6 mm at 450 mm.
    change[0], change[4] = np.radians(0.2), 1.6
    moved = tmp_path / "moved.yml"
    write_display_model(moved, seen.true.move(change))
    command = ["calibrate", "check", "--display", str(moved), *seen.common]
    refused(
        command, capsys, 4, "does not pass: guides appear", "have moved", "calibrate the mirror"
    )


def lens_file(path: Path, width: int = 800) -> Path:
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.write("camera_matrix", np.array([[900.0, 0, 400], [0, 901.0, 300], [0, 0, 1]]))
    storage.write("distortion_coefficients", np.array([[-0.1, 0.02, 0.0, 0.001, 0.0]]))
    storage.write("image_width", width)
    storage.write("image_height", 600)
    storage.release()
    return path


def test_the_lens_of_the_eyes_camera_is_read_or_refused(tmp_path: Path) -> None:
    lens = read_lens(str(lens_file(tmp_path / "lens.yml")), (800, 600))
    assert (lens.matrix[0, 0], lens.distortion[3]) == (900.0, 0.001)
    (tmp_path / "bad.yml").write_text("nothing", encoding="utf-8")
    for name, said in (("none.yml", "does not exist"), ("bad.yml", "damaged or lacks")):
        with pytest.raises(InputError, match=said):
            read_lens(str(tmp_path / name), (800, 600))
    with pytest.raises(InputError, match="not of pictures of 800x600"):
        read_lens(str(lens_file(tmp_path / "small.yml", 640)), (800, 600))


def alignments_file(path: Path, sd_px: float) -> Path:
    rng = np.random.default_rng(3)
    operator = SimulatedOperator(draw_setup(rng), rng, sd_px)
    rows = [operator.align(int(k)) for k in range(0, 48, 3)]
    content = {
        "display": {"width_px": 1920, "height_px": 1080, "pitch_mm": operator.display.pitch_mm},
        "alignments": [
            {"pixel": pixel.tolist(), "point_mm": point.tolist(), "sd_mm": 0.06}
            for pixel, point in rows
        ],
    }
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def test_aligned_crosses_give_a_display(tmp_path: Path) -> None:
    file = alignments_file(tmp_path / "aligned.json", 0.5)
    out = tmp_path / "display.yml"
    command = ["calibrate", "mirror", "--out", str(out), "--alignments", str(file)]
    assert run([*command, "--report", str(tmp_path / "report.html")]) == 0
    model = read_display_model(out)
    assert model.viewing_eye == "right"
    assert model.quality is not None
    assert model.quality.figures["alignments_used"] >= 14
    assert "Accepted." in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_crosses_that_scatter_are_refused_and_not_written(tmp_path: Path, capsys) -> None:
    file = alignments_file(tmp_path / "aligned.json", 6.0)
    out = tmp_path / "display.yml"
    command = ["calibrate", "mirror", "--out", str(out), "--alignments", str(file)]
    refused(command, capsys, 4, "not accepted", "0.60 mm are allowed", "is not written")
    assert not out.exists()
    assert run([*command, "--force"]) == 4
    quality = read_display_model(out).quality
    assert quality is not None
    assert not quality.is_accepted


def test_the_pattern_fills_the_display(tmp_path: Path) -> None:
    file = tmp_path / "pattern.png"
    assert run(["calibrate", "mirror", "--pattern", str(file), "--size", "800x600"]) == 0
    assert cv2.imread(str(file)).shape == (600, 800, 3)


BAD = {
    "no source": (["--out", "d.yml"], 2, "needs one source"),
    "no board": (["--out", "d.yml", "--views", "."], 2, "needs the board and the rig"),
    "no size": (["--pattern", "p.png"], 2, "size of the display is not known"),
    "bad size": (["--pattern", "p.png", "--size", "19x"], 2, "is no size"),
    "no file": (["--out", "d.yml", "--alignments", "no.json"], 3, "does not exist"),
}


@pytest.mark.parametrize("what", BAD)
def test_what_cannot_be_done_is_refused(what: str, tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    arguments, code, words = BAD[what]
    refused(["calibrate", "mirror", *arguments], capsys, code, words)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("[", "not readable as JSON"),
        ('{"display": {"width_px": 1920}, "alignments": []}', "display lacks height_px, pitch_mm"),
        ('{"display": {"width_px": 9, "height_px": 9, "pitch_mm": 1, "x": 1}, "alignments": []}',
         "display has no x"),
        ('{"display": {"width_px": 9, "height_px": 9, "pitch_mm": 1}, "alignments": [{}]}',
         "holds no alignments"),
        ('{"display": {"width_px": 9, "height_px": 9, "pitch_mm": 1}, "alignments": '
         '[{"pixel": [NaN, 1], "point_mm": [1, 2, 3]}]}', "not finite"),
    ],
)  # fmt: skip
def test_damaged_alignments_are_refused(content: str, words: str, tmp_path: Path, capsys) -> None:
    file = tmp_path / "aligned.json"
    file.write_text(content, encoding="utf-8")
    command = ["calibrate", "mirror", "--out", str(tmp_path / "d.yml"), "--alignments", str(file)]
    refused(command, capsys, 3, words)


def test_a_view_without_all_its_pictures_is_refused(tmp_path: Path, capsys) -> None:
    board, rig, folder = (tmp_path / name for name in ("board.json", "rig.yml", "views"))
    board.write_text(json.dumps(keys_of(BOARD)), encoding="utf-8")
    write_rig(rig, make_default_rig())
    folder.mkdir()
    for side in SIDES[:3]:
        cv2.imwrite(str(folder / f"{side}_7.png"), np.zeros((720, 1280, 3), np.uint8))
    command = ["calibrate", "mirror", "--out", str(tmp_path / "d.yml"), "--size", "1920x1080"]
    command += ["--board", str(board), "--rig", str(rig), "--views"]
    refused([*command, str(folder)], capsys, 3, "view 7", "no right picture")
    refused([*command, str(folder / "none")], capsys, 3, "does not exist")


@pytest.mark.parametrize("flip", ["flip_horizontally", "flip_vertically"])
def test_a_display_that_is_flipped_by_its_configuration_is_refused(
    flip: str, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    configuration = tmp_path / "navapp.toml"
    configuration.write_text(f"[display]\n{flip} = true\n", encoding="utf-8")
    out, views = tmp_path / "display.yml", tmp_path / "views"
    words = ["calibrate", "mirror", "--out", str(out), "--views", str(views)]
    assert run(["--config", str(configuration), *words]) == 2
    assert "is not flipped" in capsys.readouterr().err
    assert not out.exists()
