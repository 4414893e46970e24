"""Stereo cameras of fake USB cameras."""

from pathlib import Path

from drivers.clock import Clock, SystemClock
from drivers.opencv_stereo import OpencvStereo, OpencvStereoSettings
from drivers.uvc_settings import UvcSettings
from tests.drivers.fake_capture import FakeBus, FakeCamera

WIDTH, HEIGHT, RATE_HZ = 64, 48, 100.0


class UsbRig:
    """A left camera L1, a right one R1, and the stereo camera of both."""

    def __init__(
        self,
        root: Path,
        *,
        is_side_by_side: bool = False,
        clock: Clock | None = None,
        max_skew_ms: float = 4.0,
        rate_hz: float = RATE_HZ,
        **asked: float,
    ) -> None:
        self.bus = FakeBus(root)
        self.left: FakeCamera = self.bus.plug("L1", 1)
        self.right: FakeCamera = self.left if is_side_by_side else self.bus.plug("R1", 2)
        self.clock = clock or SystemClock()
        self.settings = OpencvStereoSettings(
            "L1",
            None if is_side_by_side else "R1",
            UvcSettings(width=WIDTH, height=HEIGHT, rate_hz=rate_hz, controls=asked),
            max_skew_ms,
        )
        self.camera = self.stereo(self.settings)

    def stereo(self, settings: OpencvStereoSettings) -> OpencvStereo:
        return OpencvStereo(
            settings,
            self.clock,
            rig_id="rig",
            names=self.bus.names,
            open_capture=self.bus.open_capture,
        )
