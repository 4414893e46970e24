"""The footer: the keys of the action table, those that cannot be used now dimmed."""

from textual.content import Content

from navapp.ui.actions import ACTIONS, Action, is_possible
from navapp.ui.text_view import TextView
from navapp.ui.view import View

_WIDE = 110


class KeyFooter(TextView):
    """The keys at fixed places; those that cannot be used now are dimmed."""

    def __init__(self) -> None:
        super().__init__("footer")

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """One line."""
        gap = "   " if width >= _WIDE else " "
        parts: list[Content] = []
        for actions in _slots(is_wide=width >= _WIDE):
            possible = [a for a in actions if is_possible(a, view.snapshot, view.is_silent)]
            place = max(len(a.key_label) + 1 + len(a.label) for a in actions)
            parts.append(_key((possible or actions)[0], bool(possible), place))
        return [Content.assemble(" ", Content(gap).join(parts))]


def _slots(*, is_wide: bool) -> list[list[Action]]:
    slots: dict[str, list[Action]] = {}
    for action in ACTIONS:
        if action.slot and (is_wide or not action.needs_width):
            slots.setdefault(action.slot, []).append(action)
    return list(slots.values())


def _key(action: Action, is_enabled: bool, place: int) -> Content:
    key, label = action.key_label, f" {action.label}".ljust(place - len(action.key_label))
    if not is_enabled:
        return Content.styled(key + label, "$text-disabled")
    return Content.assemble((key, "bold $primary"), (label, "$foreground"))
