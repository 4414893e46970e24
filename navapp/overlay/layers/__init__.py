"""Layers that can be drawn: one function each, and the table of their names.

A layer tells a drawing what of its scene is to be drawn; it returns nothing. Of one kind, what
later layers ask for lies over that of earlier ones.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from navapp.overlay.drawing import Drawing
from navapp.overlay.layers.bone import draw_bone, draw_defects, draw_removal
from navapp.overlay.layers.drills import draw_drills
from navapp.overlay.layers.parts import draw_parts
from navapp.overlay.layers.planes import draw_planes
from navapp.overlay.layers.risks import draw_risks
from navapp.overlay.layers.scale import draw_scale
from navapp.overlay.layers.targets import draw_targets
from navapp.overlay.scene import Scene

Layer = Callable[[Scene, Drawing], None]

LAYERS: Mapping[str, Layer] = MappingProxyType(
    {
        "bone": draw_bone,
        "removal": draw_removal,
        "defects": draw_defects,
        "risks": draw_risks,
        "parts": draw_parts,
        "planes": draw_planes,
        "drills": draw_drills,
        "targets": draw_targets,
        "scale": draw_scale,
    }
)

__all__ = ["LAYERS", "Layer"]
