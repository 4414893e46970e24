"""The page of the time-out and of the gate before the next stage."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content

from navapp.control.states import ConditionLine, Snapshot
from navapp.ui.screens import PageScreen
from navapp.ui.text_view import TextView
from navapp.ui.view import Level, View

# Of all conditions that a person may have to answer for, in their order.
CONDITION_KEYS = "bcdfghijmnosuwpxyzekl"
# Why a gate may be overridden; their numbers are the keys.
REASONS = (
    "decided by the surgeon",
    "not measurable here",
    "measured by other means",
    "practice, or a test",
)


class GateTable(TextView):
    """Conditions with their letters: met, open, and who said so."""

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """The time-out first."""
        snapshot = view.snapshot
        keys = {name: key for key, name in _keyed(snapshot)}
        lines = [Content.styled(" time-out: guides wait for it", "$text-muted")]
        lines += [_format(line, keys, view) for line in snapshot.time_out]
        if not snapshot.time_out:
            lines.append(Content("    nothing is asked for"))
        elif snapshot.has_mirror:
            lines.append(_format(_mirror_line(snapshot), keys, view))
        lines.append(Content(""))
        is_last = snapshot.gate_stage > len(snapshot.stages)
        title = " before the operation's end"
        if not is_last:
            name = snapshot.stages[snapshot.gate_stage - 1].name
            title = f" before stage {snapshot.gate_stage} {name}"
        lines.append(Content.styled(title, "$text-muted"))
        lines += [_format(line, keys, view) for line in snapshot.gate]
        if not snapshot.gate:
            lines.append(Content("    nothing is asked for"))
        return lines if is_last else [*lines, *_ways_on(snapshot)]


def _ways_on(snapshot: Snapshot) -> list[Content]:
    """How the stage is entered."""
    lines = [Content(""), Content.assemble((" ENTER  ", "bold $primary"), "go on to it")]
    if snapshot.refused_stage is None:
        return lines
    lines.append(
        Content.styled(" not met; go on all the same, for the record because:", "$warning")
    )
    return lines + [
        Content.assemble((f" {number}      ", "bold $primary"), reason)
        for number, reason in enumerate(REASONS, start=1)
    ]


def _format(line: ConditionLine, keys: dict[str, str], view: View) -> Content:
    level = Level.OK if line.is_met else Level.ATTENTION
    key = keys.get(line.name, " ") if line.is_personal else " "
    word = "met " if line.is_met else "open"
    return Content.assemble(
        (f" {key}  ", "bold $primary"),
        (f"{level.mark(view.symbols)} {word} ", level.value),
        line.text,
        (f"  {line.note}" if line.note else "", "$text-muted"),
    )


def _mirror_line(snapshot: Snapshot) -> ConditionLine:
    """The check of the mirror has keys of its own."""
    reason = snapshot.mirror_reason
    note = "" if reason is None else reason.value
    return ConditionLine("mirror", "the mirror is checked (key m)", reason is None, note=note)


def _keyed(snapshot: Snapshot) -> list[tuple[str, str]]:
    """Letter and name of every condition that a person may have to answer for.

    A cut or hole keeps its letter when it becomes measured, and so do those after it.
    """
    lines = [*snapshot.time_out, *snapshot.gate]
    names = dict.fromkeys(
        line.name for line in lines if line.is_personal or line.name.startswith(("cut ", "hole "))
    )
    return list(zip(CONDITION_KEYS, names, strict=False))


def condition_of_key(snapshot: Snapshot, key: str) -> str | None:
    """The name of the condition that a letter of the page means; None: it means nothing."""
    return dict(_keyed(snapshot)).get(key)


class GatesPage(PageScreen):
    """Conditions by their letters, the stage by ENTER, a reason by its number.

    Confirming and withdrawing are keys of their own: typed at any speed they mean the same.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("t", "dismiss", "back", show=False),
        Binding("enter", "app.pass_gate", "enter the stage", show=False),
        *(
            Binding(key, f"app.confirm_condition('{key}')", "confirm", show=False)
            for key in CONDITION_KEYS
        ),
        *(
            Binding(key.upper(), f"app.withdraw_condition('{key}')", "withdraw", show=False)
            for key in CONDITION_KEYS
        ),
        *(
            Binding(str(number), f"app.override_gate('{number}')", reason, show=False)
            for number, reason in enumerate(REASONS, start=1)
        ),
    ]

    page_title, keys = (
        "time-out and gates",
        " back  letter: confirmed  capital: not so  ENTER enter it",
    )

    def compose_page(self) -> ComposeResult:
        """Time-out and gate."""
        yield GateTable("gates")
