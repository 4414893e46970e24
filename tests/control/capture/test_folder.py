import cv2
import numpy as np
import pytest

from drivers.frames import StereoFrame
from drivers.recorded_sources import open_folder
from navapp.control.capture.folder import CaptureFolder
from navapp.errors import InputError


def frame(level: int) -> StereoFrame:
    left = np.full((6, 8, 3), level, np.uint8)
    return StereoFrame(left, left + 1, 0, 0, 0, 0, "x")


def test_pairs_are_kept_as_they_came_and_read_back_as_a_folder_of_pairs(tmp_path):
    folder = CaptureFolder(tmp_path / "new")
    folder.begin({"type": "chessboard"})
    for index in (0, 1, 3):
        folder.keep(index, frame(10 * index))
    folder.drop(1)
    source = open_folder(tmp_path / "new")
    assert source.numbers == (0, 3)
    left, right = source.load(1)
    assert np.array_equal(left, frame(30).left)
    assert np.array_equal(right, frame(30).right)
    assert cv2.imread(str(tmp_path / "new" / "left_0000.png")) is not None
    assert (tmp_path / "new" / "board.json").read_text() == '{\n "type": "chessboard"\n}\n'


def test_a_folder_with_pictures_is_not_mixed_with_others(tmp_path):
    folder = CaptureFolder(tmp_path)
    folder.begin({})
    folder.keep(0, frame(1))
    with pytest.raises(InputError, match="already holds pictures"):
        CaptureFolder(tmp_path).begin({})


def test_a_folder_that_cannot_be_written_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        CaptureFolder(tmp_path / "file" / "new").begin({})


def test_a_folder_without_pairs_goes_away_and_one_with_others_files_stays(tmp_path):
    folder = CaptureFolder(tmp_path / "new")
    folder.begin({})
    folder.discard_if_empty()
    assert not folder.path.exists()
    folder.begin({})
    folder.keep(0, frame(1))
    folder.discard_if_empty()
    assert (folder.path / "board.json").exists()
    folder.drop(0)
    (folder.path / "notes.txt").write_text("mine")
    folder.discard_if_empty()
    assert [path.name for path in folder.path.iterdir()] == ["notes.txt"]
