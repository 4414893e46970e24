"""CPU time of one simulated pair at 1280x720, rendering and sensor apart.

usage: python -m tests.bench.simulator_speed
"""

import time

import numpy as np

from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from sim_devices.world import World

_SCENES = {
    "opening": Scenario(motion="patient"),
    "drilling": Scenario(motion="patient", stage="drilling"),
    "hand in front": Scenario(motion="patient", instrument="sweep"),
}
_PERIOD_NS = 66_666_667
_N_PAIRS = 24


def main() -> None:
    """Print one line a scene: median and largest time of a pair."""
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
