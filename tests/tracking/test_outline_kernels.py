"""Where one eye should see a model end, against plain numpy and against geometry."""

from functools import cache

import numpy as np
import pytest

from navapp.geometry.mesh_edges import ridge_edges
from navapp.geometry.zbuffer import render_rectified
from navapp.tracking.outline_kernels import (
    Eye,
    Rim,
    count_near,
    find_rim,
    is_outline,
    thin_rim,
)
from tests.geometry.shapes import sphere
from tests.reference import outline_reference as reference
from tests.registration.shapes import GEOMETRY, TRUE, femur
from tests.views import find_silhouette, project_box

LEFT = Eye(0.0, GEOMETRY.focal_px, GEOMETRY.centre_x_px, GEOMETRY.centre_y_px)
RIGHT = LEFT._replace(x_mm=GEOMETRY.baseline_mm)


@cache
def rim_of(eye: Eye) -> Rim:
    return find_rim(
        ridge_edges(femur().mesh), np.array(TRUE.rotation), np.array(TRUE.translation_mm), eye
    )


@cache
def left_view():
    box = project_box(femur().mesh, TRUE, GEOMETRY).grow(16)
    return render_rectified(femur().mesh, TRUE, GEOMETRY, box)


@pytest.mark.kernel
def test_the_rim_is_that_of_the_reference() -> None:
    ridges = ridge_edges(femur().mesh)
    for eye in (LEFT, RIGHT):
        rim = rim_of(eye)
        point, pixel, normal, length, found = reference.rim(*ridges, TRUE, eye)
        is_kept = length >= 1e-3
        np.testing.assert_allclose(rim.point, point[is_kept], atol=1e-9)
        np.testing.assert_allclose(rim.pixel, pixel[is_kept], atol=1e-9)
        np.testing.assert_allclose(rim.normal, normal[is_kept], atol=1e-9)
        np.testing.assert_allclose(rim.length, length[is_kept], atol=1e-9)
        np.testing.assert_array_equal(rim.vertex, ridges.edges[found[is_kept], 0])


def test_rays_to_the_rim_of_a_ball_touch_it() -> None:
    ball = sphere(20.0, 48)
    eye_mm = np.array([RIGHT.x_mm, 0.0, 0.0])
    rim = find_rim(ridge_edges(ball), np.eye(3), np.array([10.0, -5.0, 450.0]), RIGHT)
    ray = rim.point - eye_mm
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    arm = np.array([10.0, -5.0, 450.0]) - eye_mm
    distance = np.linalg.norm(arm - (ray @ arm)[:, None] * ray, axis=1)
    assert len(rim.point) > 60
    np.testing.assert_allclose(distance, 20.0, atol=0.12)
    outward = rim.pixel - rim.pixel.mean(axis=0)
    assert ((outward * rim.normal).sum(axis=1) > 0.0).all()


@pytest.mark.kernel
def test_what_is_seen_of_the_rim_is_that_of_the_reference() -> None:
    rim, view = rim_of(LEFT), left_view()
    found = is_outline(rim, view.depth_mm, view.box.x, view.box.y)
    expected = reference.is_outline(
        rim.pixel, rim.normal, rim.point[:, 2], view.depth_mm, view.box.x, view.box.y
    )
    np.testing.assert_array_equal(found, expected)
    assert 0.1 < found.mean() < 0.9


def test_the_seen_rim_runs_along_the_silhouette() -> None:
    rim, view = rim_of(LEFT), left_view()
    seen = rim.pixel[is_outline(rim, view.depth_mm, view.box.x, view.box.y)]
    rows, columns = np.nonzero(find_silhouette(view))
    border = np.column_stack([columns + view.box.x, rows + view.box.y])
    apart = np.linalg.norm(border[:, None] - seen[None], axis=2).min(axis=1)
    assert np.quantile(apart, 0.9) < 4.0


@pytest.mark.kernel
def test_thinned_points_are_outermost_with_the_normals_of_the_reference() -> None:
    view, rim = left_view(), rim_of(LEFT)
    rim = Rim(*(part[is_outline(rim, view.depth_mm, view.box.x, view.box.y)] for part in rim))
    thinned = thin_rim(rim)
    unit, is_outermost = reference.smoothed(rim.pixel, rim.normal, rim.length)
    index = [int(np.flatnonzero((rim.pixel == pixel).all(axis=1))[0]) for pixel in thinned.pixel]
    assert is_outermost[index].all()
    np.testing.assert_allclose(thinned.normal, unit[index], atol=1e-9)
    # Nothing of the outline is left without a point nearby.
    apart = np.linalg.norm(rim.pixel[is_outermost][:, None] - thinned.pixel[None], axis=2)
    assert len(thinned.pixel) < len(rim.pixel)
    assert apart.min(axis=1).max() < 4.3


def test_an_empty_rim_stays_empty() -> None:
    none = Rim(*(part[:0] for part in rim_of(LEFT)))
    assert len(thin_rim(none).pixel) == 0


@pytest.mark.kernel
def test_pixels_within_reach_are_counted_with_the_one_itself() -> None:
    pixel = np.random.default_rng(3).uniform(0.0, 40.0, (50, 2))
    apart = np.linalg.norm(pixel[:, None] - pixel[None], axis=2)
    np.testing.assert_array_equal(count_near(pixel, 5.5), (apart <= 5.5).sum(axis=1))
