"""The page on which a plan is checked by eye: its slices, its bones, its warnings."""

from typing import ClassVar

from textual import events
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.widgets import Static

from navapp.overlay.fitting import fit_size
from navapp.preop.slice_drawing import draw_slice
from navapp.preop.slices import DIRECTIONS
from navapp.ui.pictures.picture import Picture
from navapp.ui.plan_texts import PlanFacts, SliceText
from navapp.ui.screens import PageScreen
from navapp.ui.slice_walk import SliceWalk
from navapp.ui.view import View

# What an arrow goes on by, with SHIFT and alone.
_LARGE_STEP = 10
_ARROWS = {"up": 1, "right": 1, "down": -1, "left": -1}
# Pixels of a drawing for each half block across and down: lines stay visible.
_DRAWN_FINER = 2
_SIDES = ("left", "right", "top", "bottom")


class SlicePicture(Picture):
    """A slice, drawn at the size at which it is seen."""

    def __init__(self) -> None:
        super().__init__("plan-picture")
        self._drawn: tuple[object, ...] = ()

    def show_slice(self, walk: SliceWalk, ramp: str) -> None:
        """Draw it, unless it is what was drawn last."""
        width, height = self.room
        if width < 1 or height < 1:
            return
        wanted = (walk.direction, walk.index, walk.window, width, height, self.has_pixels)
        picture = self._picture
        if picture is None or wanted != self._drawn:
            self._drawn = wanted
            finer = 1 if self.has_pixels else _DRAWN_FINER
            shape = walk.plan.grid.shape_of(walk.direction)
            picture = draw_slice(
                walk.plan,
                walk.direction,
                walk.index,
                fit_size(shape, finer * width, finer * height),
                walk.window_hu,
                thickness_px=finer,
                has_numbers=self.has_pixels,
            )
        self.show_picture(picture, ramp)


class PlanPage(PageScreen):
    """Slices in three directions with contours, marks and landmarks; facts of the plan.

    Args:
        view: to begin with.
        walk: where the person was among the slices.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("i", "dismiss", "back", show=False),
        *(Binding(key, f"scroll({step})", "scroll", show=False) for key, step in _ARROWS.items()),
        *(
            Binding(f"shift+{key}", f"scroll({_LARGE_STEP * step})", "scroll", show=False)
            for key, step in _ARROWS.items()
        ),
        Binding("pageup", f"scroll({_LARGE_STEP})", "scroll", show=False),
        Binding("pagedown", f"scroll({-_LARGE_STEP})", "scroll", show=False),
        Binding("tab", "turn(1)", "direction", show=False),
        Binding("shift+tab", "turn(-1)", "direction", show=False),
        *(
            Binding(str(k), f"choose({k})", direction.name, show=False)
            for k, direction in enumerate(DIRECTIONS, 1)
        ),
        Binding("n", "go_to_point(1)", "next point", show=False),
        Binding("N", "go_to_point(-1)", "previous point", show=False),
        Binding("w", "change_window", "densities", show=False),
        Binding("f", "toggle_facts", "facts", show=False),
    ]

    page_title = "the plan"
    keys = " back  arrows scroll  TAB direction  n point  w grey  f facts"

    def __init__(self, view: View, walk: SliceWalk) -> None:
        super().__init__(view)
        self._walk = walk

    def compose_page(self) -> ComposeResult:
        """The slice between its marks; beside it what is seen, and the facts."""
        with Horizontal(id="plan"):
            with Vertical(id="plan-slice"):
                yield Static(id="plan-top")
                with Horizontal(id="plan-middle"):
                    yield Static(id="plan-left")
                    yield SlicePicture()
                    yield Static(id="plan-right")
                yield Static(id="plan-bottom")
            with Vertical(id="plan-side"):
                yield SliceText("plan-text")
                with VerticalScroll(id="plan-facts", can_focus=False):
                    yield PlanFacts("plan-facts-text")

    def show(self, view: View, *, is_text_due: bool) -> None:
        """The title goes on; the plan stays as it is."""
        super().show(view, is_text_due=is_text_due)
        if not self._shows_facts:
            self.query_one(SlicePicture).show_slice(self._walk, view.symbols.ramp)

    def on_mount(self) -> None:
        """Show all of it."""
        super().on_mount()
        self.query_one(PlanFacts).show(self._walk.plan)
        self.query_one(PlanFacts).refresh(layout=True)  # It is as high as there are lines.
        self._redraw()

    def on_resize(self, _event: events.Resize) -> None:
        """The slice is as large as there is room for it."""
        self.call_after_refresh(self._redraw)

    def action_scroll(self, step: int) -> None:
        """Another slice; the facts scroll where they alone are shown."""
        if self._shows_facts:
            self.query_one("#plan-facts").scroll_relative(y=-step, animate=False)
            return
        self._walk.scroll(step)
        self._redraw()

    def action_turn(self, step: int) -> None:
        """Another direction."""
        self._walk.turn(step)
        self._redraw()

    def action_choose(self, number: int) -> None:
        """A direction."""
        self._walk.choose(number)
        self._redraw()

    def action_go_to_point(self, step: int) -> None:
        """Another slice with a landmark or a target."""
        if not self._walk.go_to_point(step):
            self.notify("the plan has no landmarks and no targets", severity="warning")
        self._redraw()

    def action_change_window(self) -> None:
        """Other densities as black and white."""
        if self._walk.plan.volume.range_hu is None:
            self.notify("there are no densities to choose from without a CT", severity="warning")
        self._walk.change_window()
        self._redraw()

    def action_toggle_facts(self) -> None:
        """The facts in the place of the slice, and back."""
        self.toggle_class("-facts")
        self.query_one(SlicePicture).leave_place()
        self.call_after_refresh(self._redraw)

    @property
    def _shows_facts(self) -> bool:
        return self.has_class("-facts")

    def _redraw(self) -> None:
        for side, mark in zip(_SIDES, self._walk.direction.marks, strict=True):
            self.query_one(f"#plan-{side}", Static).update(mark)
        self.query_one(SliceText).show(self._walk)
        self.show(self.view, is_text_due=True)
