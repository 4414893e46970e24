"""The bone itself: its outline and shape, what is to be removed of it, damaged cartilage."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.mesh import TriangleMesh
from navapp.overlay.blend_kernels import compute_face_tints
from navapp.overlay.colours import DEFECT, REMOVAL_RAMP, one_colour
from navapp.overlay.drawing import Drawing, Tint
from navapp.overlay.labels import Image, LabelBoard, put_text, text_size
from navapp.overlay.plane_sections import depth_beyond
from navapp.overlay.scene import Scene
from navapp.values import ResectionPlane

# Of the bone's colour over a part that faces the camera, and how much more over a steep one.
_LEAST_SHARE, _STEEP_SHARE = 0.10, 0.35
# Bone to be removed is covered so far; the ramp of its colours ends at this depth.
_REMOVAL_SHARE, _REMOVAL_FULL_MM = 0.5, 15.0
_LEGEND_PX, _LEGEND_RIM_PX = (14, 120), 16  # width and height of the ramp; from the picture's rim
_LEGEND_TITLE = "to remove"


def draw_bone(scene: Scene, drawing: Drawing) -> None:
    """Outline, and creases and shape as a light veil, so that the bone beneath stays visible."""
    mesh = scene.drawn_mesh
    # Steep parts are tinted more than those that face the camera: the shape shows, the bone too.
    share = compute_face_tints(
        mesh.normals, mesh.faces, scene.axis_in_bone, _LEAST_SHARE, _STEEP_SHARE
    )
    drawing.tints.append(Tint(share, one_colour(scene.colour)))
    drawing.outline = scene.colour


def draw_removal(scene: Scene, drawing: Drawing) -> None:
    """The bone beyond the stage's planes, coloured by how far it lies beyond, with a legend."""
    planes = tuple(scene.planes.values())
    if not planes or scene.box.is_empty:
        return
    tint = _removal_tint(scene.drawn_mesh, planes)
    if tint is not None:
        drawing.tints.append(tint)
        drawing.panels.append(_draw_removal_legend)


def draw_defects(scene: Scene, drawing: Drawing) -> None:
    """Damaged cartilage as dots on the side of the stage's bone that is seen."""
    for defect in scene.plan.content.defects.values():
        if defect.bone == scene.stage.bone and not scene.box.is_empty:
            drawing.dots.append((scene.mesh.vertices_mm[defect.vertices], DEFECT))


@lru_cache(maxsize=16)
def _removal_tint(mesh: TriangleMesh, planes: tuple[ResectionPlane, ...]) -> Tint | None:
    """Of each triangle; None when nothing lies beyond the planes."""
    beyond_mm = depth_beyond(mesh, planes)[mesh.faces]
    share = np.where((beyond_mm > 0.0).all(axis=1), _REMOVAL_SHARE, 0.0)
    if not share.any():
        return None
    return Tint(share.astype(np.float32), ramp_colours(beyond_mm.mean(axis=1)))


def ramp_colours(depth_mm: NDArray[np.float64]) -> NDArray[np.float32]:
    """(N, 3) colours of depths (N,) of bone to be removed."""
    ramp = np.array(REMOVAL_RAMP, dtype=np.float64)
    at = np.clip(depth_mm / _REMOVAL_FULL_MM, 0.0, 1.0) * (len(ramp) - 1)
    places = np.arange(len(ramp))
    return np.column_stack([np.interp(at, places, ramp[:, k]) for k in range(3)]).astype(np.float32)


@lru_cache(maxsize=4)
def _legend_ramp(height: int) -> NDArray[np.uint8]:
    """(height, 1, 3) colours from the ramp's end down to 0."""
    depth_mm = np.linspace(_REMOVAL_FULL_MM, 0.0, height)
    return np.round(ramp_colours(depth_mm))[:, None].astype(np.uint8)


def _draw_removal_legend(image: Image, labels: LabelBoard) -> None:
    """The ramp with its ends in mm, at the right of the picture."""
    height, width = image.shape[:2]
    size, words = labels.size, (f">{_REMOVAL_FULL_MM:.0f} mm", "0 mm")
    text_w, text_h = map(max, *(text_size(text, size) for text in words))
    title_w, title_h = text_size(_LEGEND_TITLE, size)
    w, h = _LEGEND_PX
    around_w, around_h = max(w + 6 + text_w, title_w), h + 2 * title_h + text_h
    left, top = width - around_w - _LEGEND_RIM_PX, max(80, (height - around_h) // 2)
    if left < 0 or top + around_h > height:
        return
    y = top + 2 * title_h
    image[y : y + h, left : left + w] = _legend_ramp(h)
    for text, row in zip(words, (y, y + h), strict=True):
        put_text(image, text, (left + w + 6, row + text_h // 3), size, (235, 235, 235))
    put_text(image, _LEGEND_TITLE, (left, top + title_h), size, (235, 235, 235))
    labels.taken.append(Box(left, top, around_w, around_h).grow(4).clip(width, height))
