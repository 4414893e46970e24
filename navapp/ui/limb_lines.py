"""Angles and gaps of the limb for the pose panel, with bounds, or why they are not known."""

import textwrap

from textual.content import Content

from navapp.control.interlocks import is_limb_current
from navapp.limb import LimbMeasurement
from navapp.ui.view import View

_SIDES = ("medial", "lateral")
_NOT_BOTH = "femur and tibia are not OK in one picture"


def format_limb_lines(view: View, width: int) -> list[Content]:
    """A line each; none while femur and tibia are not both followed."""
    limb = view.snapshot.limb
    if limb is None:
        return []
    if view.is_silent or limb.measurement is None or not is_limb_current(limb):
        return _say(f"limb not known: {_NOT_BOTH}", width)
    return [*_angles(view, limb.measurement, width), *_gaps(view, limb.measurement)]


def _angles(view: View, measured: LimbMeasurement, width: int) -> list[Content]:
    angles = measured.angles
    if angles is None:
        return _say(f"angles not known: {measured.missing}", width)
    # The word says to which side, never a sign.
    varus = "varus" if angles.varus_deg >= 0.0 else "valgus"
    rotation = "int. rot." if angles.internal_rotation_deg >= 0.0 else "ext. rot."
    flexion = "flexion" if angles.flexion_deg >= 0.0 else "hyperext."
    return [
        _figure(view, flexion, angles.flexion_deg, angles.flexion_bound_deg),
        _figure(view, varus, angles.varus_deg, angles.varus_bound_deg),
        _figure(view, rotation, angles.internal_rotation_deg, angles.internal_rotation_bound_deg),
    ]


def _gaps(view: View, measured: LimbMeasurement) -> list[Content]:
    """Both in one line, with the larger bound."""
    gaps = measured.gaps
    if not gaps:
        return []
    both = "/".join(f"{gaps[name].mm:.1f}" if name in gaps else "-" for name in _SIDES)
    bound_mm = max(gap.bound_mm for gap in gaps.values())
    return [
        Content.assemble(
            ("gap m/l", "$text-muted"),
            both.rjust(9),
            (f" mm {view.symbols.at_most}{bound_mm:.1f}", "$text-muted"),
        )
    ]


def _figure(view: View, name: str, value: float, bound: float) -> Content:
    return Content.assemble(
        (f"{name:<9}", "$text-muted"),
        f"{abs(value):5.1f}",
        (f" deg {view.symbols.at_most}{bound:.1f}", "$text-muted"),
    )


def _say(text: str, width: int) -> list[Content]:
    return [Content.styled(line, "$text-muted") for line in textwrap.wrap(text, max(width - 1, 1))]
