"""How other people's trackers were given their settings: some that were tried, side by side.

usage: .venv-peers/bin/python -m tests.bench.peer_settings [--frames N]

Knees of their own (seeds 8401 to 8406, which no evaluation uses), one a stage and one with an
instrument. Every peer starts from the pose that our registration finds in the first frame.
"""

import argparse
from dataclasses import replace
from functools import partial

import numpy as np

from navapp.evaluation.paper.cases import SWEEP_FRAMES, Case, CaseTest
from tests.bench.peer_frames import find_start, score
from tests.bench.peer_stereo import StereoSettings
from tests.bench.peer_trackers import (
    IcpSettings,
    Peer,
    RapidSettings,
    make_gicp,
    make_open3d,
    make_peers,
    make_rapid,
)
from tests.bench.peer_visp import PROGRAM, VispTracker

_FIRST_SEED = 8401
_CASES = (
    Case("man", "opening", "overlay"), Case("woman", "drilling", "patient"),
    Case("adult", "implant", "overlay"), Case("man", "patella", "patient"),
    Case("woman", "spacer", "overlay"), Case("adult", "opening", "instrument"),
)  # fmt: skip
_STEREO = StereoSettings(window_px=5, wls_lambda=None, margin_px=16, margin_mm=30.0, n_points=3000)
_RAPID = RapidSettings(n_lines=150, reach_px=5, n_steps=3, least_response=15.0, agree_px=1.5)


def list_tried() -> dict[str, Peer]:
    """Settings beside those that were chosen."""
    tried: dict[str, Peer] = {f"chosen: {name}": peer for name, peer in make_peers().items()}
    for wls_lambda in (100.0, 1000.0, 8000.0):
        stereo = replace(_STEREO, wls_lambda=wls_lambda)
        tried[f"Open3D, WLS lambda {wls_lambda:g}"] = make_open3d(
            stereo, IcpSettings((3.0,), (0.7,))
        )
    for radii_mm, losses_mm in (((3.0,), (0.5,)), ((3.0,), (1.0,)), ((5.0, 2.0), (2.0, 0.5))):
        name = f"Open3D, no WLS, radii {radii_mm}, losses {losses_mm}"
        tried[name] = make_open3d(_STEREO, IcpSettings(radii_mm, losses_mm))
    for radii_mm in ((3.0, 1.0), (2.0,)):
        tried[f"GICP, radii {radii_mm}"] = make_gicp(_STEREO, IcpSettings(radii_mm))
    for reach_px, agree_px in ((5, 1.0), (8, 1.5), (12, 2.0)):
        rapid = replace(_RAPID, reach_px=reach_px, agree_px=agree_px)
        tried[f"cv2.rapid + RANSAC, reach {reach_px}, agree {agree_px:g}"] = make_rapid(rapid)
    if PROGRAM.is_file():
        for n_faces in (300, 600):
            tried[f"ViSP, {n_faces} faces"] = partial(VispTracker, n_faces=n_faces)
    return tried


def main() -> None:
    """Print a line for each setting."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--frames", type=int, default=20, help="of each test; with an instrument 90"
    )
    n_frames = parser.parse_args().frames
    begun = []
    for number, case in enumerate(_CASES):
        n_all = SWEEP_FRAMES if case.situation == "instrument" else n_frames
        sequence = CaseTest(case, number, _FIRST_SEED + number).render(n_all + 1)
        begun.append((sequence, find_start(sequence)))
    print(
        "| setting | TRE median, mm | TRE 95 %, mm | within 1 mm |\n|---|---|---|---|", flush=True
    )
    for name, peer in list_tried().items():
        told = [frame.tre_mm for sequence, start in begun for frame in score(sequence, start, peer)]
        errors_mm = np.array([np.inf if one is None else one for one in told])
        p95_mm = np.percentile(errors_mm, 95, method="higher")
        print(
            f"| {name} | {np.median(errors_mm):.2f} | {p95_mm:.2f} "
            f"| {100.0 * (errors_mm <= 1.0).mean():.0f} % |",
            flush=True,
        )


if __name__ == "__main__":
    main()
