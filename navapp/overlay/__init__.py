"""From a pose and a plan to the picture that is shown."""

from navapp.overlay.composition import compose_video, make_preview
from navapp.overlay.layers import LAYERS

__all__ = ["LAYERS", "compose_video", "make_preview"]
