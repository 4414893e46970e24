"""A stereo camera that hands out frames of a sequence, in memory or loaded when asked for."""

from collections.abc import Sequence

from drivers.clock import Clock
from drivers.frames import FrameMeter, StereoFrame
from drivers.interfaces import CameraInfo
from navapp.errors import DeviceLost, EndOfSequence, UnsupportedControl


class MemoryCamera:
    """Steps through frames in their order and moves the clock to each; reopening starts again.

    Args:
        frames: at least one; each is asked for once each time the camera is opened, but the first.
        clock: moved to where each frame was received.
        name: for people; that of simulated pictures begins with sim: then.
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
        self._frames, self._clock = frames, clock
        self._height, self._width = frames[0].left.shape[:2]
        self._name = f"sim:{name}" if is_simulated else name
        self._is_simulated = is_simulated
        self._place: int | None = None  # of the frame that is next
        self._meter = FrameMeter()

    @property
    def info(self) -> CameraInfo:
        """Size and length of the sequence."""
        return CameraInfo(
            name=self._name,
            backend="memory",
            is_simulated=self._is_simulated,
            is_stepped=True,
            width=self._width,
            height=self._height,
            measured_rate_hz=self._meter.rate_hz,
            measured_skew_ms=self._meter.skew_ms,
            n_frames=len(self._frames),
        )

    def open(self) -> None:
        """Begin with the first frame, unless it is open."""
        if self._place is None:
            self._place, self._meter = 0, FrameMeter()

    def read(self, timeout_s: float) -> StereoFrame:
        """The next frame, at once.

        Raises:
            DeviceLost, EndOfSequence: see `StereoCamera.read`.
        """
        if self._place is None:
            raise DeviceLost(f"{self._name} is not open", subject=self._name, remedy="open it")
        if self._place >= len(self._frames):
            raise EndOfSequence(f"{self._name} ended", subject=self._name)
        frame = self._frames[self._place]
        self._place += 1
        self._clock.wait_until_ns(frame.received_ns)
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
        self._place = None
