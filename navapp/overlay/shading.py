"""Areas: the surface of a mesh tinted, and its outline."""

from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import in_row_bands
from navapp.geometry.box import Box
from navapp.geometry.zbuffer import RenderedView
from navapp.overlay.blend_kernels import blend_colour, tint_faces
from navapp.overlay.colours import Colour
from navapp.overlay.scene import BENEATH_WEIGHT, Scene
from navapp.overlay.viewpoints import FloatMap

Image = NDArray[np.uint8]

# The outline lies on both sides of a mask's edge, which is made smooth over so much.
_OUTLINE_SIGMA_PX, _OUTLINE_MARGIN_PX = 0.9, 4
# Where an outline is beneath something, stripes of this width are left out.
_STRIPE_PX = 6


def draw_surface(
    image: Image,
    scene: Scene,
    view: RenderedView,
    share_of_face: NDArray[np.float32],
    colour: Colour,
    weight: FloatMap,
) -> None:
    """One colour over a rendered mesh by share (F,), and its outline.

    The weight (h, w) is over `outline_box`.
    """
    inner = view.box.relative_to(outline_box(view, scene)).slices
    tint(image, view, share_of_face, one_colour(colour), weight[inner])
    outline(image, scene, view, weight, colour)


def tint(
    image: Image,
    view: RenderedView,
    share_of_face: NDArray[np.float32],
    colour_of_face: NDArray[np.float32],
    weight: FloatMap,
) -> None:
    """Blend colours (F, 3), or one (1, 3), over a mesh, by share (F,) and weight (h, w)."""
    part = image[view.box.slices]

    def tint_rows(rows: tuple[int, int]) -> None:
        of = slice(*rows)
        tint_faces(part[of], view.face_index[of], share_of_face, colour_of_face, weight[of])

    in_row_bands(view.box.height, tint_rows)


def outline(
    image: Image, scene: Scene, view: RenderedView, weight: FloatMap, colour: Colour
) -> None:
    """The edge of a rendered mesh, two pixels wide; in stripes where the weight is that of beneath.

    Args:
        image: in place.
        scene: for the size of the picture.
        view: of the mesh.
        weight: (h, w) over the view's box grown by `outline_box`.
        colour: of the line.
    """
    import cv2

    box = outline_box(view, scene)
    mask = np.zeros((box.height, box.width), dtype=np.float32)
    mask[view.box.relative_to(box).slices] = view.mask
    soft = np.asarray(cv2.GaussianBlur(mask, (0, 0), _OUTLINE_SIGMA_PX))
    share = np.clip(np.float32(5.0) * soft * (np.float32(1.0) - soft), 0.0, 1.0)
    part = image[box.slices]
    stripes = _stripes(box)
    drawn = share * _line_weight(weight, stripes)
    in_row_bands(
        box.height, lambda rows: blend_colour(part[slice(*rows)], drawn[slice(*rows)], colour)
    )


def outline_box(view: RenderedView, scene: Scene) -> Box:
    """The box over which an outline is drawn, inside the picture."""
    return view.box.grow(_OUTLINE_MARGIN_PX).clip(scene.camera.width, scene.camera.height)


@lru_cache(maxsize=8)
def _stripes(box: Box) -> NDArray[np.bool_]:
    """(h, w) every other stripe, slanted, the same at the same place of a picture."""
    rows = np.arange(box.y, box.y + box.height)[:, None]
    columns = np.arange(box.x, box.x + box.width)
    return np.asarray(((rows + columns) // _STRIPE_PX) % 2 == 0)


def _line_weight(weight: FloatMap, stripes: NDArray[np.bool_]) -> FloatMap:
    """Full on top, in stripes beneath, less towards what hides it."""
    line = weight.copy()
    is_beneath = weight <= BENEATH_WEIGHT
    np.minimum(line / np.float32(BENEATH_WEIGHT), 1.0, out=line, where=is_beneath)
    line[is_beneath & ~stripes] *= np.float32(0.25)
    return line


one_colour = partial(np.array, ndmin=2, dtype=np.float32)
