"""The page on which landmarks of the plan are picked in the picture, to the pixel."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from textual import events
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.content import Content
from textual.message import Message

from navapp.overlay.fitting import in_colour
from navapp.ui.actions import ARROWS
from navapp.ui.pictures.picture import Picture
from navapp.ui.screens import PageScreen
from navapp.ui.start_page import StartChosen, why_no_picture
from navapp.ui.text_view import TextView
from navapp.ui.view import View
from navapp.values import FEWEST_PICKS, Pick, Prior, find_crowded

_PICTURES = ("whole", "magnifier")
Place = tuple[int, int]  # column and row in the left picture, px
_YELLOW, _GREEN, _BLACK = (0, 255, 255), (0, 255, 0), (0, 0, 0)
# What an arrow moves the cursor by, alone and with SHIFT.
_STEP_PX, _LARGE_STEP_PX = 1, 20
# Half length of the cross in the magnifier, and of the gap that leaves its pixel visible.
_ARM_PX, _GAP_PX = 6, 2
# Pixels of the screen for each of the picture, where the terminal paints it.
_ENLARGED = 6


def draw_places(
    shrunk: NDArray[np.uint8], size_px: Place, cursor: Place, picks: Mapping[str, Place]
) -> NDArray[np.uint8]:
    """A copy (h, w, 3) of the left picture, smaller: picks green, the cursor's lines yellow."""
    plain = in_colour(shrunk)
    drawn = plain.copy()
    height, width = drawn.shape[:2]

    def find(place: Place) -> Place:
        return place[0] * width // size_px[0], place[1] * height // size_px[1]

    x, y = find(cursor)
    # Beside each line a black one: on bright bone it is the one that is seen.
    for colour, k in ((_BLACK, 1), (_YELLOW, 0)):
        drawn[min(y + k, height - 1), :], drawn[:, min(x + k, width - 1)] = colour, colour
    drawn[y, x] = plain[y, x]
    for u, v in map(find, picks.values()):
        drawn[max(v - 2, 0) : v + 3, max(u - 2, 0) : u + 3] = _BLACK
        drawn[max(v - 1, 0) : v + 2, max(u - 1, 0) : u + 2] = _GREEN
    return drawn


def magnify(
    picture: NDArray[np.uint8], centre: Place, shape: Place, picks: Mapping[str, Place]
) -> NDArray[np.uint8]:
    """(h, w, 3) pixels around a place as they are, with a cross; black beyond the picture.

    Args:
        picture: (H, W, 3) or grey.
        centre: of what is shown.
        shape: its width and height.
        picks: that are marked.
    """
    width, height = shape
    left, top = centre[0] - width // 2, centre[1] - height // 2
    shown = np.zeros((height, width, 3), dtype=np.uint8)
    inside = picture[max(top, 0) : top + height, max(left, 0) : left + width]
    y, x = max(-top, 0), max(-left, 0)
    colour = inside if inside.ndim == 3 else inside[:, :, None]
    shown[y : y + inside.shape[0], x : x + inside.shape[1]] = colour
    for u, v in picks.values():
        if 0 <= v - top < height and 0 <= u - left < width:
            row, column = v - top, u - left
            shown[row, max(column - 1, 0) : column + 2] = _BLACK
            shown[row, column] = _GREEN
    y, x = height // 2, width // 2
    for k in range(_GAP_PX, _ARM_PX + 1):
        for dy, dx in ((0, k), (0, -k), (k, 0), (-k, 0)):
            if 0 <= y + dy < height and 0 <= x + dx < width:
                shown[y + dy, x + dx] = _YELLOW
    return shown


class PicksChecked(Message):
    """Landmarks that are to be compared with the accepted registration."""

    def __init__(self, picks: tuple[Pick, ...]) -> None:
        super().__init__()
        self.picks = picks


