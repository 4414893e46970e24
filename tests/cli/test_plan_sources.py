"""`navapp plan` from a segmentation and from a CT: what is made, shown and refused."""

import json
from pathlib import Path

import numpy as np
import pytest
import SimpleITK

from navapp.cli.main import run
from navapp.preop import read_origin, read_plan, read_plan_view
from navapp.preop.slices import DIRECTIONS
from tests.few_sides import from_few_sides

SPACING_MM = (0.8, 0.8, 1.0)
TURN = np.array([[0.96, -0.28, 0.0], [0.28, 0.96, 0.0], [0.0, 0.0, 1.0]])
CENTRES = {"femur": (10.0, -5.0, 40.0), "tibia": (10.0, -5.0, -10.0)}
RADIUS_MM, VALUES = 18.0, {"femur": 5, "tibia": 6}


def balls() -> SimpleITK.Image:
    """Two balls as labels, in a volume that is turned about z."""
    n = np.array([70, 70, 110])
    index = np.stack(np.meshgrid(*(np.arange(k) for k in n), indexing="ij"), axis=-1)
    origin = np.array([-5.0, -38.0, -35.0])
    points = index * SPACING_MM @ TURN.T + origin
    labels = np.zeros(n, np.uint8)
    for name, centre in CENTRES.items():
        labels[np.linalg.norm(points - centre, axis=-1) < RADIUS_MM] = VALUES[name]
    image = SimpleITK.GetImageFromArray(labels.transpose(2, 1, 0))
    image.SetSpacing(SPACING_MM)
    image.SetOrigin(origin.tolist())
    image.SetDirection(TURN.ravel().tolist())
    return image


@pytest.fixture(scope="module")
def labels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("labels") / "labels.nrrd"
    SimpleITK.WriteImage(balls(), str(path))
    return path


@pytest.fixture(scope="module")
def planned(labels: Path) -> Path:
    folder = labels.parent / "plan"
    with from_few_sides():
        assert run([
            "plan", "--labels", str(labels), "--label", "femur=5", "--label", "tibia=6",
            "--side", "left", "--out", str(folder), "--json", str(labels.parent / "made.json"),
        ]) == 0  # fmt: skip
    return folder


def test_a_segmentation_becomes_bones_where_it_lies(planned) -> None:
    plan = read_plan(planned)
    assert set(plan.bones) == {"femur", "tibia"}
    for name, bone in plan.bones.items():
        radius = np.linalg.norm(bone.mesh.vertices_mm - CENTRES[name], axis=1)
        assert abs(np.median(radius) - RADIUS_MM) < 0.1
        assert np.abs(radius - RADIUS_MM).max() < 0.6
        assert bone.side == "left"
        assert not bone.is_removed.any()


def test_the_folder_holds_edges_pictures_and_a_summary(planned) -> None:
    plan = read_plan(planned)
    assert len(plan.aspects["femur"]) > 9
    page = (planned / "summary.html").read_text(encoding="utf-8")
    assert "not for clinical use" in page
    assert page.count("data:image/png;base64,") == 2
    assert "0.8 x 0.8 x 1 mm" in page
    assert read_origin(planned).kind == "labels"


@pytest.mark.parametrize("direction", DIRECTIONS, ids=lambda one: one.name)
def test_the_slices_hold_the_labels_where_the_surfaces_are(planned, direction) -> None:
    """In a volume that is turned about z: beside the contour inside bright, outside black."""
    view = read_plan_view(planned, read_plan(planned))
    (index,) = view.grid.find_slices(direction, np.array([CENTRES["femur"]])).tolist()
    centre = view.grid.find_pixels(direction, np.array(CENTRES["femur"]))
    ends = view.find_contours(direction, index)["femur"].reshape(-1, 2)
    away = (ends - centre) / np.linalg.norm(ends - centre, axis=1)[:, None]
    plane = view.volume.slice_of(direction, index)
    for offset, expected in ((-2.0, round(255 * 5 / 6)), (2.0, 0)):
        columns, rows = np.rint(ends + offset * away).astype(int).T
        assert (plane[rows, columns] == expected).all(), offset


def test_programs_are_told_of_the_volume(planned) -> None:
    content = json.loads((planned.parent / "made.json").read_text())
    assert content["ct"]["spacing_mm"] == pytest.approx(SPACING_MM)
    assert content["ct"]["size"] == [70, 70, 110]
    assert content["ct"]["threshold_hu"] is None


