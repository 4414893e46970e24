import numpy as np
import pytest

from navapp.preop.segmentation.bone_naming import Part, name_parts, parts_of
from tests.preop.ct_phantoms import OBLIQUE, lattice, points_of

# Middles and half sizes, mm: a right leg, head up, the front at low y, its outside at low x.
FEMUR = ((0.0, 0.0, 40.0), (38.0, 30.0, 42.0))
TIBIA = ((2.0, 4.0, -45.0), (36.0, 25.0, 42.0))
PATELLA = ((-3.0, -38.0, 14.0), (21.0, 10.0, 20.0))
FIBULA = ((-28.0, 22.0, -55.0), (8.0, 8.0, 38.0))
FABELLA = ((14.0, 34.0, 10.0), (5.0, 4.0, 5.0))


def part(number, middle, half):
    middle, half = np.array(middle), np.array(half)
    return Part(number, 0.3 * 8.0 * half.prod(), middle, middle - half, middle + half)


def parts(*places):
    return [part(number, *place) for number, place in enumerate(places, start=1)]


def mirrored(place):
    (x, *rest), half = place
    return (-x, *rest), half


def moved(place, by):
    middle, half = place
    return tuple(np.array(middle) + by), half


@pytest.mark.parametrize("is_left", [False, True])
@pytest.mark.parametrize("order", [(0, 1, 2, 3, 4), (4, 3, 2, 1, 0), (1, 0, 3, 2, 4)])
def test_a_knee_is_named_whatever_the_order_of_its_parts(is_left, order):
    places = [FEMUR, TIBIA, PATELLA, FIBULA, FABELLA]
    if is_left:
        places = [mirrored(place) for place in places]
    named = name_parts(parts(*(places[n] for n in order)))
    found = {name: order[number - 1] for name, number in named.bones.items()}
    assert found == {"femur": 0, "tibia": 1, "patella": 2, "fibula": 3}
    assert named.is_whole
    assert not named.has_two_knees


def test_where_the_scanner_put_the_knee_is_no_matter():
    by = np.array([-180.0, 95.0, -870.0])
    named = name_parts(parts(*(moved(place, by) for place in (PATELLA, FIBULA, TIBIA, FEMUR))))
    assert named.bones == {"patella": 1, "fibula": 2, "tibia": 3, "femur": 4}


@pytest.mark.parametrize("missing", ["patella", "fibula"])
def test_a_bone_that_is_missing_is_not_named(missing):
    places = {"femur": FEMUR, "tibia": TIBIA, "patella": PATELLA, "fibula": FIBULA}
    del places[missing]
    named = name_parts([*parts(*places.values()), part(9, *FABELLA)])
    assert named.bones == {name: number for number, name in enumerate(places, start=1)}
    assert named.is_whole == (missing == "fibula")


def test_a_fibula_as_high_as_the_tibia_is_none():
    high = moved(FIBULA, [0.0, 0.0, 20.0])
    assert "fibula" not in name_parts(parts(FEMUR, TIBIA, high)).bones


def test_a_tibia_cut_short_is_smaller_than_the_femur_and_still_below():
    short = ((2.0, 4.0, -17.0), (36.0, 25.0, 14.0))
    assert name_parts(parts(short, FEMUR, PATELLA)).bones == {"tibia": 1, "femur": 2, "patella": 3}


@pytest.mark.parametrize(
    "places",
    [
        (),
        (FEMUR,),
        (FEMUR, PATELLA),
        (FEMUR, moved(FEMUR, [90.0, 0.0, 2.0])),
        (FEMUR, moved(TIBIA, [0.0, 0.0, -60.0])),
        (((0.0, 0.0, 11.0), (9.0, 9.0, 10.0)), ((0.0, 0.0, -11.0), (9.0, 9.0, 10.0))),
    ],
    ids=["nothing", "one bone", "no tibia", "side by side", "far apart", "too small"],
)
def test_what_is_no_knee_is_not_named(places):
    named = name_parts(parts(*places))
    assert named.bones == {}
    assert not named.is_whole


