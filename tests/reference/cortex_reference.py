"""The edge in one profile, by trying every plate with a least squares fit of the two levels."""

import numpy as np
from scipy.special import ndtr

THICKNESSES_MM = 0.3 * np.arange(1, 21)
SOFT_SD_HU, NOISE_HU, STEP_MM = 80.0, 25.0, 0.1


def plate_misfit(profile, positions, blur_mm, scan, offset_mm, thickness_mm):
    """Sum of squares that is left by the best soft tissue and inside, soft tissue held loosely."""
    outer = ndtr((offset_mm - positions) / blur_mm)
    inner = ndtr((offset_mm - thickness_mm - positions) / np.hypot(blur_mm, scan.fading_mm))
    left = profile - scan.cortex_hu * (outer - inner)
    held = NOISE_HU / SOFT_SD_HU
    columns = np.column_stack([np.append(1.0 - outer, held), np.append(inner, 0.0)])
    values = np.append(left, held * scan.soft_hu)
    levels, *_ = np.linalg.lstsq(columns, values, rcond=None)
    return float(((values - columns @ levels) ** 2).sum())


def fit_edge(profile, positions, blur_mm, scan, reach_mm):
    """Offset, thickness, misfit, its second derivative by the offset, whether at the end."""
    n_steps = round(reach_mm / STEP_MM)
    offsets = STEP_MM * np.arange(-n_steps, n_steps + 1)
    misfits = np.array(
        [
            [plate_misfit(profile, positions, blur_mm, scan, o, t) for t in THICKNESSES_MM]
            for o in offsets
        ]
    )
    by_offset = misfits.min(axis=1)
    best = int(by_offset.argmin())
    middle = min(max(best, 1), len(offsets) - 2)
    # Between the thicknesses that were tried, then between the offsets.
    around = [between(row) for row in misfits[middle - 1 : middle + 2]]
    step, lowest = vertex(*(least for least, _ in around))
    before, here, after = (least for least, _ in around)
    return (
        offsets[middle] + STEP_MM * step,
        0.3 * (1.0 + around[1][1]),
        lowest,
        max(before - 2.0 * here + after, 1e-9) / STEP_MM**2,
        best in (0, len(offsets) - 1),
    )


def between(values):
    """The least of a row between its samples, and where, in steps."""
    best = min(max(int(values.argmin()), 1), len(values) - 2)
    step, least = vertex(*values[best - 1 : best + 2])
    return least, best + step


def vertex(*values):
    """Where the parabola through three values is lowest within a step, and how low it is."""
    parabola = np.polynomial.Polynomial.fit([-1.0, 0.0, 1.0], values, 2).convert()
    tried = [-1.0, 1.0, *(root for root in parabola.deriv().roots() if abs(root) < 1.0)]
    return min(((step, parabola(step)) for step in tried), key=lambda pair: pair[1])
