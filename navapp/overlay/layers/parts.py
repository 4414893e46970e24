"""Implants and spacers: outline and light shading."""

from navapp.overlay.blend_kernels import compute_face_tints
from navapp.overlay.colours import PART
from navapp.overlay.labels import Image, LabelBoard
from navapp.overlay.part_shapes import part_mesh
from navapp.overlay.scene import Scene
from navapp.overlay.shading import draw_surface, outline_box

_LEAST_SHARE, _STEEP_SHARE = 0.14, 0.25


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
        weight = scene.weight_of(view, outline_box(view, scene))
        draw_surface(image, scene, view, share, PART, weight)
        labels.add(name.replace("_", " "), scene.pixel_of(mesh.centroid_mm), PART)
