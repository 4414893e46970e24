"""A stereo camera that hands out frames that are in memory already."""

from collections import deque
from collections.abc import Sequence

from drivers.clock import Clock
from drivers.frames import FrameMeter, StereoFrame
from drivers.interfaces import CameraInfo
from navapp.errors import DeviceLost, EndOfSequence, UnsupportedControl


class MemoryCamera:
    """Steps through frames in their order and moves the clock to each; opening starts again.

    Args:
        frames: at least one.
        clock: moved to each capture time.
        name: for people.
        is_simulated: the pictures are not of this world.
    """

    def __init__(
        self,
        frames: Sequence[StereoFrame],
        clock: Clock,
        name: str = "memory",
        *,
        is_simulated: bool = False,
    ) -> None:
        if not frames:
            raise ValueError("a camera needs at least one frame")
        self._frames, self._clock = tuple(frames), clock
        self._name, self._is_simulated = name, is_simulated
        self._left: deque[StereoFrame] | None = None
        self._meter = FrameMeter()

    @property
    def info(self) -> CameraInfo:
        """Size and length of the sequence."""
        height, width = self._frames[0].left.shape[:2]
        return CameraInfo(
            name=self._name,
            backend="memory",
            is_simulated=self._is_simulated,
            is_stepped=True,
            width=width,
            height=height,
            measured_rate_hz=self._meter.rate_hz,
            measured_skew_ms=self._meter.skew_ms,
            n_frames=len(self._frames),
        )

    def open(self) -> None:
        """Begin with the first frame, unless it is open."""
        if self._left is None:
            self._left, self._meter = deque(self._frames), FrameMeter()

    def read(self, timeout_s: float) -> StereoFrame:
        """The next frame, at once.

        Raises:
            DeviceLost, EndOfSequence: see `StereoCamera.read`.
        """
        if self._left is None:
            raise DeviceLost(f"{self._name} is not open", subject=self._name, remedy="open it")
        if not self._left:
            raise EndOfSequence(f"{self._name} ended", subject=self._name)
        frame = self._left.popleft()
        self._clock.wait_until_ns(frame.captured_ns)
        self._meter.add(frame)
        return frame

    def set(self, control: str, value: float) -> float:
        """What is in memory has no controls."""
        raise UnsupportedControl(
            f"pictures in memory cannot change {control}",
            subject=control,
            remedy="use a live camera",
        )

    def close(self) -> None:
        """No frame comes any more."""
        self._left = None
