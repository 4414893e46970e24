"""Angles and gaps in the pose panel: by words, with bounds, and only while they are current."""

import pytest

from navapp.control.states import LimbLine, OtherBone
from navapp.limb import Gap, LimbAngles, LimbMeasurement
from navapp.ui.pose_panel import PosePanel
from navapp.ui.symbols import ASCII, UNICODE
from navapp.values import Status, Verdict
from tests.ui import snapshots
from tests.ui.test_panels import POSE_LINES, WIDTH, lines_of, view_of

TIBIA = OtherBone("tibia", Verdict(Status.OK, 0.31), 33.0)
GAPS = {"medial": Gap(1.24, 0.14), "lateral": Gap(12.51, 0.21)}
MEASURED = LimbMeasurement(LimbAngles(84.04, -1.26, 3.5, 0.32, 0.21, 0.44), GAPS)


def panel(limb: LimbLine, symbols=UNICODE, **words) -> list[str]:
    view = view_of(snapshots.navigating(others=(TIBIA,), limb=limb), symbols, **words)
    return lines_of(PosePanel(), view, WIDTH, POSE_LINES)


def test_a_current_limb_is_told_with_its_bounds() -> None:
    lines = panel(LimbLine(MEASURED, 40.0))
    assert lines[2:6] == [
        "flexion   84.0 deg \u22640.3",
        "valgus     1.3 deg \u22640.2",
        "int. rot.  3.5 deg \u22640.4",
        "gap m/l 1.2/12.5 mm \u22640.2",
    ]
    assert lines[-3].startswith("tibia")
    assert len(lines) == POSE_LINES


@pytest.mark.parametrize("limb", [LimbLine(), LimbLine(MEASURED, 501.0)])
def test_an_old_limb_is_not_known(limb: LimbLine) -> None:
    text = " ".join(panel(limb))
    assert "limb not known: femur and tibia are not OK in one picture" in text
    assert "84.0" not in text


def test_nothing_is_known_in_a_silent_session() -> None:
    assert "84.0" not in " ".join(panel(LimbLine(MEASURED, 40.0), is_silent=True))


def test_what_the_plan_lacks_is_said_and_the_gaps_stay() -> None:
    limb = LimbLine(LimbMeasurement(None, GAPS, "no hip centre in the plan"), 40.0)
    text = " ".join(panel(limb))
    assert "angles not known: no hip centre in the plan" in text
    assert "1.2/12.5" in text


def test_every_line_fits_the_small_panel() -> None:
    wide = LimbAngles(-129.94, 29.94, -44.94, 29.94, 19.94, 19.94)
    gaps = {"medial": Gap(39.94, 1.94), "lateral": Gap(39.94, 1.94)}
    for symbols in (UNICODE, ASCII):
        lines = panel(LimbLine(LimbMeasurement(wide, gaps), 0.0), symbols)
        assert all(len(line) <= WIDTH for line in lines)
        assert all(line.isascii() for line in lines) or symbols is UNICODE
