"""Every bad series is refused with one sentence that names it and the remedy."""

import numpy as np
import pytest

from navapp.errors import InputError
from navapp.preop.volume import list_series, read_ct
from tests.preop.volume.dicom_writing import axial, change

ENCODINGS = ("plain", "JPEG", "JPEG2000")


def refusal(folder) -> str:
    with pytest.raises(InputError) as refused:
        read_ct(folder)
    assert refused.value.exit_code == 3
    text = str(refused.value)
    assert text.startswith(str(folder))
    assert refused.value.remedy
    assert "\n" not in text
    return text


def test_an_empty_folder(tmp_path):
    assert "is empty" in refusal(tmp_path)
    with pytest.raises(InputError, match="is empty"):
        list_series(tmp_path)


def test_a_folder_without_dicom(tmp_path):
    (tmp_path / "notes.txt").write_text("no picture")
    assert "holds no DICOM file" in refusal(tmp_path)


def test_a_folder_of_reports(tmp_path):
    for file in axial(2).write(tmp_path):
        change(file, SOPClassUID="1.2.840.10008.5.1.4.1.1.88.11", ImagePositionPatient=None)
    assert "no pictures" in refusal(tmp_path)


def test_no_folder_at_all(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        read_ct(tmp_path / "nothing")
    with pytest.raises(InputError, match="is no folder"):
        list_series(tmp_path / "nothing")


def test_a_missing_slice_is_placed(tmp_path):
    files = axial().write(tmp_path)
    files[2].unlink()
    text = refusal(tmp_path)
    assert (
        "1 slice is missing between (-10.00, -20.00, 402.00) and (-10.00, -20.00, 406.00)" in text
    )
    assert "a step of 4 mm, 2 mm elsewhere" in text


def test_several_missing_slices_are_counted(tmp_path):
    files = axial(20).write(tmp_path)
    for k in (4, 5, 6, 12):
        files[k].unlink()
    assert "3 slices are missing" in (text := refusal(tmp_path))
    assert "at 1 further places" in text


def test_uneven_slices(tmp_path):
    series = axial()
    series.positions_mm[3:, 2] += 0.05
    series.write(tmp_path)
    assert "uneven slices: a step of 2.05 mm between" in refusal(tmp_path)


def test_positions_that_are_rounded_are_taken(tmp_path):
    series = axial(step_mm=0.6)
    series.positions_mm[3:, 2] += 0.009
    series.write(tmp_path)
    assert read_ct(tmp_path).volume.size[2] == 6


def test_slices_that_are_shifted_against_each_other(tmp_path):
    series = axial()
    series.positions_mm[3:, 0] += 1.0
    series.write(tmp_path)
    assert "shifted against each other" in refusal(tmp_path)


def test_two_different_slices_at_one_place(tmp_path):
    series = axial()
    series.write(tmp_path)
    series.stored = series.stored + 1
    (tmp_path / "again").mkdir()
    series.write(tmp_path / "again")
    assert "two different slices at (-10.00, -20.00, 400.00)" in refusal(tmp_path)


def test_one_slice_twice_beside_itself(tmp_path):
    series = axial()
    series.write(tmp_path)
    series.positions_mm[:, 0] += 1.0
    (tmp_path / "again").mkdir()
    series.write(tmp_path / "again")
    assert "two different slices at (" in refusal(tmp_path)


def test_a_single_slice(tmp_path):
    axial(1).write(tmp_path)
    assert "a single slice" in refusal(tmp_path)


MIXED = {
    "picture sizes": {"Rows": 10, "PixelData": bytes(200)},
    "pixel spacings": {"PixelSpacing": [0.7, 0.6]},
    "directions": {"ImageOrientationPatient": [1, 0, 0, 0, 0, -1]},
    "frames of reference": {"FrameOfReferenceUID": "1.2.4"},
    "modalities": {"Modality": "PT"},
}


@pytest.mark.parametrize("what", MIXED)
def test_two_series_under_one_uid(tmp_path, what):
    files = axial().write(tmp_path)
    change(files[4], **MIXED[what])
    text = refusal(tmp_path)
    assert "two series mixed" in text
    assert what in text


@pytest.mark.parametrize("column", [(0.0, 0.5, 0.0), (0.6, 0.8, 0.0)], ids=["short", "aslant"])
def test_a_damaged_direction(tmp_path, column):
    for file in axial().write(tmp_path):
        change(file, ImageOrientationPatient=[1, 0, 0, *column])
    assert "damaged direction" in refusal(tmp_path)


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("share", [0.05, 0.5, 0.97])
@pytest.mark.parametrize("at", [0, 3])
def test_a_file_that_is_cut_short_is_named(tmp_path, encoding, share, at, capfd):
    series = axial()
    plain = encoding == "plain"
    files = series.write(tmp_path) if plain else series.write_compressed(tmp_path, encoding)
    assert read_ct(tmp_path).volume.size == (10, 12, 6)
    whole = files[at].read_bytes()
    files[at].write_bytes(whole[: int(len(whole) * share)])
    text = refusal(tmp_path)
    assert files[at].name in text
    assert capfd.readouterr() == ("", "")


def test_a_file_whose_codec_finds_it_corrupt_is_refused_and_nothing_shows(tmp_path, capfd):
    files = axial().write_compressed(tmp_path, "JPEG")
    content = bytearray(files[3].read_bytes())
    content[-90:-60] = b"\xaa" * 30
    files[3].write_bytes(content)
    assert f"{files[3].name}, whose picture is damaged" in refusal(tmp_path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("tags", "why"),
    [
        ({"ImagePositionPatient": None}, "do not say where it lies"),
        ({"NumberOfFrames": 4}, "many slices in one file"),
        ({"SamplesPerPixel": 3}, "colour"),
        ({"PixelSpacing": None}, "do not say where it lies"),
    ],
)
def test_a_slice_that_cannot_be_placed_is_not_left_out(tmp_path, tags, why):
    files = axial().write(tmp_path)
    change(files[0], **tags)
    text = refusal(tmp_path)
    assert why in text
    assert files[0].name in text


def test_a_damaged_file_of_another_series_does_no_harm(tmp_path):
    files = axial().write(tmp_path)
    axial(1, SeriesInstanceUID="1.2.9", NumberOfFrames=9).write(tmp_path, ["other"])
    ct = read_ct(tmp_path)
    assert ct.volume.size[2] == len(files)
    assert any("1 file of another series, because it holds many" in said for said in ct.warnings)


def test_files_that_are_not_dicom_are_counted(tmp_path):
    axial().write(tmp_path)
    (tmp_path / "notes.txt").write_text("no picture")
    (tmp_path / "short.txt").write_text("n")
    (tmp_path / ".hidden").touch()
    assert any(
        "left out: 2 files without DICOM" in warning for warning in read_ct(tmp_path).warnings
    )


@pytest.mark.parametrize("content", [b"", bytes(60)])
def test_a_file_that_was_cut_to_nothing_may_be_a_slice(tmp_path, content):
    files = axial().write(tmp_path)
    files[5].write_bytes(content)
    text = refusal(tmp_path)
    assert "header is damaged or cut short" in text
    assert "slice5" in text


def test_a_file_that_cannot_be_opened_may_be_a_slice(tmp_path):
    files = axial().write(tmp_path)
    files[5].unlink()
    files[5].symlink_to(tmp_path / "nowhere")
    assert "slice5, and it cannot be opened (No such file or directory)" in refusal(tmp_path)


def test_air_only_is_refused_with_what_else_was_seen(tmp_path):
    series = axial(SliceThickness=9)
    series.stored = np.full_like(series.stored, -1000)
    series.write(tmp_path)
    text = refusal(tmp_path)
    assert "shows air only: its highest value is -1000 HU" in text
    assert "thickness tag says 9 mm" in text
