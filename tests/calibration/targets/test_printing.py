"""Printed boards: read back from the files as a printer would."""

import json
import re
import xml.etree.ElementTree as ET
import zlib

import cv2
import numpy as np
import pytest

from calibration.targets.boards import keys_of, parse_board
from calibration.targets.detection import find_board
from calibration.targets.drawing import make_drawing
from calibration.targets.printing import Sheet, render_page
from tests.calibration.targets.test_detection import BOARDS

# In the worker of test_detection.py, which has compiled the search for circles.
pytestmark = pytest.mark.xdist_group("boards")

MM_PER_PT = 25.4 / 72.0
SVG = "{http://www.w3.org/2000/svg}"


def group(svg: bytes, name: str) -> list[np.ndarray]:
    """Outlines (n, 2) in mm of the paths of a group; curves as points on them."""
    root = ET.fromstring(svg)
    found = [element for element in root.iter() if element.get("id") == name]
    assert len(found) == 1
    outlines = []
    for path in found[0].iter(f"{SVG}path"):
        assert path.get("transform") is None
        outlines += outlines_of(path.get("d"))
    return outlines


def outlines_of(text: str) -> list[np.ndarray]:
    outlines: list[list[np.ndarray]] = []
    for letter, body in re.findall(r"([MLCQz])([^MLCQz]*)", text):
        points = np.array(body.split(), dtype=float).reshape(-1, 2) * MM_PER_PT
        if letter == "M":
            outlines.append([points[0]])
        elif letter == "L":
            outlines[-1].append(points[0])
        elif letter == "C":
            a, (b, c, d) = outlines[-1][-1], points
            for t in np.linspace(0.0, 1.0, 17)[1:]:
                s = 1.0 - t
                outlines[-1].append(s**3 * a + 3 * s * s * t * b + 3 * s * t * t * c + t**3 * d)
        else:
            assert letter == "z"
    return [np.array(outline) for outline in outlines]


def length_mm(text: str) -> float:
    assert text.endswith("pt")
    return float(text[:-2]) * MM_PER_PT


@pytest.mark.parametrize("name", BOARDS)
def test_the_page_is_as_large_as_it_says(name: str) -> None:
    sheet = Sheet(BOARDS[name])
    root = ET.fromstring(render_page(sheet, "svg"))
    size_mm = length_mm(root.get("width")), length_mm(root.get("height"))
    assert size_mm == pytest.approx((sheet.width_mm, sheet.height_mm), abs=1e-4)
    box = np.array(root.get("viewBox").split(), dtype=float) * MM_PER_PT
    np.testing.assert_allclose(box, [0.0, 0.0, *size_mm], atol=1e-4)


@pytest.mark.parametrize("name", ["charuco", "legacy", "chessboard"])
def test_every_square_lies_where_the_board_has_it(name: str) -> None:
    sheet = Sheet(BOARDS[name])
    expected = make_drawing(sheet.board).rectangles_mm
    found = np.array(
        [[*o.min(axis=0), *o.max(axis=0)] for o in group(render_page(sheet, "svg"), "board")]
    )
    assert len(found) == len(expected)
    moved = found - expected
    # All by one shift, and not a thousandth of a millimetre more.
    np.testing.assert_allclose(moved, np.tile(moved[0, :2], (len(moved), 2)), atol=1e-3)
    low, high = found[:, :2].min(axis=0), found[:, 2:].max(axis=0)
    assert (low >= 10.0 - 1e-6).all()
    assert (high <= (sheet.width_mm - 10.0, sheet.height_mm - 10.0)).all()


