import numpy as np
import pytest

from navapp.overlay.fitting import fit_size, in_colour, put_on_canvas, resize


def picture(height: int, width: int) -> np.ndarray:
    return np.full((height, width, 3), 200, dtype=np.uint8)


def test_a_picture_of_the_displays_size_is_passed_on() -> None:
    image = picture(48, 64)
    assert put_on_canvas(image, 64, 48) is image


@pytest.mark.parametrize(
    ("size", "display", "columns", "rows"),
    [
        ((100, 200), (400, 400), (0, 400), (100, 300)),
        ((200, 100), (400, 400), (100, 300), (0, 400)),
        ((100, 200), (100, 50), (0, 100), (0, 50)),
        ((720, 1280), (1024, 768), (0, 1024), (96, 672)),
    ],
)
def test_a_picture_is_scaled_as_a_whole_with_black_beside_it(size, display, columns, rows) -> None:
    out = put_on_canvas(picture(*size), *display)
    assert out.shape == (display[1], display[0], 3)
    lit = np.argwhere(out[:, :, 0] > 0)
    assert lit.min(axis=0).tolist() == [rows[0], columns[0]]
    assert (lit.max(axis=0) + 1).tolist() == [rows[1], columns[1]]
    assert (out[rows[0] : rows[1], columns[0] : columns[1]] == 200).all()


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


def test_grey_pictures_are_shown_in_colour_and_what_is_beside_them_black() -> None:
    canvas = put_on_canvas(np.full((10, 10), 200, np.uint8), 20, 10)
    assert (canvas[:, 5:15] == 200).all()
    assert not canvas[:, :5].any()
    assert not canvas[:, 15:].any()
    assert in_colour(canvas) is canvas
