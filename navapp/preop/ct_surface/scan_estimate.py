"""Density of cortex and blur of a scanner, from the profiles of one CT."""

import numpy as np

from navapp.geometry.transform import FloatArray
from navapp.preop.ct_surface.cortex_model import STEP_MM, Scan, fit_edges, sample_positions_mm

# What most clinical CTs of bone are like.
UNKNOWN_SCAN = Scan(1200.0, 50.0, 0.6, 0.7, 0.3)
_STEPS = (-0.1, -0.1, 0.2)
_LOWEST, _HIGHEST = (0.2, 0.2, 0.0), (1.5, 2.0, 1.5)
_MOST_TRIALS = 60
# Profiles of about the same blur share a model.
_GROUPS = 4
# Profiles that no plate explains well (an osteophyte, a vessel, a sharp bend) say nothing about the
# scanner, and make its blur look wider.
_EXPLAINED = 0.5
# Where cortex is thicker than the blur is wide it shows its density: over a millimetre of the
# densest profiles.
_PLATEAU_MM, _DENSEST = 1.0, 0.95


def estimate_scan(
    profiles_hu: FloatArray, axial_fraction: FloatArray, reach_mm: float, start: Scan
) -> Scan:
    """The density of thick cortex, and the blurs that explain many profiles best with it.

    Density is looked at and not fitted: with thin plates a denser one that is thinner explains a
    profile as well, and the edge would follow whichever was guessed.

    Args:
        profiles_hu: (N, n) at `sample_positions_mm`, spread over the bones.
        axial_fraction: (N,) cosines of their directions with the slices' normal.
        reach_mm: how far the edges may be from the profiles' zeros.
        start: a guess.
    """
    from scipy.optimize import minimize

    soft_hu, cortex_hu = float(np.median(profiles_hu[:, -1])), _plateau_hu(profiles_hu)
    groups = np.array_split(np.argsort(np.abs(axial_fraction)), _GROUPS)
    until_mm = float(sample_positions_mm()[-1])

    def scan_of(parameters: FloatArray) -> Scan:
        plane, axial, fading = np.clip(parameters, _LOWEST, _HIGHEST)
        return Scan(cortex_hu, soft_hu, float(plane), float(axial), float(fading))

    def misfit(parameters: FloatArray) -> float:
        scan = scan_of(parameters)
        left = np.concatenate([
            fit_edges(
                profiles_hu[group], until_mm,
                float(scan.blur_mm(axial_fraction[group]).mean()), scan, reach_mm,
            ).misfit_hu2
            for group in groups
        ])  # fmt: skip
        outside = float(np.abs(parameters - np.clip(parameters, _LOWEST, _HIGHEST)).sum())
        best = np.sort(left)[: int(_EXPLAINED * len(left)) + 1]
        return float(best.mean()) * (1.0 + outside)

    first = np.array([start.blur_in_plane_mm, start.blur_axial_mm, start.fading_mm])
    found = minimize(
        misfit, first, method="Nelder-Mead",
        options={
            "maxfev": _MOST_TRIALS,
            "initial_simplex": np.vstack([first, first + np.diag(_STEPS)]),
        },
    )  # fmt: skip
    return scan_of(found.x)


def _plateau_hu(profiles_hu: FloatArray) -> float:
    n = round(_PLATEAU_MM / STEP_MM) + 1
    windows = np.lib.stride_tricks.sliding_window_view(profiles_hu, n, axis=1)
    return float(np.quantile(windows.mean(axis=2).max(axis=1), _DENSEST))
