"""The title line: session, plan and state."""

from textual.content import Content

from navapp.ui.gauges import cut
from navapp.ui.text_view import TextView
from navapp.ui.view import Level, View

_DIGEST_LENGTH = 4
_NARROW = 110


class TitleLine(TextView):
    """One line; the state stands at the right end on every screen."""

    def __init__(self) -> None:
        super().__init__("title")

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """Identity at the left, state at the right."""
        right = _state(view)
        room = max(width - right.cell_length - 1, 0)
        name = f" {view.title} "
        badge = " sim " if view.snapshot.is_simulated else ""
        rest = cut(_identity(view, width), max(room - len(name) - len(badge) - 1, 0), view.symbols)
        left = Content.assemble(
            (name, "bold $primary"), (badge, "bold $background on $warning"), " ", rest
        )
        left = left.truncate(room).pad_right(max(room - left.cell_length, 0))
        return [Content.assemble(left, right, " ")]


def _identity(view: View, width: int) -> str:
    snapshot = view.snapshot
    digest = snapshot.plan_digest[:_DIGEST_LENGTH]
    plan = f"plan {digest}" if digest else ""
    if snapshot.plan_name and width >= _NARROW:
        plan = f"plan {snapshot.plan_name} {digest}".rstrip()
    bone = f"{snapshot.stage.bone} {snapshot.side[:1].upper()}".rstrip()
    if width >= _NARROW:
        bone = f"{snapshot.stage.bone} {snapshot.side}".rstrip()
    # The plan's mark goes before the rig's name: it tells patients apart when the line is cut.
    parts = [part for part in (bone, plan, snapshot.rig_name) if part]
    return f" {view.symbols.dot} ".join(parts)


def _state(view: View) -> Content:
    snapshot = view.snapshot
    parts: list[str | tuple[str, str]] = []
    if snapshot.is_recording:
        parts += [("REC", "bold $foreground"), "  "]
    if snapshot.is_blanked:
        parts += [(" BLANKED ", Level.ATTENTION.band), "  "]
    stage = snapshot.stage
    parts += [(f"{stage.number} {stage.name.upper()}", "bold $foreground"), "  "]
    level = view.state_level
    parts.append((f"{level.mark(view.symbols)} {view.state_word}", level.value))
    return Content.assemble(*parts)
