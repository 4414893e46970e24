import numpy as np
import pytest
from scipy.special import ndtr

from navapp.preop.ct_surface.cortex_model import Scan, sample_positions_mm
from navapp.preop.ct_surface.scan_estimate import UNKNOWN_SCAN, estimate_scan


def profiles_of(scan, n=400, seed=0, noise_hu=20.0):
    """Plates of a scan in all directions, thick and thin, and the directions."""
    rng = np.random.default_rng(seed)
    share = rng.uniform(-1.0, 1.0, n)
    blur = scan.blur_mm(share)[:, None]
    edge, thick = rng.uniform(-0.3, 0.3, (n, 1)), rng.uniform(0.6, 4.0, (n, 1))
    positions = sample_positions_mm()
    outer = ndtr((edge - positions) / blur)
    inner = ndtr((edge - thick - positions) / np.hypot(blur, scan.fading_mm))
    inside = rng.uniform(100.0, 350.0, (n, 1))
    plates = scan.soft_hu * (1.0 - outer) + scan.cortex_hu * (outer - inner) + inside * inner
    return plates + rng.normal(0.0, noise_hu, plates.shape), share


@pytest.mark.parametrize(
    "scan",
    [
        Scan(1200.0, 50.0, 0.5, 0.5, 0.0),
        Scan(1200.0, 50.0, 0.45, 0.9, 0.0),
        Scan(1500.0, 20.0, 0.8, 0.6, 0.3),
    ],
    ids=["even", "thick slices", "sharp kernel across"],
)
def test_what_the_scanner_did_is_found_again(scan):
    found = estimate_scan(*profiles_of(scan), 0.6, UNKNOWN_SCAN)
    assert found.blur_in_plane_mm == pytest.approx(scan.blur_in_plane_mm, rel=0.1)
    assert found.blur_axial_mm == pytest.approx(scan.blur_axial_mm, rel=0.1)
    assert found.cortex_hu == pytest.approx(scan.cortex_hu, rel=0.03)
    assert found.soft_hu == pytest.approx(scan.soft_hu, abs=5.0)


def test_profiles_that_look_more_blurred_than_others_change_little():
    scan = Scan(1200.0, 50.0, 0.5, 0.7, 0.0)
    plates, share = profiles_of(scan)
    # Across a sharp bend, or a surface that is not yet where it belongs.
    wide, _ = profiles_of(Scan(1200.0, 50.0, 1.2, 1.2, 0.0))
    plates[::3] = wide[::3]
    found = estimate_scan(plates, share, 0.6, UNKNOWN_SCAN)
    assert found.blur_in_plane_mm == pytest.approx(0.5, rel=0.1)
    assert found.blur_axial_mm == pytest.approx(0.7, rel=0.1)


def test_what_is_found_is_what_a_scanner_can_do():
    noise = np.random.default_rng(1).normal(50.0, 20.0, (200, len(sample_positions_mm())))
    found = estimate_scan(noise, np.linspace(-1.0, 1.0, 200), 0.6, UNKNOWN_SCAN)
    assert 0.2 <= found.blur_in_plane_mm <= 1.5
    assert 0.2 <= found.blur_axial_mm <= 2.0
    assert 0.0 <= found.fading_mm <= 1.5
