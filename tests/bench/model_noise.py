"""What disparities on the model are off by at the true pose, beside what they claim.

usage: python -m tests.bench.model_noise [--seeds N] [--first SEED]

One frame each of simulated knees whose plans are exact. The claimed sigma is that of the residual
in a window, and in squares with it an error that the residual does not show
(`stereo/chains.py`). What lies on the model but is not the bone (tissue, an edge) is off
by more than a matching step can tell and counts up to three tenths of a pixel.
"""

import argparse

import numpy as np

from navapp.registration import RegistrationModel
from navapp.stereo import MODEL_REFINEMENT
from navapp.tracking.surface_meter import NEAR_BOX, NEAR_VIEW, SurfaceMeter
from navapp.values import Origin
from sim_devices.scenario import Scenario
from tests.knees import SimulatedKnee

FIRST_SEED = 601
_DEPTH_MM = (300.0, 700.0)
_LARGEST_PX = 0.3
_MAD_TO_SIGMA = 1.4826


def main() -> None:
    """Print a line for each knee."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    options = parser.parse_args()
    print("| seed | pixels | median | spread (MAD) | rms | shown by residuals | claimed |")
    print("|---|---|---|---|---|---|---|")
    for seed in range(options.first, options.first + options.seeds):
        print(_row(seed), flush=True)


def _row(seed: int) -> str:
    knee = SimulatedKnee(Scenario(seed=seed, side="left" if seed % 2 else "right"))
    meter = SurfaceMeter(knee.rig, RegistrationModel(knee.bone), _DEPTH_MM)
    frame = knee.frames(1)[0]
    true = meter.geometry.rectified_from_left @ knee.truth(frame)
    pair = meter.rectify(frame.left, frame.right, true, NEAR_VIEW)
    expected = meter.render(pair, true, NEAR_BOX)
    assert expected is not None
    found = meter.measure_on_model(expected).disparity
    is_matched = found.origin == Origin.MATCHED
    off_px = (found.disparity_px - expected.support_px)[is_matched]
    claimed_px = found.sigma_px[is_matched]
    shown_px = np.sqrt(np.maximum(claimed_px**2 - MODEL_REFINEMENT.systematic_px**2, 0.0))
    middle_px = np.median(off_px)
    spread_px = _MAD_TO_SIGMA * np.median(np.abs(off_px - middle_px))
    rms_px = np.sqrt(np.mean(off_px[np.abs(off_px) < _LARGEST_PX] ** 2))
    return (
        f"| {seed} | {len(off_px)} | {middle_px:.3f} px | {spread_px:.3f} px | {rms_px:.3f} px | "
        f"{np.median(shown_px):.3f} px | {np.median(claimed_px):.3f} px |"
    )


if __name__ == "__main__":
    main()
