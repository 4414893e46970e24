"""Planned holes."""

import numpy as np

from navapp.overlay.colours import DRILL
from navapp.values import DrillAxis, SurgicalContent
from tests.overlay.scenes import CAMERA, POSE, draw, scene, seen, words

# Into the bowl at its lowest point, leaning.
ENTRY = np.array([0.0, 0.0, 0.0])
DIRECTION = np.array([0.8, 0.0, 0.6])
DRILL_AXIS = DrillAxis("femur", ENTRY, DIRECTION, 40.0, 24.0)
GIVEN = seen(scene(content=SurgicalContent(drills={"femoral_guide": DRILL_AXIS})))


def lit_at(points_mm: np.ndarray) -> np.ndarray:
    image = draw("drills", GIVEN)
    u, v = np.round(CAMERA.project(POSE.apply(points_mm))).astype(int).T
    # The axis is one pixel wide: on the grid it has less than its colour.
    lit = image[..., 2] > 0.4 * DRILL[2]
    return np.array([lit[y - 1 : y + 2, x - 1 : x + 2].any() for x, y in zip(u, v, strict=True)])


def rim(centre: np.ndarray) -> np.ndarray:
    across = np.array([0.6, 0.0, -0.8])
    angles = np.linspace(0.0, 2.0 * np.pi, 60)[:, None]
    return centre + 12.0 * (np.cos(angles) * across + np.sin(angles) * np.array([0.0, 1.0, 0.0]))


def test_the_entry_has_a_cross_and_a_rim_as_wide_as_the_hole() -> None:
    assert lit_at(ENTRY[None]).all()
    found = lit_at(rim(ENTRY))
    # Where it leans into the bone it is dashed.
    assert found.mean() > 0.7
    # Between the arms of the cross.
    assert not lit_at(0.5 * rim(ENTRY))[7::15].any()


def test_the_axis_is_whole_before_the_bone_and_dashed_to_its_depth() -> None:
    outside = ENTRY - np.linspace(12.0, 29.0, 40)[:, None] * DIRECTION
    inside = ENTRY + np.linspace(12.0, 38.0, 80)[:, None] * DIRECTION
    assert lit_at(outside).mean() > 0.95
    assert 0.4 < lit_at(inside).mean() < 0.95
    assert not lit_at(ENTRY + np.array([[44.0], [49.0]]) * DIRECTION).any()


def test_its_end_has_a_rim() -> None:
    assert 0.4 < lit_at(rim(ENTRY + 40.0 * DIRECTION)).mean() < 1.0


def test_depth_and_width_are_written() -> None:
    assert words("drills", GIVEN) == ["femoral guide: 40 mm deep, 24 mm wide"]
