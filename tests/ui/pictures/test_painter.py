import numpy as np
import pytest
from textual.geometry import Region

from navapp.ui.pictures.graphics import Graphics
from navapp.ui.pictures.painter import Painter, PictureText, Scale

PICTURE = np.full((90, 160, 3), 80, np.uint8)
PLACE = Region(4, 2, 40, 20)


class FakeEncoder:
    """Keeps what it was given."""

    def __init__(self, *, is_scaled_by_terminal: bool = True) -> None:
        self.is_scaled_by_terminal, self.is_busy = is_scaled_by_terminal, False
        self.has_pixels = True
        self.given: list[tuple[int, tuple[int, ...], int, int]] = []

    def encode(self, number: int, picture: np.ndarray, columns: int, rows: int) -> str:
        self.given.append((number, picture.shape, columns, rows))
        return f"<{number}>"

    def erase(self, number: int) -> str:
        return f"<-{number}>"

    def close(self) -> None:
        pass


def make(*, is_scaled_by_terminal: bool = True) -> tuple[Painter, FakeEncoder, list[str]]:
    encoder, written = FakeEncoder(is_scaled_by_terminal=is_scaled_by_terminal), []
    return Painter(Graphics(encoder, (10, 20)), written.append), encoder, written


def test_a_picture_is_drawn_at_its_cells_in_one_update() -> None:
    painter, encoder, written = make()
    assert painter.paint(3, PICTURE, PLACE)
    assert written == ["\x1b[?2026h\x1b7\x1b[3;5H<3>\x1b8\x1b[?2026l"]
    # The terminal enlarges it, so no more pixels are sent than there are.
    assert encoder.given == [(3, (160, 160, 3), 40, 20)]


def test_pixels_are_drawn_for_a_terminal_that_does_not_scale() -> None:
    painter, encoder, _ = make(is_scaled_by_terminal=False)
    painter.paint(3, PICTURE, PLACE)
    assert encoder.given == [(3, (400, 400, 3), 40, 20)]


def test_the_next_picture_waits_for_the_one_before() -> None:
    painter, encoder, written = make()
    assert painter.paint(1, PICTURE, PLACE)
    assert not painter.paint(1, PICTURE, PLACE)
    text = written[0]
    assert isinstance(text, PictureText)
    text.sent_s = 1e9
    encoder.is_busy = True
    assert not painter.paint(1, PICTURE, PLACE)
    encoder.is_busy = False
    assert painter.paint(1, PICTURE, PLACE)


@pytest.mark.parametrize(("cost_s", "sending_s"), [(0.02, 0.0), (0.0, 0.3)])
def test_what_is_dear_becomes_smaller_and_what_is_cheap_larger_again(
    cost_s: float, sending_s: float
) -> None:
    scale = Scale()
    for _ in range(30):
        scale.note(cost_s, sending_s)
    small = scale.value
    assert small < 0.5
    for _ in range(1000):
        scale.note(0.001, 0.001)
    assert scale.value == 1.0
    for _ in range(1000):
        scale.note(cost_s, sending_s)
    assert scale.value > 0.2


def test_a_single_slow_picture_changes_nothing() -> None:
    scale = Scale()
    for k in range(50):
        scale.note(0.05 if k % 10 == 0 else 0.002, 0.001)
    assert scale.value == 1.0


def test_where_the_terminal_does_not_scale_a_smaller_picture_lies_in_the_middle() -> None:
    painter, _, _ = make(is_scaled_by_terminal=False)
    assert painter.find_place(PLACE) == PLACE
    for _ in range(3):
        painter._scale.note(1.0, 0.0)
    place = painter.find_place(PLACE)
    assert (place.width, place.height) == (34, 17)
    assert PLACE.contains_region(place)
    assert make()[0].find_place(PLACE) == PLACE


def test_two_pictures_take_turns() -> None:
    painter, encoder, written = make()
    for _ in range(20):
        painter.paint(1, PICTURE, PLACE)
        painter.paint(2, PICTURE, PLACE)
        written[-1].sent_s = 1e9  # type: ignore[attr-defined]
    painted = [number for number, *_ in encoder.given]
    assert painted[:6] == [1, 2, 1, 2, 1, 2]


def test_a_picture_that_goes_away_is_not_waited_for() -> None:
    painter, encoder, written = make()
    painter.paint(1, PICTURE, PLACE)
    assert not painter.paint(2, PICTURE, PLACE)
    painter.erase(2)
    written[0].sent_s = 1e9  # type: ignore[attr-defined]
    assert painter.paint(1, PICTURE, PLACE)
    assert [number for number, *_ in encoder.given] == [1, 1]


def test_a_terminal_that_never_reads_its_memory_is_not_waited_for_for_ever(monkeypatch) -> None:
    painter, encoder, written = make()
    painter.paint(1, PICTURE, PLACE)
    written[0].sent_s = 1e9  # type: ignore[attr-defined]
    encoder.is_busy = True
    assert not painter.paint(1, PICTURE, PLACE)
    later_s = painter._begun_s + 1.5
    monkeypatch.setattr("navapp.ui.pictures.painter.time.monotonic", lambda: later_s)
    assert painter.paint(1, PICTURE, PLACE)
