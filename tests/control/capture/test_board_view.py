from threading import Event
from time import sleep

import numpy as np
import pytest

from drivers.frames import StereoFrame
from navapp.control.capture import board_view
from navapp.control.capture.board_view import detect_board
from tests.calibration.marks import BOARD

BLACK = np.zeros((2, 2), np.uint8)


def test_an_error_in_the_left_picture_leaves_no_work_on_the_right_one(monkeypatch):
    has_begun, has_ended = Event(), Event()

    def finder(picture, board):
        if picture[0, 0]:
            has_begun.set()
            sleep(0.2)
            has_ended.set()
            return None
        assert has_begun.wait(10.0)
        raise ValueError("left")

    monkeypatch.setattr(board_view, "find_board", finder)
    with pytest.raises(ValueError, match="left"):
        detect_board(StereoFrame(BLACK, BLACK + 255, 0, 0, 0, 0, "x"), BOARD)
    assert has_ended.is_set()
