import cv2
import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.preop.bone_preview import draw_preview
from tests.geometry.shapes import sphere

GROUND = 24


def pictures(mesh):
    content = draw_preview(mesh)
    assert content.startswith(b"\x89PNG\r\n")
    image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)
    assert image.shape == (360, 1080, 3)
    # Without the strip of the titles.
    return [part[40:] for part in np.hsplit(image, 3)]


def extent(picture):
    rows, columns = np.nonzero((picture != GROUND).any(axis=2))
    return np.ptp(columns), np.ptp(rows)


def test_three_views_show_a_shaded_body():
    for picture in pictures(sphere(40.0)):
        body = (picture != GROUND).any(axis=2)
        assert 0.15 < body.mean() < 0.8
        assert picture[body].std() > 10
        width, height = extent(picture)
        assert abs(width - height) <= 4


def test_each_view_looks_along_its_own_axis():
    """A body 20 wide (x), 60 deep (y) and 100 high (z)."""
    flat = TriangleMesh(sphere(1.0).vertices_mm * [10.0, 30.0, 50.0], sphere(1.0).faces)
    front, left, below = (extent(picture) for picture in pictures(flat))
    assert 4.5 < front[1] / front[0] < 5.5
    assert 1.5 < left[1] / left[0] < 1.8
    assert 2.7 < below[1] / below[0] < 3.3


def test_the_patients_left_is_seen_from_their_left():
    """A spot at the patient's left (+x) sticks out on the right of the front view."""
    body = sphere(30.0)
    spot = TriangleMesh(
        np.vstack([body.vertices_mm, sphere(6.0, 8, (40.0, 0.0, 20.0)).vertices_mm]),
        np.vstack([body.faces, sphere(6.0, 8).faces + len(body.vertices_mm)]),
    )
    front, _, _ = pictures(spot)
    columns = np.nonzero((front != GROUND).any(axis=2).any(axis=0))[0]
    # Upper half only: the spot sticks out to the right there.
    upper = np.nonzero((front[:120] != GROUND).any(axis=2).any(axis=0))[0]
    assert upper.max() == columns.max()
    assert upper.min() > columns.min()
