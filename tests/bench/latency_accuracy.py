"""Display delay and offset of the eyes against the truth, over drawn displays and cameras.

usage: python -m tests.bench.latency_accuracy [--seeds 40]

Numbers, no pictures: every frame is the light of a display summed up over its exposure.
"""

import argparse

import numpy as np

from calibration.latency.acceptance import measure_accepted_latency
from navapp.errors import ResultError
from tests.calibration.latency.scenes import CASES, drawn_bench


def main() -> None:
    """Print one line a case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=40)
    options = parser.parse_args()
    print(
        "| case | results | delay, rms ms | worst ms | within 95 % | offset, rms ms | worst ms "
        "| within 95 % | refused most often |\n|" + "---|" * 9
    )
    for name, settings in CASES.items():
        _case(name, settings, options.seeds)


def _case(name: str, settings: dict[str, float], n_seeds: int) -> None:
    off_ms, bounds_ms, refused = [], [], []
    for seed in range(n_seeds):
        bench = drawn_bench(seed, **settings)
        try:
            found = measure_accepted_latency(
                *bench.record(seed), refresh_hz=bench.refresh_hz or 240.0
            )
        except ResultError as error:
            refused.append(error.problem.split(":")[0])
            continue
        wrong_offset_ms = found.offset.value_ms - bench.true_offset_ms
        off_ms.append((found.delay.value_ms - bench.true_delay_ms, wrong_offset_ms))
        bounds_ms.append((found.delay.bound_ms, found.offset.bound_ms))
    off, bounds = np.reshape(off_ms, (-1, 2)), np.reshape(bounds_ms, (-1, 2))
    most = max(set(refused), key=refused.count) if refused else ""
    cells = [name, f"{len(off)} of {n_seeds}"]
    for n in range(2):
        if len(off):
            share = np.mean(np.abs(off[:, n]) <= bounds[:, n])
            rms, worst = np.sqrt(np.mean(off[:, n] ** 2)), np.abs(off[:, n]).max()
            cells += [f"{rms:.2f}", f"{worst:.2f}", f"{100 * share:.0f} %"]
        else:
            cells += ["-"] * 3
    print("| " + " | ".join([*cells, most]) + " |", flush=True)


if __name__ == "__main__":
    main()
