"""How the settings of other people's trackers were chosen: those in use, and others.

usage: .venv-peers/bin/python -m tests.bench.peer_settings [--frames N]

On six knees (seeds 8401 to 8406, which no evaluation uses): one for each stage, and one with an
instrument. Every peer starts from the pose that our registration finds in the first frame.
"""

import argparse
from dataclasses import replace
from functools import partial

import numpy as np

from navapp.evaluation.paper.cases import SWEEP_FRAMES, Case, CaseTest
from tests.bench.peer_frames import find_start, score
from tests.bench.peer_icp import make_gicp, make_open3d
from tests.bench.peer_rapid import RapidTracker
from tests.bench.peer_trackers import RAPID, STEREO, Peer, make_peers
from tests.bench.peer_visp import PROGRAM, VispTracker

_FIRST_SEED = 8401
_CASES = (
    Case("man", "opening", "overlay"), Case("woman", "drilling", "patient"),
    Case("adult", "implant", "overlay"), Case("man", "patella", "patient"),
    Case("woman", "spacer", "overlay"), Case("adult", "opening", "instrument"),
)  # fmt: skip


def list_settings() -> dict[str, Peer]:
    """Those in use, then others that were tried."""
    tried: dict[str, Peer] = {f"chosen: {name}": peer for name, peer in make_peers().items()}
    for wls_lambda in (100.0, 1000.0, 8000.0):
        stereo = replace(STEREO, wls_lambda=wls_lambda)
        tried[f"Open3D, WLS lambda {wls_lambda:g}"] = make_open3d(stereo, (3.0,), (0.7,))
    for radii_mm, losses_mm in (((3.0,), (0.5,)), ((3.0,), (1.0,)), ((5.0, 2.0), (2.0, 0.5))):
        name = f"Open3D, no WLS, radii {radii_mm}, losses {losses_mm}"
        tried[name] = make_open3d(STEREO, radii_mm, losses_mm)
    for radii_mm in ((3.0, 1.0), (2.0,)):
        tried[f"GICP, radii {radii_mm}"] = make_gicp(STEREO, radii_mm)
    for reach_px, agree_px in ((5, 1.0), (8, 1.5), (12, 2.0)):
        rapid = replace(RAPID, reach_px=reach_px, agree_px=agree_px)
        name = f"cv2.rapid + RANSAC, reach {reach_px}, agree {agree_px:g}"
        tried[name] = partial(RapidTracker, settings=rapid)
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
    starts = []
    for number, case in enumerate(_CASES):
        n_all = SWEEP_FRAMES if case.situation == "instrument" else n_frames
        sequence = CaseTest(case, number, _FIRST_SEED + number).render(n_all + 1)
        starts.append((sequence, find_start(sequence)))
    print(
        "| setting | TRE median, mm | TRE 95 %, mm | within 1 mm |\n|---|---|---|---|", flush=True
    )
    for name, peer in list_settings().items():
        told = [
            frame.tre_mm for sequence, start in starts for frame in score(sequence, start, peer)
        ]
        errors_mm = np.array([np.inf if one is None else one for one in told])
        p95_mm = np.percentile(errors_mm, 95, method="higher")
        print(
            f"| {name} | {np.median(errors_mm):.2f} | {p95_mm:.2f} "
            f"| {100.0 * (errors_mm <= 1.0).mean():.0f} % |",
            flush=True,
        )


if __name__ == "__main__":
    main()
