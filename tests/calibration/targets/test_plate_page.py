"""The printed page of a tool's plate, read back from its file; and what else can be printed."""

import json
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from calibration.targets.boards import keys_of, parse_board, read_board, read_target
from calibration.targets.plate_drawing import draw_plate
from calibration.targets.printing import Sheet, render_page
from navapp.errors import InputError
from navapp.tools.plate import Plate
from navapp.tools.plate_files import parse_plate, plate_keys
from tests.calibration.targets.test_detection import BOARDS
from tests.calibration.targets.test_printing import group, length_mm

# In the worker of test_detection.py, which has compiled the search for circles.
pytestmark = pytest.mark.xdist_group("boards")

FLAT = Plate(columns=2, rows=2)
STRIP = Plate(first_id=20, columns=1, rows=2, square_mm=20.0, faces=3, fold_deg=50.0)


@pytest.fixture(scope="module")
def page() -> bytes:
    return render_page(Sheet(STRIP), "svg")


def test_a_plates_page_is_as_large_as_it_says(page: bytes) -> None:
    root, sheet = ET.fromstring(page), Sheet(STRIP)
    size_mm = length_mm(root.get("width") or ""), length_mm(root.get("height") or "")
    assert size_mm == pytest.approx((sheet.width_mm, sheet.height_mm), abs=1e-4)
    assert sheet.size_mm == (60.0, 40.0)


def test_every_black_cell_is_printed_to_scale(page: bytes) -> None:
    outlines = group(page, "board")
    found = np.array([[*one.min(axis=0), *one.max(axis=0)] for one in outlines])
    expected = draw_plate(STRIP).rectangles_mm
    assert len(found) == len(expected)
    shift = Sheet(STRIP).page_from_board_mm
    np.testing.assert_allclose(found, expected + np.tile(shift, 2), atol=1e-3)


def test_a_line_is_drawn_where_the_paper_is_cut_and_ticks_where_it_is_folded(page: bytes) -> None:
    left, top = Sheet(STRIP).page_from_board_mm
    outline, *ticks = group(page, "cuts")
    np.testing.assert_allclose(outline.min(axis=0), [left, top], atol=1e-3)
    np.testing.assert_allclose(outline.max(axis=0), [left + 60.0, top + 40.0], atol=1e-3)
    places = sorted({round(float(x), 3) for tick in ticks for x in tick[:, 0]})
    np.testing.assert_allclose(places, [left + 20.0, left + 40.0], atol=2e-3)
    assert len(ticks) == 4
    for tick in ticks:
        # On the white outside: what is folded has no line on it.
        low, high = tick[:, 1].min(), tick[:, 1].max()
        assert high - low > 2.0
        assert high <= top + 1e-3 or low >= top + 40.0 - 1e-3


def test_a_flat_plate_has_no_ticks() -> None:
    assert len(group(render_page(Sheet(FLAT), "svg"), "cuts")) == 1


def test_a_boards_page_has_no_line_to_cut() -> None:
    assert b'id="cuts"' not in render_page(Sheet(BOARDS["charuco"]), "svg")


def test_the_caption_is_the_plates_file_and_tells_how_to_fold(page: bytes) -> None:
    text = " ".join(re.findall(r"<!-- (.*?) -->", page.decode(), flags=re.DOTALL))
    keys = json.loads(text[text.index("{") : text.index("}") + 1])
    assert parse_plate(keys) == STRIP
    assert "by 50 deg" in text
    assert "Fold" not in " ".join(Sheet(FLAT).caption)


def test_what_is_printed_is_read_as_plate_or_board(tmp_path: Path) -> None:
    for target, keys in (
        (STRIP, plate_keys(STRIP)),
        (BOARDS["charuco"], keys_of(BOARDS["charuco"])),
    ):
        path = tmp_path / "target.json"
        path.write_text(json.dumps(keys))
        assert read_target(path) == target


def test_a_damaged_target_is_refused_as_what_it_says_it_is(tmp_path: Path) -> None:
    path = tmp_path / "target.json"
    path.write_text('{"type": "plate", "squares_x": 2}')
    with pytest.raises(InputError, match="describes no plate"):
        read_target(path)
    path.write_text("no target")
    with pytest.raises(InputError, match="board"):
        read_target(path)


def test_a_plate_calibrates_no_camera(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="calibrate pivot"):
        parse_board(plate_keys(FLAT))
    path = tmp_path / "plate.json"
    path.write_text(json.dumps(plate_keys(FLAT)))
    with pytest.raises(InputError, match="it calibrates no camera"):
        read_board(path)
