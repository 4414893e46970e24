"""A face by the thicknesses that a caliper reads below it."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.errors import UsageError
from navapp.resection import find_face, list_caliper_points
from navapp.values import MeasuredFace, ResectionPlane, Side
from tests.resection.cuts import PLANNED, bone

# Of a ball of 30 mm, cut 12 mm over its middle.
RIM_MM = np.sqrt(30.0**2 - 12.0**2)


def made_plane(tilts: tuple[float, float], offset_mm: float) -> MeasuredFace:
    return MeasuredFace(PLANNED, np.array([*tilts, offset_mm]), np.eye(3), 1.0)


def read(made: MeasuredFace) -> np.ndarray:
    """What a perfect caliper reads below that face."""
    points = list_caliper_points(bone(), PLANNED)
    on_plan_mm = PLANNED.point_mm + np.array([one.place_mm for one in points]) @ PLANNED.axes
    up_mm = (made.point_mm - on_plan_mm) @ made.normal / (PLANNED.normal @ made.normal)
    return np.array([one.thickness_mm for one in points]) + up_mm


def test_the_points_lie_half_way_to_the_rim_over_the_opposite_surface() -> None:
    points = list_caliper_points(bone(), PLANNED)
    away_mm = np.array([one.place_mm for one in points])
    np.testing.assert_allclose(np.linalg.norm(away_mm, axis=1), 0.5 * RIM_MM, rtol=0.02)
    for one, place_mm in zip(points, away_mm, strict=True):
        below_mm = np.sqrt(30.0**2 - place_mm @ place_mm)
        assert one.thickness_mm == pytest.approx(12.0 + below_mm, abs=0.1)
        # The surface there leans by the arc tangent of this: jaws 1 mm off read as much off.
        slope = np.linalg.norm(place_mm) / below_mm
        assert one.sigma_mm == pytest.approx(np.hypot(0.15, slope), rel=0.2)


@pytest.mark.parametrize(
    ("side", "names"),
    [
        ("right", ("medial", "lateral")),
        ("left", ("medial", "lateral")),
        (None, ("left", "right")),
    ],
)
def test_the_points_have_an_anatomists_names(side: Side | None, names: tuple[str, str]) -> None:
    back = ResectionPlane("patella", np.zeros(3), np.array([0.0, 1.0, 0.0]))
    whole = replace(bone(), side=side)
    told = list_caliper_points(whole, back)
    assert [one.name for one in told] == [*names, "distal", "proximal"]
    # The plan's x points to the patient's left, z upwards.
    way = {one.name: one.place_mm @ back.axes for one in told}
    assert way[names[0]][0] * (-1.0 if side == "left" else 1.0) > 5.0
    assert way["proximal"][2] > 5.0
    up = list_caliper_points(whole, PLANNED)
    assert [one.name for one in up] == [*names, "anterior", "posterior"]


@pytest.mark.parametrize("tilts", [(0.0, 0.0), (0.03, -0.02), (-0.05, 0.04)])
@pytest.mark.parametrize("offset_mm", [0.0, -1.3, 0.8])
def test_exact_readings_tell_the_face_that_was_made(
    tilts: tuple[float, float], offset_mm: float
) -> None:
    made = made_plane(tilts, offset_mm)
    found = find_face(bone(), PLANNED, read(made))
    np.testing.assert_allclose(found.tilts_offset, made.tilts_offset, atol=1e-9)
    assert found.plane is PLANNED


def test_the_covariance_is_that_of_readings_with_their_deviations() -> None:
    rng, made = np.random.default_rng(3), made_plane((0.02, 0.01), 0.5)
    sigma_mm = np.array([one.sigma_mm for one in list_caliper_points(bone(), PLANNED)])
    exact = read(made)
    found = []
    while len(found) < 400:
        try:
            found.append(find_face(bone(), PLANNED, exact + sigma_mm * rng.standard_normal(4)))
        except UsageError:  # one reading in thousands
            continue
    off = np.array([one.tilts_offset for one in found]) - made.tilts_offset
    shown = off.T @ off / len(off)
    scale = np.sqrt(np.diag(found[0].covariance))
    np.testing.assert_allclose(shown / np.outer(scale, scale),
                               found[0].covariance / np.outer(scale, scale), atol=0.2)  # fmt: skip


def test_readings_that_lie_on_no_plane_are_refused() -> None:
    reading = read(made_plane((0.0, 0.0), 0.0))
    with pytest.raises(UsageError, match="lie on no plane"):
        find_face(bone(), PLANNED, reading + np.array([3.0, 3.0, -3.0, -3.0]))


@pytest.mark.parametrize("point", range(4))
@pytest.mark.parametrize(("off_sigmas", "is_taken"), [(-7.0, False), (2.0, True), (7.0, False)])
def test_one_reading_that_is_far_off_is_noticed(point, off_sigmas, is_taken) -> None:
    reading = read(made_plane((0.0, 0.0), 0.0))
    reading[point] += off_sigmas * list_caliper_points(bone(), PLANNED)[point].sigma_mm
    if is_taken:
        find_face(bone(), PLANNED, reading)
    else:
        with pytest.raises(UsageError, match="lie on no plane"):
            find_face(bone(), PLANNED, reading)


@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0, -13.0])
def test_what_is_no_length_is_refused(value: float) -> None:
    with pytest.raises(UsageError, match="is no length"):
        find_face(bone(), PLANNED, (40.0, 40.0, value, 40.0))


@pytest.mark.parametrize(
    ("tilts", "offset_mm"), [((0.0, 0.0), 4.5), ((0.0, 0.0), -4.5), ((0.12, 0.0), 0.0)]
)
def test_a_face_that_no_saw_leaves_is_refused(tilts: tuple[float, float], offset_mm: float) -> None:
    with pytest.raises(UsageError, match="too far from the plan"):
        find_face(bone(), PLANNED, read(made_plane(tilts, offset_mm)))


def test_a_cut_whose_points_would_share_a_name_is_refused() -> None:
    leaning = ResectionPlane("patella", np.zeros(3), np.array([0.0, 0.77, 0.64]))
    turned = ResectionPlane("patella", np.zeros(3), np.array([0.85, 0.37, 0.37]))
    assert len(list_caliper_points(bone(), leaning)) == 4
    with pytest.raises(UsageError, match="leans too much"):
        list_caliper_points(bone(), turned)


def test_each_point_needs_its_reading() -> None:
    with pytest.raises(UsageError, match="3 thicknesses") as told:
        find_face(bone(), PLANNED, (40.0, 40.0, 40.0))
    assert "give 4" in told.value.remedy


def test_a_plan_that_misses_the_bone_is_told() -> None:
    beside = replace(PLANNED, point_mm=np.array([0.0, 0.0, 50.0]))
    with pytest.raises(UsageError, match="does not meet"):
        list_caliper_points(bone(), beside)
