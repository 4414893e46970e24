"""A display and two cameras made of numbers: what each frame sees, summed up instant by instant."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from calibration.latency.display_area import WatchedCells
from calibration.latency.light_code import Switches, draw_pauses_ms

N_CELLS = 48
# Cells that see the display.
AREA = slice(10, 16)
_N_INSTANTS = 64


@dataclass(frozen=True)
class Bench:
    """The truth; times in ms.

    Attributes:
        delay_ms: from the switch to the light, without the wait for the next refresh.
        right_late_ms: how much later the right eye exposes than its stamps say.
        skew_ms: how much later the right eye exposes, as its stamps do say.
        jitter_ms: standard deviation of the frames' intervals; the stamps know it.
        stamp_noise_ms: standard deviation of what the stamps do not know.
        drift_ms: by which the delay grows from the first to the last switch.
        jump_ms: by which the delay grows in the middle.
        late_share: of the switches that come `late_ms` later.
    """

    delay_ms: float = 40.0
    right_late_ms: float = 0.0
    skew_ms: float = 0.0
    rate_hz: float = 15.0
    exposure_ms: float = 8.0
    refresh_hz: float | None = 59.94
    jitter_ms: float = 0.0
    stamp_noise_ms: float = 0.0
    drop_share: float = 0.0
    drift_ms: float = 0.0
    jump_ms: float = 0.0
    late_share: float = 0.0
    late_ms: float = 35.0
    noise_levels: float = 2.0
    contrast: float = 80.0
    blocked: str = ""
    seconds: float = 30.0
    tone: float = 0.45

    @property
    def true_offset_ms(self) -> float:
        return self.skew_ms + self.right_late_ms

    @property
    def true_delay_ms(self) -> float:
        wait_ms = 500.0 / self.refresh_hz if self.refresh_hz else 0.0
        return self.delay_ms + wait_ms + self.late_share * self.late_ms

    def record(self, seed: int) -> tuple[Switches, WatchedCells, WatchedCells]:
        rng = np.random.default_rng((seed, 77))
        told = np.concatenate([[0.0], np.cumsum(draw_pauses_ms(self.seconds, seed))])
        share = told / told[-1]
        lit = told + self.delay_ms + self.drift_ms * share + self.jump_ms * (share > 0.5)
        lit = lit + self.late_ms * (rng.random(len(told)) < self.late_share)
        if self.refresh_hz:
            period, phase = 1e3 / self.refresh_hz, rng.uniform(0.0, 1e3 / self.refresh_hz)
            lit = np.ceil((lit - phase) / period) * period + phase
        lit = np.maximum.accumulate(lit)
        n = int((told[-1] + 700.0) * self.rate_hz / 1e3)
        middles = rng.uniform(0.0, 1e3 / self.rate_hz) + np.arange(n) * 1e3 / self.rate_hz
        middles = np.sort(middles + rng.normal(0.0, 1.0, n) * self.jitter_ms)
        middles = middles[rng.random(n) >= self.drop_share]
        eyes = []
        for eye, late, claimed in (
            ("left", 0.0, 0.0),
            ("right", self.skew_ms + self.right_late_ms, self.skew_ms),
        ):
            light = self._light(middles + late, lit)
            if self.blocked == eye:
                light = np.zeros_like(light)
            grey = 0.1 + (self.contrast / 255.0) * light**self.tone
            cells = np.full((len(middles), N_CELLS), 0.1)
            cells[:, AREA] = grey[:, None]
            cells = 255.0 * cells + rng.normal(0.0, self.noise_levels, cells.shape)
            stamps = middles + claimed + rng.normal(0.0, 1.0, len(middles)) * self.stamp_noise_ms
            eyes.append(WatchedCells(stamps, np.rint(np.clip(cells, 0, 255)).astype(np.float32)))
        return Switches(told), eyes[0], eyes[1]

    def _light(self, middles: np.ndarray, lit: np.ndarray) -> np.ndarray:
        inside = (np.arange(_N_INSTANTS) + 0.5) / _N_INSTANTS - 0.5
        instants = middles[:, None] + inside * self.exposure_ms
        return (np.searchsorted(lit, instants, side="right") % 2).mean(axis=1)


# What a measurement meets, by name; what is not said is as in `Bench`.
CASES: dict[str, dict[str, Any]] = {
    "15 Hz": {},
    "10 Hz": {"rate_hz": 10.0},
    "25 Hz, 5 ms": {"rate_hz": 25.0, "exposure_ms": 5.0},
    "30 Hz, 30 ms": {"rate_hz": 30.0, "exposure_ms": 30.0},
    "60 Hz": {"rate_hz": 60.0, "exposure_ms": 5.0},
    "display of 144 Hz": {"refresh_hz": 144.0},
    "display without refresh": {"refresh_hz": None, "exposure_ms": 2.0},
    "jitter, a third dropped": {"jitter_ms": 4.0, "stamp_noise_ms": 1.0, "drop_share": 0.33},
    "faint and noisy": {"contrast": 10.0, "noise_levels": 4.0},
    "in step: display of 60 Hz": {"refresh_hz": 60.0},
    "a fifth 35 ms late": {"late_share": 0.2},
    "70 ms more from the middle on": {"jump_ms": 70.0},
    "drift of 20 ms": {"drift_ms": 20.0},
    "5 Hz": {"rate_hz": 5.0},
    "not in view": {"contrast": 0.0},
    "left eye covered": {"blocked": "left"},
}


def drawn_bench(seed: int, **settings: Any) -> Bench:
    """A bench whose delay and offsets nobody chose."""
    rng = np.random.default_rng((seed, 5))
    drawn = {
        "delay_ms": rng.uniform(5.0, 150.0),
        "right_late_ms": rng.uniform(-30.0, 30.0),
        "skew_ms": rng.uniform(-5.0, 5.0),
    }
    return Bench(**(drawn | settings))
