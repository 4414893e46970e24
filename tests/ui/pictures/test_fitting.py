import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.ui.pictures.fitting import (
    choose_part,
    find_point,
    fit_size,
    in_colour,
    put_on_canvas,
    resize,
)

SIZE_PX = (1280, 720)


@pytest.mark.parametrize(("width", "height"), [(31, 53), (100, 50), (120, 70)])
def test_resizing_keeps_the_mean(width: int, height: int) -> None:
    noise = np.random.default_rng(3).integers(0, 256, (90, 160, 3), dtype=np.uint8)
    resized = resize(noise, width, height)
    assert resized.shape == (height, width, 3)
    np.testing.assert_allclose(resized.mean((0, 1)), noise.mean((0, 1)), atol=2.0)


def test_resizing_by_a_whole_factor_is_the_mean_of_blocks() -> None:
    picture = np.random.default_rng(4).integers(0, 256, (6, 8, 3), dtype=np.uint8)
    expected = picture.reshape(3, 2, 4, 2, 3).mean((1, 3))
    np.testing.assert_allclose(resize(picture, 4, 3), expected, atol=0.51)


@pytest.mark.parametrize("room", [(52, 30), (114, 60), (3, 80), (1, 2)])
def test_the_picture_fits_its_room_and_keeps_its_aspect(room: tuple[int, int]) -> None:
    width, height = fit_size((90, 160), *room)
    assert 1 <= width <= room[0]
    assert 1 <= height <= room[1]
    if room[0] > 10:
        assert width / height == pytest.approx(160 / 90, rel=0.05)


@pytest.mark.parametrize("room", [(52, 30), (114, 60), (160, 40), (700, 900)])
def test_a_place_on_the_canvas_tells_its_point_of_the_picture(room: tuple[int, int]) -> None:
    picture = np.zeros((90, 160, 3), dtype=np.uint8)
    picture[30:36, 100:106] = 255
    canvas = put_on_canvas(picture, *room)
    assert canvas.shape == (room[1], room[0], 3)
    lit = np.argwhere(canvas[:, :, 0] > 60)
    places = [find_point((90, 160), room, (x + 0.5, y + 0.5)) for y, x in lit.tolist()]
    assert np.mean(places, axis=0) == pytest.approx([103 / 160, 33 / 90], abs=0.02)
    assert find_point((90, 160), room, (0.0, -5.0)) == (pytest.approx(0.0, abs=0.01), 0.0)


def test_grey_pictures_are_shown_in_colour_and_what_is_beside_them_black() -> None:
    canvas = put_on_canvas(np.full((10, 10), 200, np.uint8), 20, 10)
    assert (canvas[:, 5:15] == 200).all()
    assert not canvas[:, :5].any()
    assert not canvas[:, 15:].any()
    assert in_colour(canvas) is canvas


@pytest.mark.parametrize(
    "bone", [Box(500, 200, 200, 150), Box(0, 0, 90, 60), Box(900, 0, 380, 700)]
)
@pytest.mark.parametrize("aspect", [1.0, 16 / 9, 2.5])
def test_the_part_holds_the_bone_lies_in_the_picture_and_fits_the_room(
    bone: Box, aspect: float
) -> None:
    part = choose_part(bone, SIZE_PX, aspect)
    assert part.clip(*SIZE_PX) == part
    assert part.intersect(bone) == bone
    is_whole = part.width == SIZE_PX[0] or part.height == SIZE_PX[1]
    assert is_whole or part.width / part.height == pytest.approx(aspect, rel=0.01)


def test_the_part_stays_while_the_bone_stays_in_it_and_comes_nearer_with_it() -> None:
    first = choose_part(Box(500, 200, 200, 150), SIZE_PX, 2.0)
    assert choose_part(Box(510, 205, 200, 150), SIZE_PX, 2.0, first) is first
    moved = choose_part(Box(700, 200, 200, 150), SIZE_PX, 2.0, first)
    assert moved.intersect(Box(700, 200, 200, 150)) == Box(700, 200, 200, 150)
    wide = choose_part(Box(100, 100, 1000, 500), SIZE_PX, 2.0)
    assert choose_part(Box(500, 200, 200, 150), SIZE_PX, 2.0, wide) == first
    assert choose_part(Box(500, 200, 200, 150), SIZE_PX, 1.0, first) != first
