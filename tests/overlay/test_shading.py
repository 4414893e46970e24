"""Areas and outlines."""

import numpy as np
import pytest

from navapp.geometry.zbuffer import render
from navapp.overlay.blend_kernels import tint_faces
from navapp.overlay.scene import BENEATH_WEIGHT
from navapp.overlay.shading import draw_surface, one_colour, outline, outline_box, tint
from tests.overlay.scenes import CAMERA, MESH, POSE, black, grown, is_colour, scene, video
from tests.views import find_silhouette

COLOUR = (10, 200, 250)
VIEW = render(MESH, POSE, CAMERA, is_whole=False)


def weight(value: float, margin: bool = True) -> np.ndarray:
    box = outline_box(VIEW, scene()) if margin else VIEW.box
    return np.full((box.height, box.width), value, dtype=np.float32)


def silhouette() -> np.ndarray:
    return find_silhouette(render(MESH, POSE, CAMERA))


def test_the_outline_lies_at_the_edge_of_the_silhouette() -> None:
    image = black()
    outline(image, scene(), VIEW, weight(1.0), COLOUR)
    edge = silhouette()
    # Less than the colour itself only at corners.
    assert (image[edge][:, 1] > 0.75 * COLOUR[1]).mean() > 0.99
    assert is_colour(image, COLOUR)[edge].mean() > 0.7
    lit = image.max(axis=2) > 25
    assert not (lit & ~grown(edge, 2)).any()
    # As wide to the inside as to the outside.
    mask = render(MESH, POSE, CAMERA).mask
    lit_sum = image[..., 1].astype(float)
    assert 0.8 < lit_sum[mask].sum() / lit_sum[~mask].sum() < 1.25


def test_beneath_something_the_outline_is_in_stripes_that_are_seen() -> None:
    image = black()
    outline(image, scene(), VIEW, weight(BENEATH_WEIGHT), COLOUR)
    on_edge = image[silhouette()].astype(int)
    is_full = (np.abs(on_edge - COLOUR) <= 12).all(axis=1)
    assert 0.35 < is_full.mean() < 0.65
    faint = on_edge[~is_full].max(axis=1)
    assert np.median(faint) < 120
    assert (faint > 3).all()


def test_a_hidden_outline_is_not_drawn() -> None:
    image = black()
    outline(image, scene(), VIEW, weight(0.0), COLOUR)
    assert not image.any()


@pytest.mark.parametrize("share", [0.25, 1.0])
def test_every_pixel_is_tinted_once(share: float) -> None:
    """Two threads share the picture: a band that both did would be tinted twice."""
    image, expected = video(), video()
    shares = np.linspace(0.0, share, len(MESH.faces), dtype=np.float32)
    tint(image, VIEW, shares, one_colour(COLOUR), weight(1.0, margin=False))
    part = expected[VIEW.box.slices]
    tint_faces(part, VIEW.face_index, shares, one_colour(COLOUR), weight(1.0, margin=False))
    np.testing.assert_array_equal(image, expected)
    assert (image != video()).any()


def test_a_surface_is_tinted_inside_and_has_an_outline() -> None:
    image = black()
    shares = np.full(len(MESH.faces), 0.5, dtype=np.float32)
    draw_surface(image, scene(), VIEW, shares, COLOUR, weight(1.0))
    mask, edge = render(MESH, POSE, CAMERA).mask, silhouette()
    inner = mask & ~grown(edge, 4)
    assert (np.abs(image[inner].astype(int) - np.array(COLOUR) // 2) <= 1).all()
    assert (image[edge][:, 1] > 0.75 * COLOUR[1]).mean() > 0.99
    assert not image[~grown(mask, 4)].any()
