"""Model against measurement, pixel by pixel."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.zbuffer import RenderedView, render_rectified
from navapp.registration import RegistrationModel
from navapp.registration.verdict import Agreement
from navapp.tracking.agreement import compare
from navapp.tracking.agreement_kernels import (
    COARSELY_FURTHER,
    COARSELY_NEARER,
    FURTHER,
    NEARER,
    classify_pixels,
)
from navapp.values import DisparityMap, Origin
from tests.reference.agreement_reference import classify_slowly
from tests.registration.shapes import GEOMETRY, TRUE, femur
from tests.tracking.rooms import measured_map

BONE = femur()
MODEL = RegistrationModel(BONE)
MAP = measured_map(BONE)
HEIGHT, WIDTH = MAP.disparity_px.shape
VIEW = render_rectified(MODEL.rendered_mesh, TRUE, GEOMETRY, MAP.box)
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
    """A coarse map of the bone, nearer (negative) or further by a length in a part."""
    depth_mm = np.where(part, VIEW.depth_mm + change_mm, VIEW.depth_mm)
    return GEOMETRY.disparity_map_px(depth_mm)


def test_the_truth_agrees_everywhere() -> None:
    found = agreement(MAP)
    assert found.coverage > 0.9
    assert found.open_coverage == found.coverage
    assert found.hidden_fraction == found.behind_fraction == 0.0
    assert 0.3 < found.spread_ratio < 1.1


def test_what_something_nearer_hides_is_not_held_against_a_pose() -> None:
    part = half()
    without, aware = agreement(silent_in(part)), agreement(silent_in(part), coarse(-20.0, part))
    assert without.hidden_fraction == 0.0
    assert without.open_coverage == without.coverage == aware.coverage
    assert aware.hidden_fraction == pytest.approx(part.sum() / SEEN.sum(), abs=0.02)
    assert aware.open_coverage > 0.9
    assert aware.behind_fraction == 0.0


def test_a_bone_lies_open_while_more_of_it_is_seen_than_hidden() -> None:
    columns = np.arange(SEEN.shape[1])
    for share, lies_open in ((0.35, True), (0.65, False)):
        part = SEEN & (columns < np.quantile(np.nonzero(SEEN)[1], share))
        assert agreement(silent_in(part), coarse(-20.0, part)).lies_open is lies_open


def test_what_is_seen_through_the_model_is_told() -> None:
    part = half()
    found = agreement(silent_in(part), coarse(20.0, part))
    assert found.hidden_fraction == 0.0
    # Its rim does not count: depth is blurred there.
    assert 0.35 < found.behind_fraction < part.sum() / SEEN.sum()
    assert found.open_coverage == found.coverage


def highlight() -> np.ndarray:
    """A square of the model's pixels, off its rim: a thirtieth of them."""
    rows, columns = np.nonzero(SEEN)
    side, y, x = int((SEEN.sum() / 30) ** 0.5), int(np.median(rows)), int(np.median(columns))
    part = np.zeros_like(SEEN)
    part[y : y + side, x : x + side] = True
    assert (SEEN | ~part).all()
    return part


def test_a_reflected_lamp_is_not_seen_through_the_model() -> None:
    part = highlight()
    silent, further, nearer = silent_in(part), coarse(20.0, part), coarse(-20.0, part)
    assert agreement(silent, further).behind_fraction > 0.03
    assert compare(VIEW, MODEL, silent, GEOMETRY, further, part).behind_fraction == 0.0
    # Beside clipped pixels it counts.
    elsewhere = compare(VIEW, MODEL, silent, GEOMETRY, further, ~part)
    assert elsewhere == agreement(silent, further)
    # What stands before the bone hides it, clipped or not.
    assert compare(VIEW, MODEL, silent, GEOMETRY, nearer, part) == agreement(silent, nearer)
    # Where the surface itself was measured, it is known.
    measured = replace(MAP, disparity_px=MAP.disparity_px - np.float32(12.0))
    assert compare(VIEW, MODEL, measured, GEOMETRY, further, part) == agreement(measured, further)


def test_reflected_lamps_explain_a_twentieth_of_the_model_and_no_more() -> None:
    part = half()
    silent, further = silent_in(part), coarse(20.0, part)
    without = agreement(silent, further).behind_fraction
    found = compare(VIEW, MODEL, silent, GEOMETRY, further, part).behind_fraction
    assert found == pytest.approx(without - 0.05, abs=1e-3)


@pytest.mark.parametrize("change_mm", [-1.0, 1.0])
def test_a_coarse_map_says_nothing_about_a_millimetre(change_mm: float) -> None:
    part = half()
    found = agreement(silent_in(part), coarse(change_mm, part))
    assert found.hidden_fraction == found.behind_fraction == 0.0


def test_what_was_measured_outweighs_a_coarse_map() -> None:
    found = agreement(MAP, coarse(-20.0, SEEN))
    assert found.hidden_fraction < 0.1
    assert found.coverage > 0.9


