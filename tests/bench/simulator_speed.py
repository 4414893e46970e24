"""CPU time of one simulated pair at 1280x720: rendering and sensor apart, then with motion blur.

usage: python -m tests.bench.simulator_speed
"""

import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drivers.clock import ManualClock
from sim_devices.camera import SimulatedCamera
from sim_devices.rigs import make_default_rig
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from sim_devices.world import World

_SCENES = {
    "opening": Scenario(motion="patient"),
    "drilling": Scenario(motion="patient", stage="drilling"),
    "hand in front": Scenario(motion="patient", instrument="sweep"),
}
# Drift of the leg in mm/s, whether it is blurred, shutter in ms, shake of the rig in mm.
_EXPOSURES = {
    "still": (0.0, False, 0.0, 0.0),
    "blur of 3 px": (120.0, True, 0.0, 0.0),
    "blur of 6 px": (240.0, True, 0.0, 0.0),
    "shutter of 15 ms, 3 px": (120.0, False, 15.0, 0.0),
    "blur and shutter, 3 px": (120.0, True, 15.0, 0.0),
    "shake": (0.0, False, 0.0, 0.3),
    "blur, shutter and shake, 3 px": (120.0, True, 15.0, 0.3),
}
_PERIOD_NS = 66_666_667
_N_PAIRS = 24
_N_EXPOSED = 12


def main() -> None:
    """Print one line a scene and one an exposure: medians, and the largest time of a pair."""
    print("| scene | render ms | sensor ms | pairs/s on one core | slowest pair ms |")
    print("|---|---|---|---|---|")
    for name, scenario in _SCENES.items():
        world, sensor = World(scenario), SensorModel()
        times = np.array([pair_ms(world, sensor, number) for number in range(_N_PAIRS)])[2:]
        render, exposure = np.median(times, axis=0)
        print(
            f"| {name} | {render:.0f} | {exposure:.0f} | {1e3 / (render + exposure):.1f} | "
            f"{times.sum(axis=1).max():.0f} |"
        )
    print("\n| exposure | median pair ms | slowest pair ms |\n|---|---|---|")
    for name, (drift_mm_s, is_blurred, shutter_ms, shake_mm) in _EXPOSURES.items():
        scenario = Scenario(motion="still", drift_mm_s=drift_mm_s, shake_mm=shake_mm)
        times_ms = exposed_ms(scenario, shutter_ms, is_blurred=is_blurred)
        print(f"| {name} | {np.median(times_ms):.0f} | {times_ms.max():.0f} |")


def exposed_ms(scenario: Scenario, shutter_ms: float, *, is_blurred: bool) -> NDArray[np.float64]:
    """CPU times of the pairs of a camera, once the leg is moving."""
    rig = make_default_rig()
    row_delay_ns = round(shutter_ms * 1e6 / (rig.height - 1))
    camera = SimulatedCamera(
        World(scenario, replace(rig, row_delay_ns=row_delay_ns)),
        ManualClock(),
        is_stepped=True,
        is_blurred=is_blurred,
    )
    camera.open()
    times_ms = []
    for _ in range(_N_EXPOSED):
        begin = time.process_time()
        camera.read(1.0)
        times_ms.append(1e3 * (time.process_time() - begin))
    # The leg has its speed from the sixth frame on.
    return np.array(times_ms[6:])


def pair_ms(world: World, sensor: SensorModel, number: int) -> tuple[float, float]:
    """CPU time of rendering both eyes, and of exposing both."""
    begin = time.process_time()
    radiance = {eye: world.render(eye, number * 4 * _PERIOD_NS) for eye in ("left", "right")}
    rendered = time.process_time()
    for eye, light in radiance.items():
        sensor.picture(light, eye, number)
    return 1e3 * (rendered - begin), 1e3 * (time.process_time() - rendered)


if __name__ == "__main__":
    main()
