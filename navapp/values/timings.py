"""How long the parts of a frame take."""

import time
from dataclasses import asdict, dataclass
from typing import Literal

Part = Literal["rectify", "stereo", "fill", "estimate", "judge", "nearer_beside", "fill_beside"]


@dataclass(frozen=True, slots=True)
class FrameTimings:
    """How long the parts of one frame took, in real time."""

    rectify_ms: float = 0.0
    stereo_ms: float = 0.0
    fill_ms: float = 0.0
    estimate_ms: float = 0.0
    judge_ms: float = 0.0
    overlay_ms: float = 0.0
    # of the search before the band and of a fill on the helper, beside the other parts.
    nearer_beside_ms: float = 0.0
    fill_beside_ms: float = 0.0

    @property
    def total_ms(self) -> float:
        """Sum of what was done in turn."""
        measured_ms = self.rectify_ms + self.stereo_ms + self.fill_ms
        return measured_ms + self.estimate_ms + self.judge_ms + self.overlay_ms


class Stopwatch:
    """Adds up how long the parts of a frame take, in laps: used by one thread, which never waits.

    A lap lasts from the end of the one before, or from the start, and belongs to one part.
    """

    def __init__(self) -> None:
        self._parts_ms: dict[str, float] = {}
        self._lap_began_ns = time.perf_counter_ns()

    def lap(self, part: Part) -> None:
        """End a lap, and begin the next one."""
        now_ns = time.perf_counter_ns()
        name = f"{part}_ms"
        self._parts_ms[name] = self._parts_ms.get(name, 0.0) + (now_ns - self._lap_began_ns) / 1e6
        self._lap_began_ns = now_ns

    def add(self, timings: FrameTimings) -> None:
        """End a lap whose parts were timed on their own, and begin the next one."""
        self.add_beside(timings)
        self._lap_began_ns = time.perf_counter_ns()

    def add_beside(self, timings: FrameTimings) -> None:
        """What another thread took meanwhile; the lap goes on."""
        for name, part_ms in asdict(timings).items():
            if part_ms:
                self._parts_ms[name] = self._parts_ms.get(name, 0.0) + part_ms

    @property
    def timings(self) -> FrameTimings:
        """The parts so far."""
        return FrameTimings(**self._parts_ms)
