"""Areas: surfaces tinted, and their outlines."""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import run_both
from navapp.geometry.box import Box
from navapp.geometry.zbuffer import RenderedView
from navapp.overlay.blend_kernels import blend_outline, lay_over, tint_faces
from navapp.overlay.colours import Colour, one_colour
from navapp.overlay.drawing import Body, Tint
from navapp.overlay.scene import BENEATH_WEIGHT, Scene
from navapp.overlay.viewpoints import FloatMap

Image = NDArray[np.uint8]

# The outline lies on both sides of a mask's edge, which is made smooth over so much.
_OUTLINE_SIGMA_PX, _OUTLINE_WINDOW_PX, _OUTLINE_MARGIN_PX = 0.9, 5, 4
# Where an outline is beneath something, stripes of this width are left out.
_STRIPE_PX = 6


def draw_bone(image: Image, scene: Scene, tints: list[Tint], colour: Colour | None) -> None:
    """The stage's bone: tints laid over each other, and its outline when there is a colour."""
    view = scene.view
    if view.box.is_empty:
        return
    if colour is None:
        _tint_bone(image, scene, tints)
        return
    box = outline_box(view, scene)
    # The outline's mask needs nothing of the tints: the helper makes it beside them.
    _, soft = run_both(partial(_tint_bone, image, scene, tints), partial(soften_mask, view, box))
    draw_outline(image, box, soft, scene.weight_over(box), colour)


def _tint_bone(image: Image, scene: Scene, tints: list[Tint]) -> None:
    if not tints:
        return
    view, n_faces = scene.view, len(tints[0].share_of_face)
    share, colours = np.zeros(n_faces, np.float32), np.zeros((n_faces, 3), np.float32)
    for tint in tints:
        lay_over(share, colours, tint.share_of_face, tint.colour_of_face)
    weight = scene.weight_over(view.box)
    tint_faces(image[view.box.slices], view.face_index, share, colours, weight)


def draw_body(image: Image, scene: Scene, view: RenderedView, body: Body) -> None:
    """Another mesh, rendered: tinted, and its outline; beneath the bone where that is nearer."""
    if view.box.is_empty:
        return
    box = outline_box(view, scene)
    weight = scene.weight_of(view, box)
    inner = view.box.relative_to(box).slices
    colour = one_colour(body.colour)
    tint_faces(image[view.box.slices], view.face_index, body.share_of_face, colour, weight[inner])
    draw_outline(image, box, soften_mask(view, box), weight, body.colour)


def draw_outline(
    image: Image, box: Box, soft: NDArray[np.uint8], weight: FloatMap, colour: Colour
) -> None:
    """The edge of a rendered mesh, two pixels wide; in stripes where the weight is that of beneath.

    Args:
        image: in place.
        box: of the mesh, as of `outline_box`.
        soft: (h, w) over the box, 0 to 255, where the mesh is seen, as of `soften_mask`.
        weight: (h, w) over the box.
        colour: of the line.
    """
    blend_outline(
        image[box.slices], soft, weight, (box.x, box.y), _STRIPE_PX, BENEATH_WEIGHT, colour
    )


def soften_mask(view: RenderedView, box: Box) -> NDArray[np.uint8]:
    """Where a mesh is seen, with a smooth edge: (h, w) over a box around it, 0 to 255."""
    import cv2

    mask = np.zeros((box.height, box.width), dtype=np.uint8)
    inner = mask[view.box.relative_to(box).slices]
    np.multiply(view.mask.view(np.uint8), np.uint8(255), out=inner)
    window = _OUTLINE_WINDOW_PX, _OUTLINE_WINDOW_PX
    return np.asarray(cv2.GaussianBlur(mask, window, _OUTLINE_SIGMA_PX), dtype=np.uint8)


def outline_box(view: RenderedView, scene: Scene) -> Box:
    """The box over which an outline is drawn, inside the picture."""
    return view.box.grow(_OUTLINE_MARGIN_PX).clip(scene.camera.width, scene.camera.height)
