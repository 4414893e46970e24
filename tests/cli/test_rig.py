"""`navapp rig`: show and convert, through the command line."""

import dataclasses
import json
from datetime import date
from pathlib import Path

import cv2
import numpy as np
import pytest

from navapp.cli.main import run
from navapp.cli.rig import compute_toe_in_deg, format_text
from navapp.geometry import RigQuality, StereoRig, read_rig, write_rig
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from tests.calibration.exchange import test_kalibr, test_ros
from tests.calibration.exchange.test_kalibr import plain_rig
from tests.geometry.shapes import toed_in_rig

QUALITY = RigQuality(
    True, (), 0.21, date(2026, 3, 1), date(2026, 8, 28), {"rms_px": 0.07}, np.eye(22)
)


@pytest.fixture
def source(tmp_path: Path) -> Path:
    write_rig(tmp_path / "rig.yml", dataclasses.replace(plain_rig(), quality=QUALITY))
    return tmp_path / "rig.yml"


def geometry(rig: StereoRig) -> np.ndarray:
    return np.concatenate(
        [
            np.ravel(part)
            for part in (
                rig.left.matrix, rig.left.distortion[:4], rig.right.matrix,
                rig.right.distortion[:4], rig.right_from_left.matrix,
            )
        ]
    )  # fmt: skip


@pytest.mark.parametrize("name", ["a.yml", "a.xml", "pair", "camchain-a.yaml"])
def test_every_format_leads_back(source, tmp_path, name, capsys) -> None:
    there, back = str(tmp_path / name), str(tmp_path / "back.yml")
    assert run(["rig", "convert", str(source), there]) == 0
    assert run(["rig", "convert", there, back]) == 0
    np.testing.assert_allclose(
        geometry(read_rig(back)), geometry(read_rig(source)), rtol=0, atol=1e-9
    )
    err = capsys.readouterr().err
    is_ours = name in ("a.yml", "a.xml")
    assert (read_rig(back).quality == QUALITY) == is_ours
    assert ("quality record" in err) != is_ours
    assert ("serial numbers" in err) != is_ours


@pytest.mark.parametrize("name", ["a.yml", "a.xml"])
def test_opencv_reads_what_we_write(source, tmp_path, name) -> None:
    assert run(["--quiet", "rig", "convert", str(source), str(tmp_path / name)]) == 0
    storage = cv2.FileStorage(str(tmp_path / name), cv2.FILE_STORAGE_READ)
    rig = read_rig(source)
    np.testing.assert_array_equal(storage.getNode("K1").mat(), rig.left.matrix)
    np.testing.assert_array_equal(storage.getNode("R").mat(), rig.right_from_left.rotation)
    np.testing.assert_array_equal(
        storage.getNode("T").mat().ravel(), rig.right_from_left.translation_mm
    )
    storage.release()


def test_the_format_may_be_said(source, tmp_path) -> None:
    out, told = tmp_path / "chain.yaml", tmp_path / "told.json"
    arguments = ["rig", "convert", str(source), str(out), "--to", "kalibr", "--json", str(told)]
    assert run(["--quiet", *arguments]) == 0
    assert "T_cn_cnm1" in out.read_text(encoding="utf-8")
    content = json.loads(told.read_text(encoding="utf-8"))
    assert (content["from"], content["to"]) == ("opencv-yaml", "kalibr")
    assert len(content["warnings"]) == 2


def test_that_a_rig_was_refused_is_not_lost_unless_it_is_forced(tmp_path, capsys) -> None:
    bad = dataclasses.replace(plain_rig(), quality=RigQuality(False, ("too few views",)))
    write_rig(tmp_path / "rig.yml", bad)
    arguments = ["rig", "convert", str(tmp_path / "rig.yml"), str(tmp_path / "pair")]
    assert run(arguments) == 4
    assert not (tmp_path / "pair").exists()
    capsys.readouterr()
    assert run([*arguments, "--force"]) == 0
    assert "was not accepted (too few views)" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("out", "extra", "code", "words"),
    [
        ("a.txt", [], 2, "does not say what format"),
        ("a.yml", ["--to", "opencv-xml"], 2, "does not suit opencv-xml"),
        ("a.yml", ["--to", "ros"], 2, "does not suit ros"),
        ("none/a.yml", [], 3, "does not exist"),
        ("none/pair", [], 3, "cannot be written"),
    ],
)
def test_what_cannot_be_written_is_one_sentence(
    source, tmp_path, capsys, out, extra, code, words
) -> None:
    assert run(["rig", "convert", str(source), str(tmp_path / out), *extra]) == code
    assert words in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["rig.yml"]


