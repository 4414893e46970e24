"""Implants and spacers: outline and light shading."""

import numpy as np

from navapp.geometry.box import Box
from navapp.geometry.zbuffer import RenderedView
from navapp.overlay.blend_kernels import compute_face_tints
from navapp.overlay.colours import PART
from navapp.overlay.labels import Image, LabelBoard
from navapp.overlay.part_shapes import part_mesh
from navapp.overlay.scene import BENEATH_WEIGHT, Scene
from navapp.overlay.shading import one_colour, outline, outline_box, tint
from navapp.overlay.viewpoints import FloatMap

_LEAST_SHARE, _STEEP_SHARE = 0.14, 0.25
_SKIN_MM = 1.0


def draw_parts(image: Image, scene: Scene, labels: LabelBoard) -> None:
    """The stage's implants and spacers where they will sit."""
    for name, part in scene.parts.items():
        mesh = part_mesh(part)
        view = scene.render(mesh)
        if view.box.is_empty:
            continue
        share = compute_face_tints(
            mesh.normals, mesh.faces, scene.axis_in_bone, _LEAST_SHARE, _STEEP_SHARE
        )
        weight = _weight(scene, view, outline_box(view, scene))
        inner = weight[view.box.relative_to(outline_box(view, scene)).slices]
        tint(image, view, share, one_colour(PART), inner)
        outline(image, scene, view, weight, PART)
        labels.add(name.replace("_", " "), scene.pixel_of(mesh.centroid_mm), PART)


def _weight(scene: Scene, view: RenderedView, box: Box) -> FloatMap:
    """(h, w) over a box: that of the scene, and of beneath where the bone is nearer."""
    weight = scene.weight_over(box)
    part_mm = np.full(weight.shape, np.nan, dtype=np.float32)
    part_mm[view.box.relative_to(box).slices] = view.depth_mm
    bone_mm = np.full(weight.shape, np.nan, dtype=np.float32)
    here, there = box.shared_slices(scene.box)
    bone_mm[here] = scene.bone_mm[there]
    # A comparison with an unknown depth is False.
    is_beneath = part_mm > bone_mm + np.float32(_SKIN_MM)
    return np.where(is_beneath, np.minimum(weight, np.float32(BENEATH_WEIGHT)), weight)
