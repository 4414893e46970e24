"""Areas and outlines."""

import numpy as np
import pytest

from navapp.geometry.zbuffer import render
from navapp.overlay.colours import one_colour
from navapp.overlay.drawing import Body, Tint
from navapp.overlay.scene import BENEATH_WEIGHT
from navapp.overlay.shading import draw_body, draw_bone, draw_outline, outline_box, soften_mask
from tests.geometry.shapes import sphere
from tests.overlay.scenes import CAMERA, MESH, POSE, black, grown, is_colour, scene, seen
from tests.views import find_silhouette

COLOUR = (10, 200, 250)
VIEW = render(MESH, POSE, CAMERA, is_whole=False)
BOX = outline_box(VIEW, scene())


def weight(value: float) -> np.ndarray:
    return np.full((BOX.height, BOX.width), value, dtype=np.float32)


def silhouette() -> np.ndarray:
    return find_silhouette(render(MESH, POSE, CAMERA))


def test_the_outline_lies_at_the_edge_of_the_silhouette() -> None:
    image = black()
    draw_outline(image, BOX, soften_mask(VIEW, BOX), weight(1.0), COLOUR)
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
    draw_outline(image, BOX, soften_mask(VIEW, BOX), weight(BENEATH_WEIGHT), COLOUR)
    on_edge = image[silhouette()].astype(int)
    is_full = (np.abs(on_edge - COLOUR) <= 12).all(axis=1)
    assert 0.35 < is_full.mean() < 0.65
    faint = on_edge[~is_full].max(axis=1)
    assert np.median(faint) < 120
    assert (faint > 3).all()


def test_a_hidden_outline_is_not_drawn() -> None:
    image = black()
    draw_outline(image, BOX, soften_mask(VIEW, BOX), weight(0.0), COLOUR)
    assert not image.any()


def test_a_surface_is_tinted_inside_and_has_an_outline() -> None:
    image, given = black(), seen(scene())
    shares = np.full(len(given.drawn_mesh.faces), 0.5, dtype=np.float32)
    draw_bone(image, given, [Tint(shares, one_colour(COLOUR))], COLOUR)
    mask, edge = render(MESH, POSE, CAMERA).mask, silhouette()
    inner = mask & ~grown(edge, 4)
    assert (np.abs(image[inner].astype(int) - np.array(COLOUR) // 2) <= 1).mean() > 0.99
    assert (image[edge][:, 1] > 0.75 * COLOUR[1]).mean() > 0.99
    assert not image[~grown(mask, 4)].any()


def test_tints_lie_over_each_other_in_their_order() -> None:
    image, given = black(), seen(scene())
    n = len(given.drawn_mesh.faces)
    tints = [
        Tint(np.full(n, share, dtype=np.float32), one_colour(colour))
        for share, colour in ((0.5, (200, 0, 0)), (0.25, (0, 200, 0)))
    ]
    draw_bone(image, given, tints, None)
    inner = render(MESH, POSE, CAMERA).mask & ~grown(silhouette(), 4)
    assert (np.abs(image[inner].astype(int) - (75, 50, 0)) <= 1).all(axis=1).mean() > 0.99


def test_a_body_within_the_bone_is_fainter_than_before_it() -> None:
    given, lit = seen(scene()), []
    for z_mm in (-25.0, 30.0):
        mesh = sphere(8.0, 24, (0.0, 0.0, z_mm))
        image, view = black(), given.render(mesh)
        body = Body(mesh, np.full(len(mesh.faces), 0.5, dtype=np.float32), COLOUR)
        draw_body(image, given, view, body)
        inner = render(mesh, POSE, CAMERA).mask
        lit.append(float(np.median(image[inner][:, 1])))
    assert lit == [100.0, pytest.approx(55.0, abs=1.0)]