@pytest.mark.parametrize("name", BOARDS)
def test_what_is_printed_is_found_as_the_board(name: str) -> None:
    board, px_per_mm = BOARDS[name], 6.0
    sheet = Sheet(board)
    size = np.ceil(np.array([sheet.height_mm, sheet.width_mm]) * px_per_mm).astype(int)
    fine = 4
    picture = np.full(size * fine, 255, dtype=np.uint8)
    svg = render_page(sheet, "svg")
    for outline in group(svg, "board") + group(svg, "ruler"):
        # fillPoly counts from pixel centres, the page from the corner of the first.
        corners = np.rint((outline * px_per_mm * fine - 0.5) * 256).astype(np.int32)
        cv2.fillPoly(picture, [corners], 0, shift=8)
    picture = cv2.resize(picture, (size[1], size[0]), interpolation=cv2.INTER_AREA)
    seen = find_board(cv2.GaussianBlur(picture, (0, 0), 0.7), board)
    assert seen is not None
    assert len(seen.ids) == len(board.points_mm)
    on_page = board.points_mm[seen.ids, :2] + sheet.page_from_board_mm
    expected = on_page * px_per_mm - 0.5
    if not board.has_squares and np.linalg.norm(seen.pixels[0] - expected[0]) > 20.0:
        # A symmetric grid of circles looks the same from its other end.
        expected = expected[::-1]
    # Edges are rounded to a quarter of a pixel, each by half of that at most.
    assert np.abs(seen.pixels - expected).max() < 0.13


def test_the_ruler_is_a_hundred_millimetres_long() -> None:
    lines = group(render_page(Sheet(BOARDS["charuco"]), "svg"), "ruler")
    level, ticks = lines[0], lines[1:]
    assert np.ptp(level, axis=0) == pytest.approx([100.0, 0.0], abs=1e-4)
    places = np.array([tick[0, 0] for tick in ticks])
    np.testing.assert_allclose(places - level[0, 0], np.arange(0.0, 101.0, 5.0), atol=1e-4)


@pytest.mark.parametrize("name", BOARDS)
def test_the_caption_is_the_boards_file(name: str) -> None:
    sheet = Sheet(BOARDS[name])
    comments = re.findall(r"<!-- (.*?) -->", render_page(sheet, "svg").decode(), flags=re.DOTALL)
    text = " ".join(comments)
    keys = json.loads(text[text.index("{") : text.index("}") + 1])
    assert parse_board(keys) == sheet.board == parse_board(keys_of(sheet.board))


def test_the_pdf_holds_the_same_squares() -> None:
    sheet = Sheet(BOARDS["chessboard"])
    pdf = render_page(sheet, "pdf")
    box = re.search(rb"/MediaBox \[ ?([^\]]*)\]", pdf)
    assert box is not None
    size_mm = np.array(box.group(1).split(), dtype=float) * MM_PER_PT
    np.testing.assert_allclose(size_mm, [0.0, 0.0, sheet.width_mm, sheet.height_mm], atol=1e-3)
    streams = re.findall(rb"stream\r?\n(.*?)\r?\nendstream", pdf, flags=re.DOTALL)
    drawn_text = b"".join(inflated(stream) for stream in streams).decode("latin-1")
    starts = re.findall(r"([-\d.]+) ([-\d.]+) m\n", drawn_text)
    corners_mm = np.array(starts, dtype=float) * MM_PER_PT
    # PDF counts from below.
    corners_mm[:, 1] = sheet.height_mm - corners_mm[:, 1]
    for corner in make_drawing(sheet.board).rectangles_mm[:, :2] + sheet.page_from_board_mm:
        assert np.linalg.norm(corners_mm - corner, axis=1).min() < 1e-3


def inflated(stream: bytes) -> bytes:
    try:
        return zlib.decompress(stream)
    except zlib.error:
        return b""


@pytest.mark.parametrize(
    ("columns", "rows", "square_mm", "paper"),
    [(11, 8, 15.0, "A4"), (10, 7, 30.0, "A3"), (10, 7, 45.0, "A2"), (10, 7, 200.0, None)],
)
def test_the_paper_that_is_needed(columns, rows, square_mm, paper) -> None:
    keys = {"type": "chessboard", "squares_x": columns, "squares_y": rows, "square_mm": square_mm}
    assert Sheet(parse_board(keys)).paper == paper


def test_the_same_board_gives_the_same_file() -> None:
    sheet = Sheet(BOARDS["circles"])
    for form in ("svg", "pdf"):
        assert render_page(sheet, form) == render_page(sheet, form)
