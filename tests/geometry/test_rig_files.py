"""Rig files that somebody has touched: what is refused, and what is harmless."""

import dataclasses
from datetime import date
from pathlib import Path

import cv2
import numpy as np
import pytest

from navapp.errors import RigError
from navapp.geometry.rig import RigQuality, StereoRig
from navapp.geometry.rig_files import read_rig, write_rig
from tests.geometry.shapes import toed_in_rig

QUALITY = RigQuality(
    False,
    ("the board was always in the middle",),
    0.61,
    date(2026, 3, 1),
    date(2026, 8, 28),
    {"rms_px": 0.07, "holdout_rms_px": 0.08},
    np.diag(np.arange(1.0, 25.0)),
)


def judged_rig() -> StereoRig:
    return dataclasses.replace(toed_in_rig(), quality=QUALITY)


@pytest.fixture(params=["yml", "xml"])
def path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    write_rig(tmp_path / f"rig.{request.param}", judged_rig())
    return tmp_path / f"rig.{request.param}"


def test_the_whole_record_comes_back(path: Path) -> None:
    again = read_rig(path)
    assert again.rig_id == judged_rig().rig_id
    assert again.quality == QUALITY
    np.testing.assert_array_equal(again.quality.covariance, QUALITY.covariance)


def test_opencv_reads_the_file(path: Path) -> None:
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    np.testing.assert_array_equal(storage.getNode("K1").mat(), judged_rig().left.matrix)
    assert storage.getNode("accepted").real() == 0
    storage.release()


def edited(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(old) >= 1
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def without_its_last_line(path: Path) -> None:
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    assert "sha256" in lines[-1]
    path.write_text("".join(lines[:-1]), encoding="utf-8")


EDITS = {
    "number": ("700.", "700.5"),
    "serial": ("L-1", "L-9"),
    "reason": ("always in the middle", "everywhere"),
    "expiry": ("2026-08-28", "2036-08-28"),
    "figure": ("9.", "4."),
}


@pytest.mark.parametrize("is_cut", [False, True], ids=["hash left", "hash removed"])
@pytest.mark.parametrize("what", EDITS)
def test_an_edited_file_is_refused(path: Path, what: str, is_cut: bool) -> None:
    edited(path, *EDITS[what])
    if is_cut:
        without_its_last_line(path)
    with pytest.raises(RigError, match="was changed after it was written"):
        read_rig(path)


@pytest.mark.parametrize("is_cut", [False, True], ids=["hash left", "hash removed"])
def test_an_edited_verdict_is_refused(path: Path, is_cut: bool) -> None:
    is_xml = path.suffix == ".xml"
    edited(path, *(("<accepted>0<", "<accepted>1<") if is_xml else ("accepted: 0", "accepted: 1")))
    if is_cut:
        without_its_last_line(path)
    with pytest.raises(RigError, match="was changed after it was written"):
        read_rig(path)


def test_reordered_lines_are_refused(path: Path) -> None:
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    place = next(i for i, line in enumerate(lines) if "serial_left" in line)
    assert "serial_right" in lines[place + 1]
    lines[place], lines[place + 1] = lines[place + 1], lines[place]
    path.write_text("".join(lines), encoding="utf-8")
    with pytest.raises(RigError, match="was changed after it was written"):
        read_rig(path)


def test_a_file_cut_short_is_refused_wherever_it_is_cut(path: Path) -> None:
    content = path.read_bytes()
    for length in range(0, len(content) - 1, 7):
        path.write_bytes(content[:length])
        with pytest.raises(RigError, match=path.name):
            read_rig(path)


def test_line_ends_of_another_system_change_nothing(path: Path) -> None:
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert read_rig(path).quality == QUALITY


def test_a_plain_file_without_a_record_is_taken_as_it_is(path: Path) -> None:
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    rig = toed_in_rig()
    storage.write("image_width", rig.width)
    storage.write("image_height", rig.height)
    for index, camera in ((1, rig.left), (2, rig.right)):
        storage.write(f"K{index}", np.array(camera.matrix))
        storage.write(f"D{index}", np.array(camera.distortion).reshape(1, -1))
    storage.write("R", np.array(rig.right_from_left.rotation))
    storage.write("T", np.array(rig.right_from_left.translation_mm).reshape(3, 1))
    storage.release()
    again = read_rig(path)
    assert (again.rig_id, again.quality) == (rig.rig_id, None)


def test_a_rig_is_good_to_the_end_of_its_last_day() -> None:
    assert not QUALITY.has_expired(date(2026, 8, 28))
    assert QUALITY.has_expired(date(2026, 8, 29))
    assert not RigQuality(True).has_expired(date(2099, 1, 1))


def test_the_delay_of_a_row_comes_back_and_is_written_only_where_there_is_one(
    tmp_path: Path,
) -> None:
    path, plain = tmp_path / "rolling.yml", tmp_path / "plain.yml"
    rolling = dataclasses.replace(judged_rig(), row_delay_ns=20_862)
    write_rig(path, rolling)
    again = read_rig(path)
    assert again.row_delay_ns == 20_862
    # The identity is the geometry's.
    assert again.rig_id == judged_rig().rig_id
    write_rig(plain, judged_rig())
    assert "row_delay" not in plain.read_text(encoding="utf-8")
    assert read_rig(plain).row_delay_ns == 0


@pytest.mark.parametrize("value", [-5.0, 0.5, float("nan")])
def test_an_impossible_row_delay_is_refused_by_name(tmp_path: Path, value: float) -> None:
    path = tmp_path / "rig.yml"
    write_rig(path, toed_in_rig())
    text = without_seal(path.read_text(encoding="utf-8"))
    shown = ".Nan" if value != value else f"{value}"
    path.write_text(text.replace("image_width:", f"row_delay_ns: {shown}\nimage_width:"))
    with pytest.raises(RigError, match="row_delay_ns"):
        read_rig(path)


def without_seal(text: str) -> str:
    """As a person would write the file: without the hash, and the name that needs it."""
    lines = text.splitlines()
    return "\n".join(one for one in lines if "sha256" not in one and "rig_id" not in one) + "\n"


def test_smaller_pictures_have_fewer_rows_that_take_as_long() -> None:
    rolling = dataclasses.replace(judged_rig(), row_delay_ns=20_000)
    assert rolling.scale(0.5).row_delay_ns == 40_000
