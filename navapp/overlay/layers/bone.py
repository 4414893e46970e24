"""The bone itself: its outline and shape, what is to be removed of it, damaged cartilage."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.mesh import TriangleMesh
from navapp.overlay.blend_kernels import blend_colour, compute_face_tints
from navapp.overlay.colours import DEFECT, REMOVAL_RAMP
from navapp.overlay.labels import Image, LabelBoard, put_text
from navapp.overlay.plane_sections import depth_beyond
from navapp.overlay.scene import SKIN_MM, Scene
from navapp.overlay.shading import draw_surface, outline_box, tint
from navapp.values import ResectionPlane

# Of the bone's colour over a part that faces the camera, and how much more over a steep one.
_LEAST_SHARE, _STEEP_SHARE = 0.10, 0.35
# Bone to be removed is covered so far; the ramp of its colours ends at this depth.
_REMOVAL_SHARE, _REMOVAL_FULL_MM = 0.5, 15.0
_LEGEND_PX = (14, 120)  # width and height of the ramp
_DOT = ((0, 0), (0, 1), (1, 0), (0, -1), (-1, 0))


def draw_bone(image: Image, scene: Scene, labels: LabelBoard) -> None:
    """Outline, and creases and shape as a light veil, so that the bone beneath stays visible."""
    view, mesh = scene.view, scene.drawn_mesh
    if view.box.is_empty:
        return
    # Steep parts are tinted more than those that face the camera: the shape shows, the bone too.
    share = compute_face_tints(
        mesh.normals, mesh.faces, scene.axis_in_bone, _LEAST_SHARE, _STEEP_SHARE
    )
    weight = scene.weight_over(outline_box(view, scene))
    draw_surface(image, scene, view, share, scene.colour, weight)


def draw_removal(image: Image, scene: Scene, labels: LabelBoard) -> None:
    """The bone beyond the stage's planes, coloured by how far it lies beyond, with a legend."""
    planes = tuple(scene.planes.values())
    if not planes or scene.view.box.is_empty:
        return
    share, colours = _removal_tints(scene.drawn_mesh, planes)
    if not share.any():
        return
    view = scene.view
    tint(image, view, share, colours, scene.weight_over(view.box))
    _draw_removal_legend(image, labels)


def draw_defects(image: Image, scene: Scene, labels: LabelBoard) -> None:
    """Damaged cartilage as dots on the side of the stage's bone that is seen."""
    box, part = scene.box, image[scene.box.slices]
    share = np.zeros(scene.bone_mm.shape, dtype=np.float32)
    for defect in scene.plan.content.defects.values():
        if defect.bone != scene.stage.bone:
            continue
        in_camera = scene.to_camera(scene.mesh.vertices_mm[defect.vertices])
        with np.errstate(invalid="ignore"):
            at = np.round(scene.camera.project(in_camera)) - (box.x, box.y)
            is_inside = ((at >= 1) & (at < (box.width - 1, box.height - 1))).all(axis=1)
        u, v = at[is_inside].astype(np.intp).T
        # A comparison with an unknown depth is False.
        is_far = in_camera[is_inside, 2] > scene.bone_mm[v, u] + SKIN_MM
        u, v = u[~is_far], v[~is_far]
        for down, right in _DOT:
            share[v + down, u + right] = scene.weight[v, u]
    blend_colour(part, share, DEFECT)


@lru_cache(maxsize=16)
def _removal_tints(
    mesh: TriangleMesh, planes: tuple[ResectionPlane, ...]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Share (F,) and colour (F, 3) of each triangle."""
    beyond_mm = depth_beyond(mesh, planes)[mesh.faces]
    share = np.where((beyond_mm > 0.0).all(axis=1), _REMOVAL_SHARE, 0.0)
    return share.astype(np.float32), ramp_colours(beyond_mm.mean(axis=1))


def ramp_colours(depth_mm: NDArray[np.float64]) -> NDArray[np.float32]:
    """(N, 3) colours of depths (N,) of bone to be removed."""
    ramp = np.array(REMOVAL_RAMP, dtype=np.float64)
    at = np.clip(depth_mm / _REMOVAL_FULL_MM, 0.0, 1.0) * (len(ramp) - 1)
    places = np.arange(len(ramp))
    return np.column_stack([np.interp(at, places, ramp[:, k]) for k in range(3)]).astype(np.float32)


def _draw_removal_legend(image: Image, labels: LabelBoard) -> None:
    """The ramp with its ends in mm, at the right of the picture."""
    height, width = image.shape[:2]
    w, h = _LEGEND_PX
    x, y = width - w - 76, max(80, height // 2 - h // 2)
    if y + h + 30 > height or x < 0:
        return
    depth_mm = np.linspace(_REMOVAL_FULL_MM, 0.0, h)
    image[y : y + h, x : x + w] = np.round(ramp_colours(depth_mm))[:, None].astype(np.uint8)
    size = labels.size
    for share, text in ((0.0, f">{_REMOVAL_FULL_MM:.0f} mm"), (1.0, "0 mm")):
        at = (x + w + 5, y + round(share * h) + 5)
        put_text(image, text, at, size, (235, 235, 235))
    put_text(image, "to remove", (x - 14, y - 14), size, (235, 235, 235))
    labels.taken.append(Box(x - 16, y - 32, w + 92, h + 50))
