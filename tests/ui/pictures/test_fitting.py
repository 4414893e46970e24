import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.overlay.fitting import put_on_canvas
from navapp.ui.pictures.fitting import choose_part, find_point

SIZE_PX = (1280, 720)


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
