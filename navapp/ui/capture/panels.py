"""Widgets of the capture's screen."""

from dataclasses import dataclass

from textual.content import Content

from navapp.control.capture.states import CapturePhase, CaptureSnapshot
from navapp.ui.capture.keys import HAND_HINT, KEYS, is_possible
from navapp.ui.gauges import Number, cut, draw_bar, draw_fraction_bar
from navapp.ui.guided_panels import TOO_SMALL, Parts, format_events, format_key, format_title
from navapp.ui.symbols import Symbols
from navapp.ui.text_view import Lines, break_line
from navapp.ui.view import Level

_GAUGE_WIDTH, _WORK_WIDTH = 26, 30


@dataclass(frozen=True, slots=True, eq=False)
class CaptureView:
    """What is shown: a snapshot and the characters for it."""

    snapshot: CaptureSnapshot
    symbols: Symbols

    @property
    def state(self) -> tuple[str, Level]:
        """A word and how it stands."""
        snapshot = self.snapshot
        if snapshot.trouble:
            return "NO CAMERA", Level.BAD
        if snapshot.phase is CapturePhase.SOLVING:
            return "SOLVING", Level.QUIET
        if snapshot.outcome is not None:
            if snapshot.outcome.is_accepted:
                return "ACCEPTED", Level.OK
            return "NOT ACCEPTED", Level.BAD
        return ("ENOUGH", Level.OK) if snapshot.is_enough else ("CAPTURING", Level.ATTENTION)


class CaptureTitle(Lines[CaptureView]):
    """Camera at the left, pairs and state at the right."""

    def build(self, view: CaptureView, width: int, height: int) -> list[Content]:
        """One line."""
        snapshot = view.snapshot
        word, level = view.state
        right = Content.assemble(
            (f"{snapshot.n_kept} pairs", "bold $foreground"), "  ",
            (f"{level.mark(view.symbols)} {word}", level.value), " ",
        )  # fmt: skip
        camera = snapshot.camera
        name, is_sim = camera.removeprefix("sim:"), camera.startswith("sim:")
        return [format_title("calibrate", name, right, width, is_sim=is_sim)]


class InstructionLines(Lines[CaptureView]):
    """Where the board is wanted, or what became of the solve; first of all a camera's trouble."""

    def build(self, view: CaptureView, width: int, height: int) -> list[Content]:
        """Two lines."""
        outcome, symbols = view.snapshot.outcome, view.symbols
        if outcome is not None:
            level = Level.OK if outcome.is_accepted else Level.BAD
            what = "accepted: rig.yml and report.html are written" if outcome.is_accepted else "no:"
            text = " ".join([what, *outcome.sentences])
            first, rest = break_line(text, width - 10)
        else:
            level = Level.OK if view.snapshot.is_enough else Level.ATTENTION
            first, rest = break_line(view.snapshot.instruction, width - 10)
        head = "outcome " if outcome is not None else "wanted  "
        if view.snapshot.trouble:
            head, level = "camera  ", Level.BAD
            first, rest = break_line(view.snapshot.trouble, width - 10)
        return [
            Content.assemble((f" {head}", "$text-muted"), (first, level.value)),
            Content.assemble("         ", (cut(rest, max(width - 10, 0), symbols), level.value)),
        ]


class CheckLine(Lines[CaptureView]):
    """The shutter's conditions."""

    def build(self, view: CaptureView, width: int, height: int) -> list[Content]:
        """One line."""
        left, right, n_all = view.snapshot.n_seen
        parts: list[str | Content | tuple[str, str]] = [
            (" shutter ", "$text-muted"),
            f"{left:3d} {right:3d} of {n_all}",
        ]
        for check in view.snapshot.checks:
            level = Level.OK if check.is_met else Level.ATTENTION
            name = check.name if check.is_met else f"not {check.name}"
            told = "" if check.name in ("seen", "new") and check.is_met else f" {check.text}"
            parts += [
                "  ",
                (f"{level.mark(view.symbols)} {name}", level.value),
                (told, "$text-muted"),
            ]
        return [Content.assemble(*parts).truncate(width)]


class GaugeLine(Lines[CaptureView]):
    """The predicted error against the limit at which a capture is enough."""

    def build(self, view: CaptureView, width: int, height: int) -> list[Content]:
        """One line; while a rig is solved, how far it is."""
        snapshot, symbols = view.snapshot, view.symbols
        if snapshot.progress is not None:
            return [
                Content.assemble(
                    (" solving ", "$text-muted"),
                    (draw_fraction_bar(snapshot.progress.share, _WORK_WIDTH, symbols), "$primary"),
                    f" {Number.PERCENT.text(100.0 * snapshot.progress.share)} %",
                )
            ]
        level = Level.OK if snapshot.is_enough else Level.ATTENTION
        return [
            Content.assemble(
                (" error   ", "$text-muted"),
                (draw_bar(snapshot.bound_mm, snapshot.stop_mm, _GAUGE_WIDTH, symbols), level.value),
                f" {Number.MM.text(snapshot.bound_mm)} mm, enough at {snapshot.stop_mm:.2f}",
                (f"; everywhere {Number.MM.text(snapshot.worst_mm).strip()}", "$text-muted"),
            ).truncate(width)
        ]


class CoverageMap(Lines[CaptureView]):
    """Where marks were kept, in both pictures."""

    def build(self, view: CaptureView, width: int, height: int) -> list[Content]:
        """A title and three lines of two rows of cells each."""
        symbols = view.symbols
        signs = (
            {(0, 0): ".", (1, 0): "^", (0, 1): "_", (1, 1): "#"}
            if symbols.is_ascii
            else {(0, 0): symbols.dot, (1, 0): "▀", (0, 1): "▄", (1, 1): "█"}
        )
        lines = [Content.styled(" kept marks: left   right", "$text-muted")]
        covered = view.snapshot.covered.astype(int)
        for row in range(0, covered.shape[1], 2):
            maps = [
                "".join(
                    2 * signs[int(a), int(b)] for a, b in zip(one[row], one[row + 1], strict=True)
                )
                for one in covered
            ]
            lines.append(Content.assemble(" ", (maps[0], "$primary"), "  ", (maps[1], "$primary")))
        return lines


class CaptureEvents(Lines[CaptureView]):
    """What happened, newest first."""

    def build(self, view: CaptureView, width: int, height: int) -> list[Content]:
        """As many lines as there is room for."""
        return format_events(view.snapshot.events, width, height, view.symbols)


class CaptureFooter(Lines[CaptureView]):
    """The keys; those that cannot be used now dimmed."""

    def build(self, view: CaptureView, width: int, height: int) -> list[Content]:
        """One line."""
        snapshot = view.snapshot
        parts: Parts = []
        for key in KEYS:
            if not key.label or (key.is_for_hand and not snapshot.has_hand):
                continue
            label = "let go" if key.key == "m" and snapshot.is_following else key.label
            parts += format_key(key.shown, label, is_possible(key, snapshot))
        if snapshot.has_hand:
            parts += format_key(*HAND_HINT)
        return [Content.assemble(*parts).truncate(width)]


class SmallCapture(Lines[CaptureView]):
    """Stands in for everything on a terminal that is too small."""

    def build(self, view: CaptureView, width: int, height: int) -> list[Content]:
        """Most important line first."""
        word, level = view.state
        return [
            Content.styled(word, level.value),
            Content(view.snapshot.instruction),
            Content(f"{view.snapshot.n_kept} pairs"),
            TOO_SMALL,
        ]
