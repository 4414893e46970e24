"""Widgets of the screen of a tool's calibration."""

from dataclasses import dataclass

from textual.content import Content

from navapp.control.tool_calibration.states import ToolPhase, ToolSnapshot
from navapp.ui.gauges import Number, cut, draw_bar, draw_fraction_bar
from navapp.ui.guided_panels import TOO_SMALL, format_events, format_key, format_title
from navapp.ui.symbols import Symbols
from navapp.ui.text_view import Lines
from navapp.ui.view import Level

_GAUGE_WIDTH = 22
KEYS = (("f", "finish"), ("n", "begin anew"), ("q", "leave"))


@dataclass(frozen=True, slots=True, eq=False)
class ToolView:
    """What is shown: a snapshot and the characters for it."""

    snapshot: ToolSnapshot
    symbols: Symbols

    @property
    def state(self) -> tuple[str, Level]:
        """A word and how it stands."""
        snapshot = self.snapshot
        if snapshot.trouble:
            return "NO CAMERA", Level.BAD
        if snapshot.phase is ToolPhase.DONE:
            return "DONE", Level.OK
        return snapshot.phase.value.upper(), Level.ATTENTION


class ToolTitle(Lines[ToolView]):
    """Camera at the left, poses and phase at the right."""

    def build(self, view: ToolView, width: int, height: int) -> list[Content]:
        """One line."""
        snapshot = view.snapshot
        word, level = view.state
        right = Content.assemble(
            (f"{snapshot.n_poses} poses", "bold $foreground"), "  ",
            (f"{level.mark(view.symbols)} {word}", level.value), " ",
        )  # fmt: skip
        camera = snapshot.camera
        name, is_sim = camera.removeprefix("sim:"), camera.startswith("sim:")
        return [format_title("calibrate pivot", name, right, width, is_sim=is_sim)]


class ToDoLine(Lines[ToolView]):
    """What to do now; first of all a camera's trouble."""

    def build(self, view: ToolView, width: int, height: int) -> list[Content]:
        """One line."""
        snapshot = view.snapshot
        text, level = snapshot.instruction, Level.ATTENTION
        if snapshot.trouble:
            text, level = snapshot.trouble, Level.BAD
        told = cut(text, max(width - 10, 0), view.symbols)
        return [Content.assemble((" to do   ", "$text-muted"), (told, level.value))]


class PlateLine(Lines[ToolView]):
    """How much of the plate is seen, or why it is not measured."""

    def build(self, view: ToolView, width: int, height: int) -> list[Content]:
        """One line."""
        snapshot, symbols = view.snapshot, view.symbols
        if snapshot.missing:
            told = f"{Level.ATTENTION.mark(symbols)} {snapshot.missing}"
            return [Content.assemble((" plate   ", "$text-muted"), (told, Level.ATTENTION.value))]
        bar = draw_fraction_bar(snapshot.seen_share, _GAUGE_WIDTH, symbols)
        return [
            Content.assemble(
                (" plate   ", "$text-muted"),
                (bar, Level.OK.value),
                f" {Number.PERCENT.text(100.0 * snapshot.seen_share)} % seen",
            )
        ]


class TipLine(Lines[ToolView]):
    """The tip's bound against the limit; the lean that it needs; of a turn, how far it went."""

    def build(self, view: ToolView, width: int, height: int) -> list[Content]:
        """Two lines."""
        snapshot, symbols = view.snapshot, view.symbols
        is_good = snapshot.bound_mm is not None and snapshot.bound_mm <= snapshot.stop_mm
        level = Level.OK if is_good else Level.ATTENTION
        lean = snapshot.half_angle_deg
        leaned = "" if lean is None else f"; leaned {lean:.0f} of 20 deg"
        tip = Content.assemble(
            (" tip     ", "$text-muted"),
            (draw_bar(snapshot.bound_mm, snapshot.stop_mm, _GAUGE_WIDTH, symbols), level.value),
            f" {Number.MM.text(snapshot.bound_mm)} mm, enough at {snapshot.stop_mm:.2f}{leaned}",
        )
        if snapshot.phase not in (ToolPhase.FIRST_TURN, ToolPhase.SECOND_TURN):
            return [tip.truncate(width), Content("")]
        share = min(snapshot.swept_deg / snapshot.turn_deg, 1.0)
        turn = Content.assemble(
            (" turn    ", "$text-muted"),
            (draw_fraction_bar(share, _GAUGE_WIDTH, symbols), Level.ATTENTION.value),
            f" {snapshot.swept_deg:.0f} of {snapshot.turn_deg:.0f} deg",
        )
        return [tip.truncate(width), turn.truncate(width)]


class ToolEvents(Lines[ToolView]):
    """What happened, newest first."""

    def build(self, view: ToolView, width: int, height: int) -> list[Content]:
        """As many lines as there is room for."""
        return format_events(view.snapshot.events, width, height, view.symbols)


class ToolFooter(Lines[ToolView]):
    """The keys."""

    def build(self, view: ToolView, width: int, height: int) -> list[Content]:
        """One line."""
        parts = [part for key, label in KEYS for part in format_key(key, label)]
        return [Content.assemble(*parts).truncate(width)]


class SmallTool(Lines[ToolView]):
    """Stands in for everything on a terminal that is too small."""

    def build(self, view: ToolView, width: int, height: int) -> list[Content]:
        """Most important line first."""
        word, level = view.state
        return [
            Content.styled(word, level.value),
            Content(view.snapshot.instruction),
            TOO_SMALL,
        ]
