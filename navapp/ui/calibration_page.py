"""The page of the calibrations: how old they are, when they end, and what has moved since."""

import textwrap
from collections.abc import Iterator
from datetime import date
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.content import Content
from textual.geometry import Size

from navapp.control.length_check import Finding
from navapp.control.specification import SessionSpecification
from navapp.control.states import Snapshot
from navapp.geometry.display_model import DisplayQuality
from navapp.geometry.rig import RigQuality
from navapp.tools.tool import TOOL_KINDS, bound_of
from navapp.ui.background import Background
from navapp.ui.screens import PageScreen
from navapp.ui.text_view import TextView
from navapp.ui.view import Level, View

Fact = tuple[Level, str]
# A calibration that ends within so many days should be made again soon: chosen.
_SOON_DAYS = 14
_INDENT = 5  # of a fact, with its mark
_FINDINGS = {
    Finding.OFF: Level.BAD,
    Finding.DOUBTFUL: Level.ATTENTION,
    Finding.WITHIN: Level.OK,
    Finding.NOT_JUDGED: Level.QUIET,
}


def list_calibrations(background: Background, snapshot: Snapshot) -> dict[str, list[Fact]]:
    """Facts under the name of what is calibrated."""
    given, today = background.specification, background.today
    rig = given.rig
    groups = {
        f"rig {rig.name or rig.rig_id}": [
            (Level.QUIET, f"cameras {' and '.join(one or 'unnamed' for one in rig.serials)}"),
            (Level.QUIET, f"baseline {rig.baseline_mm:.2f} mm, id {rig.rig_id}"),
            *_describe_quality(rig.quality, today),
            *_describe_uncertainty(rig.quality),
        ],
        "what has moved since": list(_describe_moves(snapshot)),
        "display in the mirror": _describe_display(given, today),
        "display's delay": [_describe_delay(given)],
    }
    for kind in TOOL_KINDS:
        groups[kind] = _describe_tool(given, kind, today)
    return groups


def _describe_quality(quality: RigQuality | DisplayQuality | None, today: date) -> Iterator[Fact]:
    """Verdict, age and end."""
    if quality is None:
        yield Level.ATTENTION, "no quality record: nobody says how good it is, or how old"
        return
    if quality.is_accepted:
        yield Level.OK, "accepted by its calibration"
    else:
        why = "; ".join(quality.reasons) or "no reason is recorded"
        yield Level.BAD, f"NOT accepted: {why}"
    yield _describe_age(quality.made_on, today)
    if quality.expires_on is None:
        yield Level.QUIET, "it has no end"
        return
    left = (quality.expires_on - today).days
    if left < 0:
        yield Level.BAD, f"EXPIRED on {quality.expires_on}: calibrate again"
    else:
        level = Level.ATTENTION if left <= _SOON_DAYS else Level.OK
        yield level, f"good until {quality.expires_on}, {_days(left)} left"


def _describe_age(made_on: date | None, today: date) -> Fact:
    if made_on is None:
        return Level.ATTENTION, "nobody says when it was made"
    return Level.QUIET, f"made on {made_on}, {_days((today - made_on).days)} ago"


def _days(count: int) -> str:
    return f"{count} day" if count == 1 else f"{count} days"


def _describe_uncertainty(quality: RigQuality | None) -> Iterator[Fact]:
    if quality is not None and quality.uncertainty_mm is not None:
        text = f"95 % of points in the working volume are right to {quality.uncertainty_mm:.2f} mm"
        yield Level.QUIET, text


def _describe_moves(snapshot: Snapshot) -> Iterator[Fact]:
    """What the pictures of this session say of the rig."""
    if snapshot.rig_alarm:
        yield Level.BAD, f"{snapshot.rig_alarm}; calibrate again"
    rows = snapshot.rows
    if rows is None:
        yield Level.QUIET, "rows: not known until a bone is followed"
    else:
        text = f"rows: the right picture shows everything {abs(rows.offset_px):.2f} px too "
        text += "low" if rows.offset_px > 0.0 else "high"
        yield (Level.BAD, f"{text}: too much") if rows.is_off else (Level.OK, f"{text}: within")
    check = snapshot.length_check
    if check is None:
        yield Level.QUIET, "known length: none was seen (a board, named in [calibration] board)"
    else:
        yield _FINDINGS[check.finding], f"known length: {check}"
    yield Level.QUIET, "a camera turned sideways, or another baseline, only a known length shows"


def _describe_display(given: SessionSpecification, today: date) -> list[Fact]:
    model = given.display_model
    if model is None:
        return [(Level.QUIET, "none: guides lie over the video")]
    facts = [(Level.QUIET, f"{model.display_name or 'unnamed'}, for the {model.viewing_eye} eye")]
    facts += _describe_quality(model.quality, today)
    if model.quality is not None and model.quality.error_mm is not None:
        facts.append((Level.QUIET, f"95 % of guides are right to {model.quality.error_mm:.2f} mm"))
    return facts


def _describe_delay(given: SessionSpecification) -> Fact:
    if given.display_delay_ms == 0.0:
        return Level.QUIET, "not measured (navapp calibrate latency)"
    delay, bound_ms = f"{given.display_delay_ms:.0f}", given.display_delay_bound_ms
    if bound_ms == 0.0:
        return Level.ATTENTION, f"{delay} ms; its bound is not known"
    return Level.OK, f"{delay} +- {bound_ms:.0f} ms"


def _describe_tool(given: SessionSpecification, kind: str, today: date) -> list[Fact]:
    tool = {str(name): one for name, one in given.tools.items()}.get(kind)
    if tool is None:
        return [(Level.QUIET, f"none: name its file in [tools] {kind}")]
    facts = [_describe_age(tool.made_on, today)]
    tip_mm = bound_of(tool.tip_covariance_mm2)
    facts.append((Level.OK, f"tip right to {tip_mm:.2f} mm (95 %)"))
    if tool.rig_id and tool.rig_id != given.rig.rig_id:
        facts.append((Level.ATTENTION, "calibrated with another rig"))
    return facts


class CalibrationTable(TextView):
    """All calibrations with their facts.

    Args:
        background: of the session.
    """

    def __init__(self, background: Background) -> None:
        super().__init__("calibrations")
        self._background = background

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """A heading each, its facts below."""
        lines = list[Content]()
        for title, facts in list_calibrations(self._background, view.snapshot).items():
            lines.append(Content.styled(f" {title}", "$text-muted"))
            for level, text in facts:
                first, *more = textwrap.wrap(text, max(width - _INDENT, 20))
                mark = f"   {level.mark(view.symbols)} "
                lines.append(Content.assemble((mark, level.value), first))
                lines += [Content(" " * _INDENT + line) for line in more]
        return lines

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        """As many lines as there are."""
        return 1 if self._view is None else len(self.build(self._view, width, 0))


class CalibrationPage(PageScreen):
    """Calibrations, scrollable."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("h", "dismiss", "back", show=False)]

    page_title, keys = "calibrations", " back  arrows, PgUp, PgDn scroll"
    container = VerticalScroll

    def __init__(self, view: View, background: Background) -> None:
        super().__init__(view)
        self._background = background

    def compose_page(self) -> ComposeResult:
        """Calibrations."""
        yield CalibrationTable(self._background)
