"""Implants and spacers: outline and light shading."""

from navapp.overlay.blend_kernels import compute_face_tints
from navapp.overlay.colours import PART
from navapp.overlay.drawing import Body, Drawing, find_middle_mm
from navapp.overlay.scene import Scene
from navapp.values.part_shapes import part_mesh

_LEAST_SHARE, _STEEP_SHARE = 0.14, 0.25


def draw_parts(scene: Scene, drawing: Drawing) -> None:
    """The stage's implants and spacers where they will sit."""
    for name, part in scene.parts.items():
        mesh = part_mesh(part)
        share = compute_face_tints(
            mesh.normals, mesh.faces, scene.axis_in_bone, _LEAST_SHARE, _STEEP_SHARE
        )
        drawing.bodies.append(Body(mesh, share, PART))
        drawing.label(name.replace("_", " "), find_middle_mm(mesh), PART)