def test_two_knees_are_told_and_one_of_them_is_named():
    right = [FEMUR, TIBIA, PATELLA, FIBULA]
    left = [moved(mirrored(place), [130.0, 0.0, 1.0]) for place in right]
    named = name_parts(parts(*right, *left))
    assert named.has_two_knees
    first = set(named.bones.values())
    assert first in ({1, 2, 3, 4}, {5, 6, 7, 8})


def test_a_part_of_the_other_leg_tells_of_two_knees_as_well():
    other = moved(TIBIA, [120.0, 0.0, 0.0])
    assert name_parts(parts(FEMUR, TIBIA, PATELLA, other)).has_two_knees
    crumb = ((120.0, 0.0, -45.0), (20.0, 16.0, 20.0))
    assert not name_parts(parts(FEMUR, TIBIA, PATELLA, crumb)).has_two_knees


@pytest.mark.parametrize("hand", [1.0, -1.0])
def test_parts_are_measured_in_the_patients_axes(hand):
    size, spacing = (36, 34, 32), (1.0, 1.2, 1.5)
    axes = OBLIQUE @ np.diag([1.0, 1.0, hand])
    matrix = lattice(size, spacing, axes, (50.0, -20.0, 700.0))
    points = points_of(size, matrix)
    is_first = (np.abs(points - [46.0, -24.0, 694.0]) < [4.0, 5.0, 7.0]).all(axis=-1)
    is_third = (np.abs(points - [57.0, -14.0, 706.0]) < 4.5).all(axis=-1)
    first, third = parts_of(is_first.astype(np.int32) + 3 * is_third.astype(np.int32), matrix)
    assert (first.number, third.number) == (1, 3)
    for found, mask in ((first, is_first), (third, is_third)):
        np.testing.assert_allclose(found.centre_mm, points[mask].mean(axis=0))
        np.testing.assert_allclose(found.lower_mm, points[mask].min(axis=0))
        np.testing.assert_allclose(found.upper_mm, points[mask].max(axis=0))
        assert found.volume_mm3 == pytest.approx(mask.sum() * 1.8)
    np.testing.assert_allclose(first.centre_mm, [46.0, -24.0, 694.0], atol=0.4)


SEEDED = [{"femur": 5}, {"tibia": 6}, {"patella": 7}, {"fibula": 8}, {"femur": 5, "tibia": 6}]


@pytest.mark.parametrize("seeded", SEEDED)
def test_the_bones_are_those_of_the_seeded_knee(seeded):
    """Beside a larger knee, which would be chosen without a seed."""
    one = [(middle, 1.05 * np.array(half)) for middle, half in (FEMUR, TIBIA, PATELLA, FIBULA)]
    other = [moved(mirrored(place), [130.0, 0.0, 0.0]) for place in (FEMUR, TIBIA, PATELLA, FIBULA)]
    whole = {"femur": 5, "tibia": 6, "patella": 7, "fibula": 8}
    assert name_parts(parts(*one, *other)).bones["femur"] == 1
    assert name_parts(parts(*one, *other), seeded).bones == whole


def test_seeds_win_over_places_and_the_others_keep_their_names():
    places = parts(FEMUR, TIBIA, PATELLA, FIBULA)
    swapped = name_parts(places, {"femur": 2, "tibia": 1})
    assert {swapped.bones[name] for name in ("femur", "tibia")} == {1, 2}
    assert swapped.bones["femur"] == 2
    by_seed = name_parts(places, {"tibia": 4})
    assert by_seed.bones == {"femur": 1, "tibia": 4, "patella": 3}


def test_a_seeded_bone_without_another_of_its_knee_is_alone():
    assert name_parts(parts(PATELLA, FABELLA), {"femur": 1}).bones == {"femur": 1}
