"""What is said of a plan beside its slices."""

import textwrap

from textual.content import Content
from textual.geometry import Size

from navapp.preop import PlanView
from navapp.preop.plan_facts import make_bone_rows, make_origin_rows
from navapp.preop.slice_drawing import (
    BONE_COLOURS,
    OTHER_COLOUR,
    WINDOWS_HU,
    Colour,
    choose_point_colour,
    choose_scale_mm,
)
from navapp.ui.slice_walk import SliceWalk
from navapp.ui.text_view import Lines

_NAME_WIDTH = 20


class SliceText(Lines[SliceWalk]):
    """Which slice is shown, and what is seen in it."""

    def build(self, view: SliceWalk, width: int, height: int) -> list[Content]:
        """Its position first."""
        plan, direction = view.plan, view.direction
        n, at_mm = plan.grid.count_slices(direction), plan.grid.position_mm(direction, view.index)
        columns_mm = plan.grid.shape_of(direction)[1] * plan.grid.step_mm
        lines = [
            Content.styled(f"{direction.name}, {direction.letter} = {at_mm:.1f} mm LPS", "bold"),
            Content(f"slice {view.index + 1} of {n}, UP key: {direction.towards}"),
            Content(f"bar: {choose_scale_mm(columns_mm)} mm{_tell_window(view)}"),
            *_tell_warnings(plan),
            *_list_contours(view),
            *_list_points(view),
        ]
        if not plan.has_pictures:
            said = textwrap.wrap(plan.slices_words, width)
            lines += [Content(""), *(Content.styled(line, "$warning") for line in said)]
        return [line.truncate(width, ellipsis=True) for line in lines]


def _tell_window(walk: SliceWalk) -> str:
    if walk.plan.volume.range_hu is None:
        return ""
    black, white = WINDOWS_HU[walk.window] or walk.plan.volume.range_hu
    return f"; {black:g} to {white:g} HU"


def _tell_warnings(plan: PlanView) -> list[Content]:
    n = len(plan.origin.warnings)
    if not n:
        return []
    return [Content.styled(f"{n} warning{'s' if n > 1 else ''} of the plan: f", "bold $warning")]


def _list_contours(walk: SliceWalk) -> list[Content]:
    """The bones in their colours."""
    seen = walk.plan.find_contours(walk.direction, walk.index)
    lines = [Content(""), Content.styled("contours here", "$text-muted")]
    lines += [
        Content.styled(f"  {name}", _style(BONE_COLOURS.get(name, OTHER_COLOUR))) for name in seen
    ]
    return lines if seen else [*lines, Content("  none")]


def _list_points(walk: SliceWalk) -> list[Content]:
    """The landmarks and targets in the colours of their crosses."""
    seen = walk.plan.find_points(walk.direction, walk.index)
    lines = [Content(""), Content.styled("landmarks, targets here", "$text-muted")]
    lines += [
        Content.styled(f"  {k + 1} {name}", _style(choose_point_colour(k)))
        for k, name in enumerate(seen)
    ]
    return lines if seen else [*lines, Content("  none; n: the next one")]


def _style(colour: Colour) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour)


class PlanFacts(Lines[PlanView]):
    """Warnings, bones and origin of a plan."""

    def build(self, view: PlanView, width: int, height: int) -> list[Content]:
        """All of it."""
        return _tell_facts(view, width)

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        """As many lines as there are."""
        return 1 if self._view is None else len(_tell_facts(self._view, max(width, 1)))


def _tell_facts(plan: PlanView, width: int) -> list[Content]:
    lines = [_head(f"plan {plan.plan.name}".rstrip())]
    lines += _make_rows(make_origin_rows(plan), width)
    lines += [Content(line) for line in textwrap.wrap(plan.slices_words, width)]
    lines += [Content(""), _head("warnings" if plan.origin.warnings else "no warnings")]
    for warning in plan.origin.warnings:
        said = textwrap.wrap(warning, width, initial_indent="- ", subsequent_indent="  ")
        lines += [Content.styled(line, "$warning") for line in said]
    for name, bone in plan.plan.bones.items():
        lines += [Content(""), _head(name), *_make_rows(make_bone_rows(bone, plan.origin), width)]
    return lines


def _head(text: str) -> Content:
    return Content.styled(text, "bold $foreground")


def _make_rows(rows: list[tuple[str, str]], width: int) -> list[Content]:
    lines = []
    for name, value in rows:
        said = textwrap.wrap(value, max(width - _NAME_WIDTH, 12)) or [""]
        lines.append(Content.assemble((f"{name:<{_NAME_WIDTH}}", "$text-muted"), said[0]))
        lines += [Content(" " * _NAME_WIDTH + line) for line in said[1:]]
    return lines
