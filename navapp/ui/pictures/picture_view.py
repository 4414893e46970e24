"""The picture with the overlay, in a frame that says what it is."""

from collections.abc import Sequence

from navapp.control.states import CandidateLine
from navapp.geometry.box import Box
from navapp.ui.pictures.fitting import choose_part
from navapp.ui.pictures.picture import Picture
from navapp.ui.symbols import Symbols
from navapp.ui.view import Level, View
from navapp.values import DEPTH_COLOURS, Origin

NOTICE = "research, not for clinical use"
# So many are compared side by side.
MOST_CANDIDATES = 3
_EYE_HINT = "y: video, or what the eye sees in the mirror"
_DEPTH_WORDS = {
    Origin.MATCHED: "matched",
    Origin.FILLED_BORDER: "border",
    Origin.FILLED_INTERIOR: "interior",
    Origin.MISMATCH_FILLED: "mismatch",
    Origin.UNKNOWN: "unknown",
}


def _tell_depth_key() -> str:
    """What the colours of the depth mean, as markup."""
    words = []
    for origin, word in _DEPTH_WORDS.items():
        blue, green, red = DEPTH_COLOURS[origin]
        words.append(f"[#{red:02x}{green:02x}{blue:02x}]{word}[/]")
    return " · " + " ".join(words)


_DEPTH_KEY = _tell_depth_key()


class PictureView(Picture):
    """The newest picture of a session, in a frame that says how it stands."""

    def __init__(self) -> None:
        super().__init__("picture")
        self.border_subtitle = NOTICE
        self._title, self._has_eye = "", False
        self._bone_part: Box | None = None

    def show(self, view: View) -> None:
        """Take over the newest picture and say how it stands."""
        key = _DEPTH_KEY if view.snapshot.shows_depth else ""
        part = self._choose_part(view)
        near = "" if part is None else f" {view.symbols.dot} around the bone, w: all of it"
        title = view.picture_title + (key or near)
        if self._title != title:
            self._title = title
            self.border_title = self._title
        if self._has_eye != view.snapshot.has_eye:
            self._has_eye = view.snapshot.has_eye
            hint = f"{_EYE_HINT} {view.symbols.dot} " if self._has_eye else ""
            self.border_subtitle = hint + NOTICE
        for level in Level:
            self.set_class(level is view.level, f"-{level.name.lower()}")
        self.show_picture(view.snapshot.picture, view.symbols.ramp, part)

    def is_near(self, view: View) -> bool:
        """The region around the bone is wanted: in half blocks and for a candidate, or by a key."""
        if view.is_near is not None:
            return view.is_near
        return not self.has_pixels or view.snapshot.is_candidate

    def _choose_part(self, view: View) -> Box | None:
        """The region around the bone; None for all of it."""
        snapshot, (width, height) = view.snapshot, self.room
        is_near = self.is_near(view)
        bone, picture = snapshot.bone_box, snapshot.picture
        if not is_near or bone is None or picture is None or snapshot.shows_eye or not height:
            return None
        size_px = snapshot.picture_size_px
        if picture.shape[1::-1] != size_px:
            return None
        self._bone_part = choose_part(bone, size_px, width / height, self._bone_part)
        return self._bone_part


class CandidateView(Picture):
    """One of several candidates: its outline, and the judge's word on it.

    Args:
        index: from 0, among those that are side by side.
    """

    def __init__(self, index: int) -> None:
        super().__init__(f"candidate-{index}")
        self._index = index

    def show(self, view: View) -> None:
        """That candidate, when several wait."""
        candidates = select_compared(view.snapshot.candidates)
        is_known = len(candidates) > 1 and self._index < len(candidates)
        self.set_class(is_known, "-known")
        if not is_known:
            self.show_picture(None, view.symbols.ramp)
            return
        one = candidates[self._index]
        self.set_class(one.is_shown, "-shown")
        title = describe_candidate(one, view.symbols)
        if self.border_title != title:
            self.border_title = title
        self.show_picture(one.picture, view.symbols.ramp)


def select_compared(candidates: Sequence[CandidateLine]) -> Sequence[CandidateLine]:
    """Those that have room side by side: the one under review, and those around it."""
    place = next((k for k, one in enumerate(candidates) if one.is_shown), 0)
    first = max(min(place - MOST_CANDIDATES // 2, len(candidates) - MOST_CANDIDATES), 0)
    return candidates[first : first + MOST_CANDIDATES]


def describe_candidate(one: CandidateLine, symbols: Symbols) -> str:
    """Number, the judge's word, coverage, bound; a mark on the one under review."""
    verdict = one.verdict
    bound_mm = verdict.predicted_tre_mm
    bound = "" if bound_mm is None else f" {symbols.at_most} {bound_mm:.2f} mm"
    mark = f"{symbols.ok} " if one.is_shown else ""
    word = f"{mark}{one.number} {verdict.status.value}, {100.0 * verdict.coverage:.0f} % seen"
    return word + bound


class ResidualView(Picture):
    """Beside a candidate's outline: how far the measured surface lies from the model."""

    def __init__(self) -> None:
        super().__init__("residuals")
        self.border_title = "measured: orange outside the model, blue inside"

    def show(self, view: View) -> None:
        """There is one while a candidate waits."""
        picture = view.snapshot.residual_picture
        self.set_class(picture is not None, "-known")
        self.show_picture(picture, view.symbols.ramp)
