"""Widgets of the alignment's screen."""

from dataclasses import dataclass

from textual.content import Content

from navapp.control.mirror_alignment.aimed_corner import MOST_MOVED_MM
from navapp.control.mirror_alignment.states import AlignmentPhase, AlignmentSnapshot
from navapp.ui.gauges import Number, cut, draw_bar
from navapp.ui.guided_panels import TOO_SMALL, Parts, format_events, format_key, format_title
from navapp.ui.mirror_alignment.keys import CROSS_HINTS, HAND_HINT, KEYS, Key, is_possible
from navapp.ui.symbols import Symbols
from navapp.ui.text_view import Lines, break_line
from navapp.ui.view import Level

_GAUGE_WIDTH = 22
_WORDS = {
    AlignmentPhase.SEEKING: "WAITING",
    AlignmentPhase.MOVING: "MOVE BOARD",
    AlignmentPhase.ALIGNING: "ALIGN",
    AlignmentPhase.SOLVING: "SOLVING",
    AlignmentPhase.OVER: "OVER",
}


@dataclass(frozen=True, slots=True, eq=False)
class AlignmentView:
    """What is shown: a snapshot and the characters for it."""

    snapshot: AlignmentSnapshot
    symbols: Symbols

    @property
    def state(self) -> tuple[str, Level]:
        """A word and how it stands."""
        snapshot = self.snapshot
        if snapshot.trouble:
            return "DEVICE LOST", Level.BAD
        if snapshot.is_accepted:
            return "ENOUGH", Level.OK
        is_busy = snapshot.phase is AlignmentPhase.SOLVING
        return _WORDS[snapshot.phase], Level.QUIET if is_busy else Level.ATTENTION


class AlignmentTitle(Lines[AlignmentView]):
    """Display and eye at the left, alignments and state at the right."""

    def build(self, view: AlignmentView, width: int, height: int) -> list[Content]:
        """One line."""
        snapshot = view.snapshot
        word, level = view.state
        n_strays = 0 if snapshot.verdict is None else len(snapshot.verdict.strays)
        right = Content.assemble(
            (f"{snapshot.n_kept} of {snapshot.fewest} crosses", "bold $foreground"),
            (f", {n_strays} left out" if n_strays else "", Level.ATTENTION.value), "  ",
            (f"{level.mark(view.symbols)} {word}", level.value), " ",
        )  # fmt: skip
        device = f"{snapshot.display.removeprefix('sim:')}, {snapshot.eye} eye"
        is_sim = snapshot.camera.startswith("sim:")
        return [format_title("calibrate mirror", device, right, width, is_sim=is_sim)]


class InstructionLines(Lines[AlignmentView]):
    """What to do next; first of all a device's trouble."""

    def build(self, view: AlignmentView, width: int, height: int) -> list[Content]:
        """Two lines."""
        snapshot = view.snapshot
        text = snapshot.trouble or snapshot.instruction
        level = Level.BAD if snapshot.trouble else view.state[1]
        first, rest = break_line(text, width - 10)
        return [
            Content.assemble((" next    ", "$text-muted"), (first, level.value)),
            Content.assemble(
                "         ", (cut(rest, max(width - 10, 0), view.symbols), level.value)
            ),
        ]


class CrossLine(Lines[AlignmentView]):
    """Where the cross is, whether the board rests, and how the eye reads the display."""

    def build(self, view: AlignmentView, width: int, height: int) -> list[Content]:
        """One line."""
        snapshot, symbols = view.snapshot, view.symbols
        left, right, n_all = snapshot.n_seen
        cross = "dark" if snapshot.cross_px is None else "{:d}, {:d} px".format(*snapshot.cross_px)
        rest = Level.OK if snapshot.is_still else Level.ATTENTION
        moved = snapshot.moved_mm
        parts: list[str | Content | tuple[str, str]] = [
            (" cross   ", "$text-muted"), f"{cross:14s}",
            (" marks ", "$text-muted"), f"{left:d} {right:d} of {n_all:d}  ",
            (f"{rest.mark(symbols)} {'at rest' if snapshot.is_still else 'moving'}", rest.value),
        ]  # fmt: skip
        if moved is not None and moved < 100.0:
            level = Level.OK if moved <= MOST_MOVED_MM else Level.BAD
            parts.append((f", moved {moved:.1f} mm", level.value))
        parts += [(" text ", "$text-muted"), "on head" if snapshot.is_upside_down else "upright"]
        return [Content.assemble(*parts).truncate(width)]


