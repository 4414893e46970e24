"""Nothing that is said about a series names the patient."""

import logging
import traceback
import warnings

import pytest

from navapp.errors import NavappError
from navapp.preop.volume import list_series, read_ct
from navapp.preop.volume.dicom_identity import Identity
from tests.preop.volume.dicom_writing import axial, change

PATIENT = {
    "PatientName": "Zebrowska^Quintilla Anne",
    "PatientID": "PID-778899",
    "PatientBirthDate": "19610203",
    "OtherPatientIDs": "OTHER4711",
    "AccessionNumber": "ACC31415",
    "PatientAddress": "Umbrella Lane 12",
    "SeriesDescription": "Knee of QUINTILLA 1.0",
}
SECRETS = ("zebrowska", "quintilla", "778899", "19610203", "4711", "31415", "umbrella")


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "zebrowska"


def write(folder, **tags):
    names = [f"Zebrowska_Quintilla_PID-778899_{k}.dcm" for k in range(6)]
    return axial(**PATIENT, **tags).write(folder, names)


def assert_no_secret(text):
    assert not [secret for secret in SECRETS if secret in text.lower()], text


def test_warnings_and_source_do_not_name_the_patient(folder, caplog, capfd):
    write(folder, SliceThickness=5, StudyID="42")
    (folder / "notes.txt").write_text("no picture")
    with caplog.at_level(logging.DEBUG):
        ct = read_ct(folder)
        infos = list_series(folder)
    assert len(ct.warnings) >= 2
    assert ct.source.description == "Knee of [hidden] 1.0"
    said = [*ct.warnings, repr(ct.source), *map(str, infos), repr(infos), caplog.text]
    assert_no_secret(" ".join(said))
    assert capfd.readouterr() == ("", "")


def test_what_pydicom_quotes_is_not_heard(folder, caplog, capfd):
    # A UID that is none draws a warning that quotes it.
    for file in write(folder, FrameOfReferenceUID="1.2.3.4.5"):
        file.write_bytes(file.read_bytes().replace(b"1.2.3.4.5", b"Zebrowska"))
    with caplog.at_level(logging.DEBUG), warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        read_ct(folder)
    assert said == []
    assert caplog.text == ""
    assert capfd.readouterr() == ("", "")


def several(files):
    for file in files[3:]:
        change(file, SeriesInstanceUID="1.2.3.4")


def cut_pixels(files):
    files[2].write_bytes(files[2].read_bytes()[:-50])


def cut_header(files):
    files[2].write_bytes(files[2].read_bytes()[:300])


def lose_position(files):
    change(files[2], ImagePositionPatient=None)


def break_numbers(files):
    content = files[2].read_bytes()
    files[2].write_bytes(content.replace(b"1.0\\0.0\\0", b"Quintilla"))


SPOILT = [
    several, cut_pixels, cut_header, lose_position, break_numbers,
    lambda files: files[2].unlink(),
    lambda files: change(files[2], PixelSpacing=[1, 1]),
    lambda files: change(files[2], ImagePositionPatient=[-10, -20, 400]),
]  # fmt: skip


@pytest.mark.parametrize("spoil", SPOILT)
def test_errors_do_not_name_the_patient(folder, spoil, caplog, capfd):
    spoil(write(folder))
    with caplog.at_level(logging.DEBUG), pytest.raises(NavappError) as refused:
        read_ct(folder)
    error = refused.value
    shown = "".join(
        line for line in traceback.format_exception(error) if not line.lstrip().startswith("File")
    )
    assert_no_secret(" ".join([str(error), error.subject, error.remedy, shown, caplog.text]))
    assert capfd.readouterr() == ("", "")


def test_short_words_are_hidden_where_they_stand_alone():
    identity = Identity({"Li^Bo", "7"})
    assert identity.hide_in("Li's spline of BO 1.7_li") == (
        "[hidden]'s spline of [hidden] 1.7_[hidden]"
    )


def test_nothing_is_hidden_where_nothing_is_known():
    assert Identity({"", " "}).hide_in("Knee 1.0") == "Knee 1.0"
