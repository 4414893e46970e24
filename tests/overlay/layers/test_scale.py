"""The scale bar."""

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform
from navapp.overlay.colours import SCALE
from tests.overlay.scenes import CAMERA, HEIGHT, WIDTH, draw, is_colour, panel_boxes, scene


@pytest.mark.parametrize(("z_mm", "length_mm"), [(180.0, 20.0), (400.0, 50.0), (900.0, 50.0)])
def test_the_bar_is_as_long_as_that_length_at_the_bone(z_mm: float, length_mm: float) -> None:
    pose = RigidTransform.from_parts("left", "femur", np.eye(3), (0.0, 0.0, z_mm))
    given = scene(pose=pose)
    image = draw("scale", given)
    row = image[HEIGHT - 52]
    lit = np.flatnonzero(is_colour(row[None], SCALE)[0])
    middle = given.to_camera(given.mesh.centroid_mm[None])
    along = np.array([0.5 * length_mm, 0.0, 0.0])
    # At the middle of the picture, where the lens does not bend it.
    centred = middle * (0.0, 0.0, 1.0)
    ends = CAMERA.project(np.vstack([centred - along, centred + along]))
    expected = np.linalg.norm(ends[1] - ends[0])
    # The line is two pixels wide.
    assert lit[-1] - lit[0] + 1 == pytest.approx(expected + 2.0, abs=2.0)
    (taken,) = panel_boxes("scale", given)
    assert taken.clip(WIDTH, HEIGHT) == taken
    outside = image.copy()
    outside[taken.slices] = 0
    assert not outside.any()


def test_a_length_is_chosen_that_can_be_read() -> None:
    for z_mm in (80.0, 150.0, 300.0, 450.0):
        pose = RigidTransform.from_parts("left", "femur", np.eye(3), (0.0, 0.0, z_mm))
        image = draw("scale", scene(pose=pose))
        lit = np.flatnonzero(is_colour(image[HEIGHT - 52][None], SCALE)[0])
        assert 65 < lit[-1] - lit[0] < 180