class ErrorLine(Lines[AlignmentView]):
    """The predicted error against the limit at which it is enough, and why it is not."""

    def build(self, view: AlignmentView, width: int, height: int) -> list[Content]:
        """Two lines."""
        snapshot, symbols, verdict = view.snapshot, view.symbols, view.snapshot.verdict
        error_mm = None if verdict is None else verdict.error_mm
        level = Level.OK if snapshot.is_accepted else Level.ATTENTION
        bar = draw_bar(error_mm, snapshot.limit_mm, _GAUGE_WIDTH, symbols)
        told = f" {Number.MM.text(error_mm)} mm at the anatomy, 95 %, enough at "
        parts: list[str | Content | tuple[str, str]] = [
            (" error   ", "$text-muted"), (bar, level.value), f"{told}{snapshot.limit_mm:.2f}",
        ]  # fmt: skip
        reason = "" if verdict is None or not verdict.reasons else verdict.reasons[0]
        why = Content.styled(f"         {cut(reason, max(width - 10, 0), symbols)}", level.value)
        return [Content.assemble(*parts).truncate(width), why]


class UsedMap(Lines[AlignmentView]):
    """Which ninths of the display were used, as the eye sees them, and the depths."""

    def build(self, view: AlignmentView, width: int, height: int) -> list[Content]:
        """The depths, then three rows."""
        snapshot = view.snapshot
        is_met = snapshot.has_depth
        level = Level.OK if is_met else Level.ATTENTION
        n, range_mm = snapshot.n_depths, snapshot.range_mm
        depths = (
            f"{n} of {snapshot.fewest_depths}, {range_mm:.0f} of {snapshot.least_range_mm:.0f} mm"
        )
        if is_met:
            depths = f"{n} over {range_mm:.0f} mm"
        lines = [Content.assemble((" depths   ", "$text-muted"), (depths, level.value))]
        for name, row in zip((" display ", "", ""), snapshot.used.tolist(), strict=True):
            cells = " ".join(f"{count:2d}" if count else f" {view.symbols.dot}" for count in row)
            lines.append(Content.assemble((f"{name:10s}", "$text-muted"), (cells, "$primary")))
        return lines


class AlignmentEvents(Lines[AlignmentView]):
    """What happened, newest first."""

    def build(self, view: AlignmentView, width: int, height: int) -> list[Content]:
        """As many lines as there is room for."""
        return format_events(view.snapshot.events, width, height, view.symbols)


class AlignmentFooter(Lines[AlignmentView]):
    """The keys; those that cannot be used now dimmed."""

    def build(self, view: AlignmentView, width: int, height: int) -> list[Content]:
        """The cross and what becomes of it, then the others."""
        snapshot = view.snapshot
        rows: list[Parts] = [[], []]
        can_move = snapshot.phase is AlignmentPhase.ALIGNING
        for shown, label in CROSS_HINTS:
            rows[0] += format_key(shown, label, can_move)
        for key in KEYS:
            if not key.label or (key.is_for_hand and not snapshot.has_hand):
                continue
            rows[int(key.key not in ("enter", "u", "n", "s"))] += format_key(
                key.shown, _label(key, snapshot), is_possible(key, snapshot)
            )
        if snapshot.has_hand:
            rows[1] += format_key(*HAND_HINT)
        return [Content.assemble(*row).truncate(width) for row in rows]


def _label(key: Key, snapshot: AlignmentSnapshot) -> str:
    if key.key == "m" and snapshot.is_following:
        return "let go"
    return key.label


class SmallAlignment(Lines[AlignmentView]):
    """Stands in for everything on a terminal that is too small."""

    def build(self, view: AlignmentView, width: int, height: int) -> list[Content]:
        """Most important line first."""
        word, level = view.state
        return [
            Content.styled(word, level.value),
            Content(view.snapshot.trouble or view.snapshot.instruction),
            Content(f"{view.snapshot.n_kept} of {view.snapshot.fewest} crosses"),
            TOO_SMALL,
        ]