def test_a_plan_is_shown(planned, capsys) -> None:
    assert run(["plan", "show", str(planned)]) == 0
    shown = capsys.readouterr().out
    assert "from labels, voxels of 0.8 x 0.8 x 1 mm" in shown
    assert "femur: " in shown


@pytest.mark.parametrize("file", ["aspects_femur.npz", "slices.npz", "plan.json"])
def test_an_edited_file_is_noticed(planned, tmp_path, file, capsys) -> None:
    copy = tmp_path / "plan"
    copy.mkdir()
    for path in planned.iterdir():
        (copy / path.name).write_bytes(path.read_bytes())
    content = (copy / file).read_bytes()
    (copy / file).write_bytes(
        content.replace(b"0.8", b"0.9") if file == "plan.json" else content[:-9]
    )
    assert run(["plan", "show", str(copy)]) == 3
    assert "is damaged" in capsys.readouterr().err


NOTHING = "give one of --ct PATH, --labels FILE, --surface NAME=FILE"


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        ([], 2, NOTHING),
        (["--ct", "a", "--labels", "b"], 2, NOTHING),
        (["--ct", "nowhere"], 3, "nowhere does not exist"),
        (["--ct", "nowhere", "--threshold", "20"], 2, "is no density of bone"),
        (["--ct", "nowhere", "--seed", "hip=1,2,3"], 2, "'hip' is no bone of the knee"),
        (["--ct", "nowhere", "--seed", "femur=1,2"], 2, "is not femur=X,Y,Z"),
        (["--ct", "nowhere", "--seed", "femur=1,2,x"], 2, "is not femur=X,Y,Z"),
        (["--ct", "nowhere", "--seed", "femur=1,2,3", "--seed", "femur=1,2,3"], 2, "given twice"),
        (["--ct", "nowhere", "--region", "0,1,0,1"], 2, "is not X0,X1,Y0,Y1,Z0,Z1"),
        (["--ct", "nowhere", "--region", "0,1,0,1,5,5"], 2, "is empty"),
        (["--surface", "femur=f.ply", "--threshold", "300"], 2, "--threshold is for a CT"),
        (["--surface", "femur=f.ply", "--label", "femur=1"], 2, "--label is for a segmentation"),
        (["--labels", "nowhere", "--label", "femur=x"], 2, "is not a value of a label"),
        (["--labels", "nowhere", "--label", "femur=0"], 2, "is not a value of a label"),
        (["--labels", "nowhere"], 2, "which value is which bone"),
        (["--labels", "LABELS", "--label", "femur=9"], 2, "it holds 5, 6"),
    ],
)  # fmt: skip
def test_what_cannot_be_planned_is_one_sentence(
    labels, tmp_path, arguments, code, words, capsys
) -> None:
    named = [str(labels) if word == "LABELS" else word for word in arguments]
    assert run(["plan", *named, "--out", str(tmp_path / "plan")]) == code
    said = capsys.readouterr().err
    assert words in said
    assert len(said.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_a_ct_of_flesh_alone_holds_no_bone(tmp_path, capsys) -> None:
    hu = np.full((100, 120, 120), -1000, np.int16)
    hu[5:-5, 10:-10, 10:-10] = 50
    image = SimpleITK.GetImageFromArray(hu)
    SimpleITK.WriteImage(image, str(tmp_path / "flesh.nii.gz"))
    plan = ["plan", "--ct", str(tmp_path / "flesh.nii.gz"), "--out", str(tmp_path / "plan")]
    assert run(plan) == 3
    assert "there is no bone in the CT" in capsys.readouterr().err
    assert not (tmp_path / "plan").exists()


def test_a_place_that_is_taken_is_refused_before_the_work(labels, tmp_path, capsys) -> None:
    (tmp_path / "letter.txt").write_text("mine")
    arguments = ["plan", "--labels", "nowhere", "--label", "femur=5", "--out", str(tmp_path)]
    assert run(arguments) == 3
    assert "exists and is not a plan" in capsys.readouterr().err
    assert (tmp_path / "letter.txt").read_text() == "mine"


def test_a_place_under_a_file_is_refused_before_the_work(labels, tmp_path, capsys) -> None:
    (tmp_path / "letter.txt").write_text("mine")
    out = tmp_path / "letter.txt" / "plan"
    assert run(["plan", "--labels", "nowhere", "--label", "femur=5", "--out", str(out)]) == 3
    assert "cannot be written" in capsys.readouterr().err