def test_what_is_hidden_is_neither_an_outlier_nor_spread() -> None:
    part = half()
    nearer_px = np.where(part, MAP.disparity_px + np.float32(12.0), MAP.disparity_px)
    found = agreement(replace(MAP, disparity_px=nearer_px))
    assert found.hidden_fraction == pytest.approx(part.sum() / SEEN.sum(), abs=0.1)
    assert found.inlier_fraction > 0.95
    assert found.spread_ratio < 1.1


def test_specks_are_neither_occluder_nor_gap() -> None:
    part = np.zeros_like(SEEN)
    rows, columns = np.nonzero(SEEN)
    for k in range(0, len(rows), 400):
        part[rows[k], columns[k]] = True
    for change_mm in (-20.0, 20.0):
        found = agreement(silent_in(part), coarse(change_mm, part))
        assert found.hidden_fraction == found.behind_fraction == 0.0


def test_a_measured_surface_behind_the_model_is_seen_through_it() -> None:
    further = replace(MAP, disparity_px=MAP.disparity_px - np.float32(12.0))
    found = agreement(further)
    assert found.behind_fraction > 0.7
    assert found.coverage < 0.05


def test_wider_differences_than_claimed_show_in_the_spread() -> None:
    rng = np.random.default_rng(5)
    noisy = MAP.disparity_px + rng.normal(0.0, 0.5, (HEIGHT, WIDTH)).astype(np.float32)
    assert agreement(replace(MAP, disparity_px=noisy)).spread_ratio > 1.5


def test_a_few_open_pixels_tell_their_spread_wherever_they_lie() -> None:
    rng = np.random.default_rng(7)
    noisy = MAP.disparity_px + 6.0 * MAP.sigma_px * rng.standard_normal(MAP.sigma_px.shape)
    rows, columns = np.indices(MAP.origin.shape)
    between = (rows % 4 == 1) & (columns % 4 == 1)
    found = replace(MAP, disparity_px=noisy.astype(np.float32)).only(between)
    assert agreement(found).spread_ratio > 1.5


def test_a_view_without_the_model_agrees_with_nothing() -> None:
    empty = RenderedView(
        np.full((HEIGHT, WIDTH), np.nan, np.float32),
        np.full((HEIGHT, WIDTH), -1, np.int32),
        MAP.box,
    )
    found = compare(empty, MODEL, MAP, GEOMETRY)
    assert found.n_visible == 0
    assert found.coverage == 0.0
    nothing = replace(MAP, origin=np.full_like(MAP.origin, Origin.UNKNOWN))
    assert agreement(nothing).spread_ratio == 0.0


@pytest.mark.kernel
@pytest.mark.parametrize("with_coarse", [True, False])
def test_the_compiled_comparison_is_the_equations(with_coarse: bool) -> None:
    rng = np.random.default_rng(4)
    shape = EXPECTED_PX.shape
    noisy = replace(
        MAP,
        disparity_px=(MAP.disparity_px + rng.normal(0.0, 0.8, shape)).astype(np.float32),
        sigma_px=rng.uniform(0.05, 0.5, shape).astype(np.float32),
        origin=np.where(rng.random(shape) < 0.7, MAP.origin, 0).astype(np.uint8),
    )
    coarse_px = np.full(shape, np.nan, dtype=np.float32)
    if with_coarse:
        coarse_px = (EXPECTED_PX + rng.normal(0.0, 3.0, shape)).astype(np.float32)
        coarse_px[rng.random(shape) < 0.2] = np.nan
    scale_px_mm = GEOMETRY.focal_px * GEOMETRY.baseline_mm
    face_sigma_mm = rng.uniform(0.05, 0.6, len(MODEL.rendered_mesh.faces))
    classes, deviation, sigma, n_visible, n_agreeing = classify_pixels(
        VIEW.depth_mm, VIEW.face_index, face_sigma_mm, noisy.disparity_px, noisy.sigma_px,
        noisy.origin == Origin.MATCHED, coarse_px, scale_px_mm,
    )  # fmt: skip
    masks, expected, expected_sigma, clearance_px = classify_slowly(
        VIEW, face_sigma_mm, noisy, coarse_px, scale_px_mm
    )
    # Single precision may decide the others either way.
    is_clear = clearance_px > 1e-4
    assert is_clear[SEEN].mean() > 0.999
    assert n_visible == SEEN.sum()
    assert abs(n_agreeing - masks["agrees"].sum()) <= (~is_clear).sum()
    assert n_agreeing > 0
    bits = {
        "nearer": NEARER,
        "further": FURTHER,
        "coarsely nearer": COARSELY_NEARER,
        "coarsely further": COARSELY_FURTHER,
    }
    for name, bit in bits.items():
        found, mask = classes == bit, masks[name]
        np.testing.assert_array_equal(found[is_clear], mask[is_clear], err_msg=name)
        assert mask.any() == (with_coarse or "coarse" not in name), name
    measured = masks["measured"]
    np.testing.assert_allclose(deviation[measured], expected[measured], atol=1e-4)
    np.testing.assert_allclose(sigma[measured], expected_sigma[measured], rtol=1e-5)