def test_five_coefficients_do_not_fit_into_kalibr(tmp_path, capsys) -> None:
    write_rig(tmp_path / "rig.yml", toed_in_rig())
    out = tmp_path / "camchain.yaml"
    assert run(["rig", "convert", str(tmp_path / "rig.yml"), str(out)]) == 3
    assert "knows 4 coefficients" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.parametrize(
    ("name", "content", "code", "words"),
    [
        ("none.yml", None, 3, "does not exist"),
        ("one.yaml", test_ros.FOREIGN.format(side="left", shift=0.0), 2, "one camera of a ROS"),
        ("x.yaml", "a: 1\n", 3, "x.yaml"),
        ("x.yaml", "\t- [", 3, "is no YAML"),
        ("x.xml", "<a>", 3, "x.xml"),
    ],
)
def test_what_is_no_rig_is_one_sentence(tmp_path, capsys, name, content, code, words) -> None:
    if content is not None:
        (tmp_path / name).write_text(content, encoding="utf-8")
    assert run(["rig", "show", str(tmp_path / name)]) == code
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert words in lines[0]


def test_foreign_files_are_shown_by_their_content(tmp_path) -> None:
    chain, pair = tmp_path / "any.name", tmp_path / "pair"
    chain.write_text(test_kalibr.FOREIGN, encoding="utf-8")
    test_ros.foreign(pair)
    out = tmp_path / "out.json"
    for path, form in ((chain, "kalibr"), (pair, "ros")):
        assert run(["--quiet", "rig", "show", str(path), "--json", str(out)]) == 0
        content = json.loads(out.read_text(encoding="utf-8"))
        assert content["format"] == form
        assert content["quality"] is None


def test_a_person_is_told_everything(source, capsys) -> None:
    assert run(["rig", "show", str(source)]) == 0
    told = capsys.readouterr().out
    rig = read_rig(source)
    for words in (
        rig.rig_id, "L-1 and R-2", "640 x 480", f"{rig.baseline_mm:.3f} mm", "712.00",
        "accepted by its calibration", "0.21 mm", "made on 2026-03-01", "2026-08-28",
        "rms_px: 0.07",
    ):  # fmt: skip
        assert words in told, words


def test_the_verdict_and_the_end_of_its_time_are_told() -> None:
    rig = dataclasses.replace(plain_rig(), quality=QUALITY)
    assert "good until 2026-08-28" in format_text(rig, date(2026, 8, 28))
    assert "EXPIRED on 2026-08-28" in format_text(rig, date(2026, 8, 29))
    bad = dataclasses.replace(rig, quality=RigQuality(False, ("too few views",)))
    assert "NOT accepted by its calibration: too few views" in format_text(bad, date(2026, 8, 28))
    assert "nobody says how good" in format_text(plain_rig(), date(2026, 8, 28))


def test_toe_in_is_positive_where_the_axes_meet() -> None:
    def turned(angle_deg: float) -> StereoRig:
        # The right camera stands at +x and looks to the left by so much.
        left_from_right = RigidTransform.from_parts(
            "left", "right", rotation_from_vector([0.0, -np.radians(angle_deg), 0.0]), [80.0, 0, 0]
        )
        return dataclasses.replace(plain_rig(), right_from_left=left_from_right.inverse())

    assert compute_toe_in_deg(turned(5.0)) == pytest.approx(5.0)
    assert compute_toe_in_deg(turned(-2.0)) == pytest.approx(-2.0)
