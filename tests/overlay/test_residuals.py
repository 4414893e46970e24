"""The candidate's residuals: a bone whose measured surface is moved by a known amount."""

import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.geometry.zbuffer import render_rectified
from navapp.overlay.residuals import draw_residuals, measure_residuals_mm
from navapp.values import DisparityMap, Foreground, Origin, Surroundings
from tests.registration.shapes import GEOMETRY, TRUE, femur


def seen(moved_mm: float, in_front_rows: int = 0) -> tuple[Foreground, np.ndarray]:
    """The femur at its pose, measured as if it lay further along the optical axis."""
    pixels = GEOMETRY.project(TRUE.apply(femur().mesh.vertices_mm))
    low, high = np.floor(pixels.min(axis=0)), np.ceil(pixels.max(axis=0))
    box = Box(*low.astype(int).tolist(), *(high - low).astype(int).tolist())
    view = render_rectified(femur().make_seen_surface(), TRUE, GEOMETRY, box)
    disparity_px = GEOMETRY.disparity_map_px(view.depth_mm + moved_mm)
    origin = np.where(view.mask, Origin.MATCHED, Origin.UNKNOWN).astype(np.uint8)
    measured = DisparityMap(disparity_px, disparity_px * 0, origin, box.x, box.y)
    picture = np.zeros(origin.shape, np.uint8)
    surroundings = Surroundings(disparity_px, origin, box, False, picture)
    is_in_front = np.zeros(origin.shape, np.bool_)
    is_in_front[:in_front_rows] = True
    return Foreground(surroundings, measured, is_in_front), view.mask


@pytest.mark.parametrize("moved_mm", [-0.4, 0.0, 0.4])
def test_a_surface_nearer_to_the_camera_lies_outside_of_the_bone(moved_mm: float) -> None:
    foreground, mask = seen(moved_mm)
    found = measure_residuals_mm(foreground, TRUE, femur().make_seen_surface(), GEOMETRY)
    np.testing.assert_array_equal(np.isfinite(found), mask)
    known = found[mask]
    # Along the normal: no more than along the ray, and most of it where the bone faces the camera.
    assert np.abs(known).max() <= abs(moved_mm) * 1.2 + 1e-3
    if moved_mm:
        assert np.sign(np.median(known)) == -np.sign(moved_mm)
    assert np.abs(np.percentile(known, 90 if moved_mm < 0 else 10)) >= 0.7 * abs(moved_mm)


def test_what_stands_in_front_is_no_residual() -> None:
    foreground, mask = seen(0.2, in_front_rows=30)
    found = measure_residuals_mm(foreground, TRUE, femur().make_seen_surface(), GEOMETRY)
    assert not np.isfinite(found[:30]).any()
    np.testing.assert_array_equal(np.isfinite(found[30:]), mask[30:])


def test_colours_tell_the_sign_and_unknown_pixels_show_the_picture() -> None:
    residual_mm = np.full((60, 90), np.nan, np.float32)
    residual_mm[10:20], residual_mm[20:30], residual_mm[30:40] = -1.0, 0.0, 5.0
    drawn = draw_residuals(residual_mm, np.full((60, 90), 100, np.uint8))
    factor = drawn.shape[0] // 60
    assert drawn.shape[1] > 90 * factor
    blue, green, red = drawn[15 * factor, 0].astype(int)
    assert blue > green > red
    assert (drawn[25 * factor, 0] == 240).all()
    blue, green, red = drawn[35 * factor, 0].astype(int)
    assert red > green > blue
    assert (drawn[50 * factor, 0] == 50).all()


@pytest.mark.parametrize("shape", [(1, 1), (40, 500), (47, 420), (30, 300)])
def test_a_bone_at_the_edge_of_the_picture_is_drawn_too(shape: tuple[int, int]) -> None:
    drawn = draw_residuals(np.zeros(shape, np.float32), np.zeros(shape, np.uint8))
    assert drawn.shape[0] >= shape[0]
    assert drawn.shape[1] > shape[1]
