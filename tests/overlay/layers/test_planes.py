"""Planned cuts."""

import numpy as np

from navapp.geometry.transform import RigidTransform
from navapp.overlay.colours import PLANE
from navapp.overlay.strokes import sample_line
from navapp.values import ResectionPlane, SurgicalContent
from tests.geometry.shapes import sphere
from tests.overlay.scenes import CAMERA, draw, is_colour, scene, seen, words

BEFORE = RigidTransform.from_parts("left", "femur", np.eye(3), (0.0, 0.0, 400.0))
BALL = sphere(30.0, 40)
# Seen from the side, its rectangle edge-on but for perspective.
CUT = ResectionPlane("femur", np.array([0.0, 12.0, 0.0]), np.array([0.0, 1.0, 0.0]), (70.0, 70.0))
GIVEN = seen(
    scene(mesh=BALL, pose=BEFORE, content=SurgicalContent(planes={"femur_distal": CUT}))
)  # fmt: skip


def lit_at(points_mm: np.ndarray) -> np.ndarray:
    # The frame is one pixel wide: on the grid it has less than its colour.
    lit = draw("planes", GIVEN)[..., 0] > 0.4 * PLANE[0]
    u, v = np.round(CAMERA.project(BEFORE.apply(points_mm))).astype(int).T
    return np.array([lit[y - 1 : y + 2, x - 1 : x + 2].any() for x, y in zip(u, v, strict=True)])


def circle(low_deg: float, high_deg: float) -> np.ndarray:
    """Of the cut's line on the ball; the camera is at -90 deg."""
    angles = np.radians(np.linspace(low_deg, high_deg, 60))
    radius = np.sqrt(30.0**2 - 12.0**2)
    return np.column_stack([radius * np.cos(angles), np.full(60, 12.0), radius * np.sin(angles)])


def test_the_cut_line_is_whole_in_front_and_dashed_behind() -> None:
    assert lit_at(circle(-160.0, -20.0)).mean() > 0.97
    # Perspective lifts the far half of the line off the near one.
    behind = circle(30.0, 150.0)
    lit = is_colour(draw("planes", GIVEN), PLANE)
    u, v = np.round(CAMERA.project(BEFORE.apply(behind))).astype(int).T
    assert 0.4 < lit[v, u].mean() < 0.9


def test_the_frame_of_the_plane_is_drawn() -> None:
    corners = CUT.corners_mm()
    for k in range(4):
        side = sample_line(np.stack([corners[k], corners[(k + 1) % 4]]), 2.0)
        assert lit_at(side).mean() > 0.5


def test_a_cut_is_named_without_its_bone() -> None:
    assert words("planes", GIVEN) == ["distal cut"]
