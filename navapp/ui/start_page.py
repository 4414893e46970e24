"""The page on which a box is drawn around the bone, by keys or by mouse, and searched in."""

from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from textual import events
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.message import Message

from navapp.control.commands import Register
from navapp.control.rules import why_refused
from navapp.geometry.box import Box
from navapp.overlay.fitting import in_colour
from navapp.ui.actions import ARROWS
from navapp.ui.pictures.picture import Picture
from navapp.ui.screens import PageScreen
from navapp.ui.text_view import TextView
from navapp.ui.view import View
from navapp.values import Prior

_YELLOW, _BLACK = (0, 255, 255), (0, 0, 0)
# A press of an arrow, and the smallest box, as parts of the picture's width.
_STEP, _LEAST = 1 / 80, 1 / 16


class StartChosen(Message):
    """Where a bone is to be searched for; an empty start: from where the session began."""

    def __init__(self, start: Prior, bone: str) -> None:
        super().__init__()
        self.start, self.bone = start, bone


def middle_box(size_px: tuple[int, int]) -> Box:
    """Half as wide and as high as the picture."""
    width, height = size_px
    return Box(width // 4, height // 4, width // 2, height // 2)


def box_between(a: tuple[float, float], b: tuple[float, float], size_px: tuple[int, int]) -> Box:
    """With two places (x, y) px as opposite corners; never smaller than the smallest box."""
    (x0, x1), (y0, y1) = (sorted((round(p), round(q))) for p, q in zip(a, b, strict=True))
    return fit_into(Box(x0, y0, x1 - x0, y1 - y0), size_px)


def move_box(box: Box, steps: tuple[int, int], size_px: tuple[int, int]) -> Box:
    """So many steps to the right and down."""
    right, down = (round(n * _STEP * size_px[0]) for n in steps)
    return fit_into(replace(box, x=box.x + right, y=box.y + down), size_px)


def resize_box(box: Box, steps: tuple[int, int], size_px: tuple[int, int]) -> Box:
    """So many steps wider and higher, about its middle."""
    wider, higher = (round(n * _STEP * size_px[0]) for n in steps)
    x, y = box.x - wider, box.y - higher
    return fit_into(Box(x, y, box.width + 2 * wider, box.height + 2 * higher), size_px)


def fit_into(box: Box, size_px: tuple[int, int]) -> Box:
    """The nearest box that lies in the picture and is not too small."""
    least = round(_LEAST * size_px[0])
    width, height = (
        min(max(own, least), most)
        for own, most in zip((box.width, box.height), size_px, strict=True)
    )
    x, y = min(max(box.x, 0), size_px[0] - width), min(max(box.y, 0), size_px[1] - height)
    return Box(x, y, width, height)


def draw_box(shrunk: NDArray[np.uint8], box: Box, size_px: tuple[int, int]) -> NDArray[np.uint8]:
    """A copy (h, w, 3) of the left picture at another size, with the box."""
    drawn = np.array(in_colour(shrunk))
    height, width = drawn.shape[:2]
    left, right = ((x * width) // size_px[0] for x in (box.x, box.x + box.width - 1))
    top, bottom = ((y * height) // size_px[1] for y in (box.y, box.y + box.height - 1))
    # Yellow within black: one of them is seen on whatever lies below.
    for grow, colour in ((2, _BLACK), (1, _BLACK), (0, _YELLOW), (-1, _YELLOW)):
        rows = np.clip([top - grow, bottom + grow], 0, height - 1)
        columns = np.clip([left - grow, right + grow], 0, width - 1)
        drawn[rows[0] : rows[1] + 1, columns] = colour
        drawn[rows, columns[0] : columns[1] + 1] = colour
    return drawn


class BoxPicture(Picture):
    """The live picture with the box; a drag of the mouse draws another one."""

    class Dragged(Message):
        """The mouse went from one place to another, both (x, y) px in the left picture."""

        def __init__(self, begin: tuple[float, float], end: tuple[float, float]) -> None:
            super().__init__()
            self.begin, self.end = begin, end

    def __init__(self) -> None:
        super().__init__("start-picture")
        self._size_px = (0, 0)
        self._begin: tuple[float, float] | None = None

    def show_box(self, view: View, box: Box) -> None:
        """Take over the newest picture."""
        if (picture := view.left_picture) is None:
            return
        self._size_px = view.snapshot.picture_size_px
        drawn = draw_box(self.as_seen(picture), box, self._size_px)
        self.show_picture(drawn, view.symbols.ramp)

    def _point(self, event: events.MouseEvent) -> tuple[float, float] | None:
        if 0 in self._size_px:
            return None
        # A drag may leave the picture: its edge is meant then.
        across, down = self.find_point(event.x, event.y)
        return across * self._size_px[0], down * self._size_px[1]

    def on_mouse_down(self, event: events.MouseDown) -> None:
        """A corner."""
        self._begin = self._point(event)
        self.capture_mouse()

    def on_mouse_move(self, event: events.MouseMove) -> None:
        """The opposite one, while the button is down."""
        place = self._point(event)
        if self._begin is not None and place is not None:
            self.post_message(self.Dragged(self._begin, place))

    def on_mouse_up(self, _event: events.MouseUp) -> None:
        """The box is drawn."""
        self._begin = None
        self.release_mouse()


class StartKeys(TextView):
    """What to do, and where the box is."""

    def __init__(self) -> None:
        super().__init__("start-keys")
        self.box: Box | None = None

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """Two lines."""
        bone, box = view.snapshot.stage.bone, self.box
        if view.left_picture is None:
            said = why_no_picture(view)
        elif why := why_refused(Register(Prior()), view.snapshot):
            said = f"nothing can be searched now: {why}"
        else:
            said = "" if box is None else f"{box.width} x {box.height} px at {box.x}, {box.y}"
        return [
            Content.assemble(
                f" Around the {bone}: drag the mouse; or ",
                ("arrows", "bold $primary"), " move, ",
                ("SHIFT arrows", "bold $primary"), " size",
            ),
            Content.styled(f" {said}", "$text-muted"),
        ]  # fmt: skip


def why_no_picture(view: View) -> str:
    """Why there is nothing to draw on."""
    if view.snapshot.shows_eye:
        return "the video is not shown: leave, and press y"
    return "there is no picture yet"


class StartPage(PageScreen):
    """Draws a box around the bone; ENTER searches in it."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("b", "dismiss", "back", show=False),
        Binding("enter", "search", "search", show=False),
        Binding("x", "reset", "as the session began", show=False),
        *(Binding(key, f"move('{key}')", "move", show=False) for key in ARROWS),
        *(Binding(f"shift+{key}", f"resize('{key}')", "size", show=False) for key in ARROWS),
    ]

    page_title = "where is the bone?"
    keys = " back  ENTER search in it  x search as the session began"

    def __init__(self, view: View, box: Box | None = None) -> None:
        super().__init__(view)
        self._box = box or middle_box(view.snapshot.picture_size_px)

    def compose_page(self) -> ComposeResult:
        """Picture and words."""
        yield BoxPicture()
        yield StartKeys()

    def show(self, view: View, *, is_text_due: bool) -> None:
        """Take over the newest picture."""
        self.query_one(StartKeys).box = self._box
        super().show(view, is_text_due=is_text_due)
        self.query_one(BoxPicture).show_box(view, self._box)

    def action_move(self, arrow: str) -> None:
        """Move the box."""
        self._take(move_box(self._box, ARROWS[arrow], self.view.snapshot.picture_size_px))

    def action_resize(self, arrow: str) -> None:
        """Wider or narrower, higher (up) or lower."""
        right, down = ARROWS[arrow]
        self._take(resize_box(self._box, (right, -down), self.view.snapshot.picture_size_px))

    def on_box_picture_dragged(self, message: BoxPicture.Dragged) -> None:
        """Another box."""
        size_px = self.view.snapshot.picture_size_px
        self._take(box_between(message.begin, message.end, size_px))

    def action_search(self) -> None:
        """Begin, and leave."""
        if self.view.left_picture is None:
            self.app.bell()
            self.notify(why_no_picture(self.view), severity="warning")
            return
        box = self._box
        self._leave(Prior(box=(box.x, box.y, box.width, box.height)))

    def action_reset(self) -> None:
        """Forget what was drawn and picked, and search."""
        self._leave(Prior())

    def _leave(self, start: Prior) -> None:
        self.app.post_message(StartChosen(start, self.view.snapshot.stage.bone))
        self.dismiss()

    def _take(self, box: Box) -> None:
        self._box = box
        self.show(self.view, is_text_due=True)
