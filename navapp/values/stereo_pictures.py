"""What a tracker is given: two pictures of one instant, as they were taken."""

from typing import Protocol

from navapp.geometry.rectification import Image


class StereoPictures(Protocol):
    """Two pictures of one instant, or of one sweep of both shutters over their rows."""

    @property
    def left(self) -> Image:
        """Grey or BGR, not rectified."""
        ...

    @property
    def right(self) -> Image:
        """As `left`."""
        ...

    @property
    def captured_ns(self) -> int:
        """Mid exposure of the left picture."""
        ...

    @property
    def skew_ns(self) -> int:
        """The right picture is exposed so much later than the left one."""
        ...
