"""Layers that can be drawn: one function each, and the table of their names.

A layer draws into the picture and asks the label board for words; it returns nothing. Later layers
lie over earlier ones.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from navapp.overlay.labels import Image, LabelBoard
from navapp.overlay.layers.bone import draw_bone, draw_defects, draw_removal
from navapp.overlay.layers.drills import draw_drills
from navapp.overlay.layers.parts import draw_parts
from navapp.overlay.layers.planes import draw_planes
from navapp.overlay.layers.risks import draw_risks
from navapp.overlay.layers.scale import draw_scale
from navapp.overlay.layers.targets import draw_targets
from navapp.overlay.scene import Scene

Layer = Callable[[Image, Scene, LabelBoard], None]

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
