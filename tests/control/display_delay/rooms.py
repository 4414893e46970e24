"""A display in front of small simulated cameras, stepped or running by themselves."""

from collections.abc import Callable

from drivers.clock import Clock, ManualClock, SystemClock
from drivers.frames import StereoFrame
from sim_devices.camera import SimulatedCamera
from sim_devices.faults import Fault, FaultScript
from sim_devices.lit_display import DisplayInView, LitDisplay
from sim_devices.sensor import SensorModel
from tests.sim_devices.plain_world import plain_rig

MS = 1_000_000


class Room:
    """Opened devices that see each other."""

    def __init__(
        self,
        *faults: Fault,
        is_stepped: bool = True,
        rate_hz: float = 25.0,
        delay_ms: float = 40.0,
        skew_ms: float = 0.0,
        unstamped_skew_ms: float = 0.0,
        seed: int = 0,
    ) -> None:
        self.clock: Clock = ManualClock() if is_stepped else SystemClock()
        delay_ns = round(delay_ms * MS)
        self.display = LitDisplay(self.clock, 64, 36, delay_ns=delay_ns, refresh_hz=59.94)
        view = DisplayInView(self.display, self.clock, 8 * MS, plain_rig())
        self.camera = SimulatedCamera(
            view,
            self.clock,
            is_stepped=is_stepped,
            rate_hz=rate_hz,
            sensor=SensorModel(seed=seed, is_grey=True),
            faults=FaultScript(faults),
            skew_ns=round(skew_ms * MS),
            unstamped_skew_ns=round(unstamped_skew_ms * MS),
        )
        self.display.open()
        self.camera.open()
        view.begin(-self.camera.world_time_ns(0))

    def light_from_now(self) -> float:
        """What the display gives once everything that it was told until now is seen."""
        from_ns = self.clock.now_ns() + self.display.delay_ns + 20 * MS
        return self.display.mean_light(from_ns, from_ns + MS)


class Breaking:
    """A simulated camera whose n-th read does something else."""

    def __init__(self, camera: SimulatedCamera, n: int, instead: Callable[[], None]) -> None:
        self._camera, self._n, self._instead = camera, n, instead
        self.info = camera.info

    def read(self, timeout_s: float) -> StereoFrame:
        self._n -= 1
        if self._n == 0:
            self._instead()
        return self._camera.read(timeout_s)
