"""Model against measurement, pixel by pixel."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry import Box
from navapp.geometry.zbuffer import RenderedView, render_rectified
from navapp.registration import RegistrationModel
from navapp.tracking.agreement import Agreement, compare
from navapp.values import DisparityMap, Origin
from tests.registration.shapes import GEOMETRY, TRUE, femur
from tests.tracking.rooms import measured_map

BONE = femur()
MODEL = RegistrationModel(BONE)
MAP = measured_map(BONE)
HEIGHT, WIDTH = MAP.disparity_px.shape
BOX = Box(MAP.x, MAP.y, WIDTH, HEIGHT)
VIEW = render_rectified(MODEL.drawn_mesh, TRUE, GEOMETRY, BOX)
EXPECTED_PX = GEOMETRY.disparity_map_px(VIEW.depth_mm)
SEEN = VIEW.mask


def silent_in(part: np.ndarray) -> DisparityMap:
    """The map, nothing measured in a part."""
    return MAP.only(~part)


def half() -> np.ndarray:
    """The upper half of the model's pixels."""
    rows = np.nonzero(SEEN)[0]
    below = np.arange(HEIGHT)[:, None] >= np.median(rows)
    return SEEN & ~below


def agreement(measured: DisparityMap, coarse_px: np.ndarray | None = None) -> Agreement:
    return compare(VIEW, MODEL, measured, GEOMETRY, coarse_px)


def coarse(change_mm: float, part: np.ndarray) -> np.ndarray:
    """A rough map of the bone, nearer (negative) or further by a length in a part."""
    depth_mm = np.where(part, VIEW.depth_mm + change_mm, VIEW.depth_mm)
    return GEOMETRY.disparity_map_px(depth_mm)


def test_the_truth_agrees_everywhere() -> None:
    found = agreement(MAP)
    assert found.coverage > 0.9
    assert found.open_coverage == found.coverage
    assert found.hidden_share == found.behind_share == 0.0
    assert 0.3 < found.spread_ratio < 1.1


def test_what_something_nearer_hides_is_not_held_against_a_pose() -> None:
    part = half()
    without, aware = agreement(silent_in(part)), agreement(silent_in(part), coarse(-20.0, part))
    assert without.hidden_share == 0.0
    assert without.open_coverage == without.coverage == aware.coverage
    assert aware.hidden_share == pytest.approx(part.sum() / SEEN.sum(), abs=0.02)
    assert aware.open_coverage > 0.9
    assert aware.behind_share == 0.0


def test_what_is_seen_through_the_model_is_told() -> None:
    part = half()
    found = agreement(silent_in(part), coarse(20.0, part))
    assert found.hidden_share == 0.0
    # Its rim does not count: depth is blurred there.
    assert 0.35 < found.behind_share < part.sum() / SEEN.sum()
    assert found.open_coverage == found.coverage


@pytest.mark.parametrize("change_mm", [-1.0, 1.0])
def test_a_rough_map_says_nothing_about_a_millimetre(change_mm: float) -> None:
    part = half()
    found = agreement(silent_in(part), coarse(change_mm, part))
    assert found.hidden_share == found.behind_share == 0.0


def test_what_was_measured_outweighs_a_rough_map() -> None:
    found = agreement(MAP, coarse(-20.0, SEEN))
    assert found.hidden_share < 0.1
    assert found.coverage > 0.9


def test_specks_are_neither_occluder_nor_gap() -> None:
    part = np.zeros_like(SEEN)
    rows, columns = np.nonzero(SEEN)
    for k in range(0, len(rows), 400):
        part[rows[k], columns[k]] = True
    for change_mm in (-20.0, 20.0):
        found = agreement(silent_in(part), coarse(change_mm, part))
        assert found.hidden_share == found.behind_share == 0.0


def test_a_measured_surface_behind_the_model_is_seen_through_it() -> None:
    further = replace(MAP, disparity_px=MAP.disparity_px - np.float32(12.0))
    found = agreement(further)
    assert found.behind_share > 0.7
    assert found.coverage < 0.05


def test_wider_differences_than_claimed_show_in_the_spread() -> None:
    rng = np.random.default_rng(5)
    noisy = MAP.disparity_px + rng.normal(0.0, 0.5, (HEIGHT, WIDTH)).astype(np.float32)
    assert agreement(replace(MAP, disparity_px=noisy)).spread_ratio > 1.5


def test_a_view_without_the_model_agrees_with_nothing() -> None:
    empty = RenderedView(
        np.full((HEIGHT, WIDTH), np.nan, np.float32), np.full((HEIGHT, WIDTH), -1, np.int32), BOX
    )
    found = compare(empty, MODEL, MAP, GEOMETRY)
    assert found.n_visible == 0
    assert found.coverage == 0.0
    nothing = replace(MAP, origin=np.full_like(MAP.origin, Origin.UNKNOWN))
    assert agreement(nothing).spread_ratio == 0.0
