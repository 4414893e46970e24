"""Slices of a volume with a surface's contour."""

import cv2
import numpy as np
import pytest

from navapp.preop.slices import cut_contour, draw_slices
from navapp.preop.volume import CtVolume
from tests.geometry.shapes import sphere

RADIUS_MM = 15.0


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("height_mm", [0.0, 7.3])
def test_a_ball_is_cut_in_a_circle(axis, height_mm) -> None:
    ball = sphere(RADIUS_MM, 60)
    ends = cut_contour(ball.vertices_mm, ball.faces, axis, height_mm)
    assert np.abs(ends[..., axis] - height_mm).max() < 1e-9
    radius = np.linalg.norm(np.delete(ends, axis, axis=2), axis=2)
    assert np.abs(radius - np.sqrt(RADIUS_MM**2 - height_mm**2)).max() < 0.1
    length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum()
    assert length == pytest.approx(2.0 * np.pi * np.sqrt(RADIUS_MM**2 - height_mm**2), rel=0.01)


def test_what_a_plane_does_not_cross_has_no_contour() -> None:
    ball = sphere(RADIUS_MM, 20)
    assert len(cut_contour(ball.vertices_mm, ball.faces, 2, 20.0)) == 0


@pytest.mark.parametrize("flips", [(1, 1, 1), (-1, 1, -1), (1, -1, -1)])
def test_the_contour_lies_on_the_rim_of_what_it_outlines(flips) -> None:
    spacing = np.array([0.8, 0.8, 1.2])
    n = np.array([60, 60, 40])
    matrix = np.eye(4)
    matrix[:3, :3] = np.diag(spacing * flips)
    matrix[:3, 3] = -0.5 * matrix[:3, :3] @ (n - 1)
    index = np.stack(np.meshgrid(*(np.arange(k) for k in n), indexing="ij"), axis=-1)
    radius = np.linalg.norm(index @ matrix[:3, :3].T + matrix[:3, 3], axis=-1)
    hu = (1400.0 * np.clip(0.5 + RADIUS_MM - radius, 0.0, 1.0) - 200.0).transpose(2, 1, 0)
    volume = CtVolume(hu.astype(np.int16), matrix, spacing)
    picture = draw_slices(volume, sphere(RADIUS_MM, 60)).astype(int)
    is_line = (picture.max(axis=2) - picture.min(axis=2)) > 60
    scale = picture.shape[0] / (2.0 * (RADIUS_MM + 12.0))
    white = (picture.min(axis=2) > 127).astype(np.uint8)
    around = np.ones((3, 3), np.uint8)
    rim = cv2.dilate(white, around) - cv2.erode(white, around)
    away_mm = cv2.distanceTransform(1 - rim, cv2.DIST_L2, 5)[is_line] / scale
    assert is_line.sum() > 1000
    assert away_mm.max() < 0.6
