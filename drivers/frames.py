"""`StereoFrame`, what a stereo camera returns, and a meter of its rate and skew."""

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class StereoFrame:
    """Two pictures of one instant, or of one sweep of both shutters over their rows."""

    # left, right: uint8, (H, W) grey or (H, W, 3) BGR, the same shape, not rectified.
    left: Image
    right: Image
    # mid exposure of the left picture, of its middle row, on the host's monotonic clock.
    captured_ns: int
    received_ns: int  # when the driver had both pictures
    skew_ns: int  # capture time of the right picture minus that of the left one
    sequence: int  # counts the frames that the source handed out, strictly increasing
    rig_id: str  # identity of the rig that took them
    # number of the picture in a recorded folder; None for a live camera.
    source_index: int | None = None
    # a row is exposed later by this than the row above it, in both pictures; 0: all rows at once.
    row_delay_ns: int = 0

    def __post_init__(self) -> None:
        shape = self.left.shape
        if self.right.shape != shape or not (
            len(shape) == 2 or (len(shape) == 3 and shape[2] == 3)
        ):
            raise ValueError("left and right must be grey or BGR pictures of the same shape")
        if self.left.dtype != np.uint8 or self.right.dtype != np.uint8:
            raise ValueError("pictures are uint8")

    @property
    def index(self) -> int:
        """The number under which results of this frame are listed."""
        return self.sequence if self.source_index is None else self.source_index


class FrameMeter:
    """Rate and skew of the frames that a camera handed out last."""

    def __init__(self, window: int = 30) -> None:
        """Start without frames.

        Args:
            window: how many frames count.
        """
        self._captured_ns: deque[int] = deque(maxlen=window)
        self._skew_ns: deque[int] = deque(maxlen=window)
        self.rate_hz: float | None = None
        self.skew_ms: float | None = None

    def add(self, frame: StereoFrame) -> None:
        """Count a frame; `rate_hz` (from two frames on) and `skew_ms` (mean) follow."""
        self._captured_ns.append(frame.captured_ns)
        self._skew_ns.append(frame.skew_ns)
        duration_ns = self._captured_ns[-1] - self._captured_ns[0]
        if duration_ns > 0:
            self.rate_hz = (len(self._captured_ns) - 1) * 1e9 / duration_ns
        self.skew_ms = sum(self._skew_ns) / len(self._skew_ns) * 1e-6
