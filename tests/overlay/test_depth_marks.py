"""What is known of the depth, in the operator's small picture."""

import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.geometry.rectification import Rectifier
from navapp.overlay import DepthMarks
from navapp.values import DEPTH_COLOURS, DisparityMap, Foreground, Origin, Surroundings
from sim_devices.rigs import make_default_rig

RIG = make_default_rig()
GREY = np.full((90, 160, 3), 140, np.uint8)
X, Y, WIDTH, HEIGHT = 480, 200, 320, 240


def foreground(origin: Origin, in_front: np.ndarray | None = None) -> Foreground:
    shape = (HEIGHT, WIDTH)
    disparity_px = np.full(shape, 200.0, np.float32)
    is_in_front = np.zeros(shape, dtype=np.bool_) if in_front is None else in_front
    box = Box(X, Y, WIDTH, HEIGHT)
    origins, picture = np.full(shape, origin, np.uint8), np.zeros(shape, np.uint8)
    surroundings = Surroundings(disparity_px, origins, box, False, picture)
    nothing = DisparityMap(*(np.empty((0, 0), np.float32),) * 2, np.empty((0, 0), np.uint8), 0, 0)
    return Foreground(surroundings, nothing, is_in_front)


def changed(preview: np.ndarray) -> np.ndarray:
    return (preview != GREY).any(axis=2)


@pytest.mark.parametrize("origin", list(Origin))
def test_every_class_has_a_colour_of_its_own(origin: Origin) -> None:
    marked = DepthMarks(RIG).draw(GREY, foreground(origin))
    inside = marked[changed(marked)]
    assert len(np.unique(inside, axis=0)) == 1
    towards = np.sign(inside[0].astype(int) - 140)
    np.testing.assert_array_equal(towards, np.sign(np.array(DEPTH_COLOURS[origin]) - 140))
    assert len(set(DEPTH_COLOURS.values())) == len(Origin)


def test_marks_lie_where_the_left_camera_sees_the_box() -> None:
    marked = changed(DepthMarks(RIG).draw(GREY, foreground(Origin.MATCHED)))
    geometry = Rectifier(RIG).geometry
    corners = np.array([[X, Y], [X + WIDTH - 1, Y + HEIGHT - 1]], dtype=float)
    rays = np.column_stack(
        [(corners - (geometry.centre_x_px, geometry.centre_y_px)) / geometry.focal_px, np.ones(2)]
    )
    expected = RIG.left.project(geometry.rectified_from_left.inverse().rotate(rays))
    rows, columns = np.nonzero(marked)
    found = [[columns.min(), rows.min()], [columns.max() + 1, rows.max() + 1]]
    np.testing.assert_allclose(8.0 * np.array(found), expected, atol=8.0)


def test_what_stands_in_front_is_nearly_covered() -> None:
    in_front = np.zeros((HEIGHT, WIDTH), dtype=np.bool_)
    in_front[: HEIGHT // 2] = True
    marked = DepthMarks(RIG).draw(GREY, foreground(Origin.FILLED_BORDER, in_front))
    off = np.abs(marked.astype(int) - DEPTH_COLOURS[Origin.FILLED_BORDER]).max(axis=2)
    rows, columns = np.nonzero(changed(marked))
    middle = round(columns.mean())
    assert off[rows.min() + 2, middle] < 0.4 * off[rows.max() - 2, middle]


def test_without_a_pose_the_picture_stays_as_it_is() -> None:
    assert DepthMarks(RIG).draw(GREY, None) is GREY
    assert (GREY == 140).all()
