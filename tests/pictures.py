"""Pictures for a tracker that no camera took."""

from dataclasses import dataclass

from navapp.geometry.rectification import Image


@dataclass(frozen=True)
class Pictures:
    """Any two, at a time."""

    left: Image
    right: Image
    captured_ns: int = 0
    skew_ns: int = 0