class PlacePicture(Picture):
    """A picture in which the mouse points at a place."""

    class Pointed(Message):
        """A place, as parts of the shown picture's width and height."""

        def __init__(self, picture: "PlacePicture", across: float, down: float) -> None:
            super().__init__()
            self.picture, self.across, self.down = picture, across, down

    def on_click(self, event: events.Click) -> None:
        """Tell where."""
        at = event.get_content_offset(self)
        if at is not None:
            self.post_message(self.Pointed(self, *self.find_point(at.x, at.y)))


class PickList(TextView):
    """The landmarks of the bone: where they were picked, and which is next."""

    def __init__(self) -> None:
        super().__init__("pick-list")
        self.names: list[str] = []
        self.picks: dict[str, Place] = {}
        self.selected, self.cursor = 0, (0, 0)

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """As many as there is room for, around the selected one."""
        if view.left_picture is None:
            return [Content(f" {why_no_picture(view)}")]
        if (n := len(self.names)) < FEWEST_PICKS:
            return [
                Content(f" the plan has {n} landmarks"),
                Content(f" of the {view.snapshot.stage.bone}, {FEWEST_PICKS}"),
                Content(" are needed: leave, and"),
                Content(" draw a box (b)"),
            ]
        heading = Content.styled(f" {len(self.picks)} picked; cursor {_tell(self.cursor)}", "bold")
        room = max(height - 1, 1)
        first = min(max(self.selected - room // 2, 0), max(len(self.names) - room, 0))
        lines = [heading]
        for number, name in enumerate(self.names[first : first + room], first):
            sign, place = (">" if number == self.selected else " "), self.picks.get(name)
            text = f" {sign} {name.partition('/')[2]:<24} {'' if place is None else _tell(place)}"
            style = "bold $primary" if number == self.selected else "$foreground"
            lines.append(Content.styled(text[:width], style))
        return lines


def _tell(place: Place) -> str:
    return f"{place[0]}, {place[1]}"


class PicksPage(PageScreen):
    """Picks landmarks in the live picture; `g` searches from three or more.

    Args:
        view: to begin with.
        picks: made before, by name.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("p", "dismiss", "back", show=False),
        Binding("enter", "pick", "pick", show=False),
        Binding("n,tab", "select(1)", "next", show=False),
        Binding("shift+tab", "select(-1)", "previous", show=False),
        Binding("x", "forget", "forget", show=False),
        Binding("g", "search", "search", show=False),
        Binding("k", "check", "check", show=False),
        *(Binding(key, f"move('{key}', {_STEP_PX})", "move", show=False) for key in ARROWS),
        *(
            Binding(f"shift+{key}", f"move('{key}', {_LARGE_STEP_PX})", "move", show=False)
            for key in ARROWS
        ),
    ]

    page_title = "where are the landmarks?"
    keys = " back  arrows  ENTER pick  n next  x forget  g search  k check"

    def __init__(self, view: View, picks: dict[str, Place]) -> None:
        super().__init__(view)
        self._picks = picks
        width, height = view.snapshot.picture_size_px
        self._cursor = (width // 2, height // 2)
        self._number = 0

    def compose_page(self) -> ComposeResult:
        """The whole picture, a part of it enlarged, the landmarks."""
        with Horizontal(id="picking"):
            yield PlacePicture("whole")
            with Vertical(id="picking-side"):
                yield PlacePicture("magnifier")
                yield PickList()

    @property
    def _names(self) -> list[str]:
        return list(self.view.snapshot.landmarks)

    @property
    def _selected(self) -> int:
        """Of the names; the stage may have another bone by now."""
        return min(self._number, max(len(self._names) - 1, 0))

    def show(self, view: View, *, is_text_due: bool) -> None:
        """Take over the newest picture."""
        self.view = view
        snapshot, listed = view.snapshot, self.query_one(PickList)
        listed.names, listed.picks = self._names, self._of_bone()
        listed.selected, listed.cursor = self._selected, self._cursor
        super().show(view, is_text_due=is_text_due)
        picture, ramp = view.left_picture, view.symbols.ramp
        if picture is None:
            return
        whole, magnifier = (self.query_one(f"#{name}", PlacePicture) for name in _PICTURES)
        size_px = snapshot.picture_size_px
        shrunk = whole.as_seen(picture)
        whole.show_picture(draw_places(shrunk, size_px, self._cursor, listed.picks), ramp)
        if 0 not in magnifier.room:
            shape = self._magnified(magnifier)
            magnified = magnify(picture, self._cursor, shape, listed.picks)
            if magnifier.has_pixels:
                magnified = magnified.repeat(_ENLARGED, axis=0).repeat(_ENLARGED, axis=1)
            magnifier.show_picture(magnified, ramp)

    @staticmethod
    def _magnified(magnifier: Picture) -> Place:
        """Width and height, px, of what the magnifier shows: a half block or a square for each."""
        width, height = magnifier.room
        if not magnifier.has_pixels:
            return width, height
        return max(1, width // _ENLARGED), max(1, height // _ENLARGED)

    def _of_bone(self) -> dict[str, Place]:
        return {name: self._picks[name] for name in self._names if name in self._picks}

    def on_resize(self, _event: events.Resize) -> None:
        """The magnifier shows as many pixels as it has room for."""
        self.call_after_refresh(self._redraw)

    def on_place_picture_pointed(self, message: PlacePicture.Pointed) -> None:
        """The cursor goes there."""
        width, height = self.view.snapshot.picture_size_px
        if message.picture.id == "whole":
            self._move_to(int(message.across * width), int(message.down * height))
            return
        columns, rows = self._magnified(message.picture)
        x, y = int(message.across * columns), int(message.down * rows)
        self._move_to(self._cursor[0] - columns // 2 + x, self._cursor[1] - rows // 2 + y)

    def action_move(self, arrow: str, step_px: int) -> None:
        """Move the cursor."""
        right, down = ARROWS[arrow]
        self._move_to(self._cursor[0] + right * step_px, self._cursor[1] + down * step_px)

    def action_select(self, step: int) -> None:
        """Another landmark."""
        if self._names:
            self._number = (self._selected + step) % len(self._names)
        self._redraw()

    def action_pick(self) -> None:
        """The selected landmark is where the cursor is; go on to the next that has no place."""
        if len(self._names) < FEWEST_PICKS or self.view.left_picture is None:
            return
        self._picks[self._names[self._selected]] = self._cursor
        for step in range(1, len(self._names)):
            number = (self._selected + step) % len(self._names)
            if self._names[number] not in self._picks:
                self._number = number
                break
        self._redraw()

    def action_forget(self) -> None:
        """The selected landmark has no place any more."""
        if self._names:
            self._picks.pop(self._names[self._selected], None)
        self._redraw()

    def action_search(self) -> None:
        """Search from the picks, and leave."""
        picks = self._take()
        if picks:
            bone = self.view.snapshot.stage.bone
            self.app.post_message(StartChosen(Prior(picks=picks), bone))
            self.dismiss()

    def action_check(self) -> None:
        """Compare the picks with the accepted registration, and leave."""
        picks = self._take()
        if picks:
            self.app.post_message(PicksChecked(picks))
            self.dismiss()

    def _take(self) -> tuple[Pick, ...]:
        """The picks; none, and a word, when they are fewer than three, or two at one place."""
        known, bone = self.view.snapshot.landmarks, self.view.snapshot.stage.bone
        picks = tuple(
            Pick(name, bone, (float(u), float(v)), known[name])
            for name, (u, v) in self._of_bone().items()
        )
        why = ""
        if len(picks) < FEWEST_PICKS:
            why = f"{FEWEST_PICKS} landmarks are needed"
        elif (crowded := find_crowded(picks)) is not None:
            why = f"{' and '.join(crowded)} are at one place: pick them again"
        if why:
            self.app.bell()
            self.notify(why, severity="warning")
            return ()
        return picks

    def _move_to(self, x: int, y: int) -> None:
        width, height = self.view.snapshot.picture_size_px
        self._cursor = (min(max(x, 0), width - 1), min(max(y, 0), height - 1))
        self._redraw()

    def _redraw(self) -> None:
        self.show(self.view, is_text_due=True)
