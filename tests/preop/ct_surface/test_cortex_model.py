import numpy as np
import pytest
from scipy.special import ndtr

from navapp.preop.ct_surface.cortex_model import Scan, fit_edges, sample_positions_mm
from tests.reference.cortex_reference import fit_edge

SCAN = Scan(1200.0, 50.0, 0.6, 0.8)
POSITIONS_MM = sample_positions_mm()


def profiles(edge_mm, thickness_mm, blur_mm=0.6, inside_hu=250.0, soft_hu=50.0, fading_mm=0.0):
    """(N, n) a plate of 1,200 HU between soft tissue and spongy bone."""
    edge, thick, inside = (np.atleast_1d(v)[:, None] for v in (edge_mm, thickness_mm, inside_hu))
    outer = ndtr((edge - POSITIONS_MM) / blur_mm)
    inner = ndtr((edge - thick - POSITIONS_MM) / np.hypot(blur_mm, fading_mm))
    return soft_hu * (1.0 - outer) + 1200.0 * (outer - inner) + inside * inner


def half_maximum_mm(profile):
    """Where a profile falls through the middle between its peak and the tissue outside."""
    peak = int(profile.argmax())
    level = 0.5 * (profile[peak] + profile[-1])
    first = peak + int((profile[peak:] < level).argmax())
    share = (profile[first - 1] - level) / (profile[first - 1] - profile[first])
    return POSITIONS_MM[first - 1] + share * (POSITIONS_MM[first] - POSITIONS_MM[first - 1])


@pytest.mark.kernel
@pytest.mark.parametrize("until_mm", [0.75, 3.0])
def test_the_fit_is_that_of_trying_every_plate(until_mm):
    rng = np.random.default_rng(5)
    scan = Scan(1150.0, 40.0, 0.55, 0.8, 0.4)
    many = profiles(rng.uniform(-0.5, 0.5, 5), rng.uniform(0.5, 5.0, 5), inside_hu=200.0)
    # One whose edge is beyond reach.
    many = np.vstack([many, profiles(1.1, 1.5)])
    many += rng.normal(0.0, 25.0, many.shape)
    edges = fit_edges(many, until_mm, 0.55, scan, 0.6)
    used = until_mm >= POSITIONS_MM
    for n, profile in enumerate(many):
        expected = fit_edge(profile[used], POSITIONS_MM[used], 0.55, scan, 0.6)
        found = [
            edges.offset_mm[n], edges.thickness_mm[n], edges.misfit_hu2[n], edges.sharpness[n],
            edges.is_at_end[n],
        ]  # fmt: skip
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5)
    assert not edges.is_at_end[:5].any()


@pytest.mark.parametrize("thickness_mm", [0.6, 0.9, 1.2, 1.6, 2.4, 5.0])
@pytest.mark.parametrize("inside_hu", [-50.0, 250.0])
def test_the_edge_is_found_however_thin_the_plate(thickness_mm, inside_hu):
    edge_mm = np.linspace(-0.9, 0.9, 19)
    plates = profiles(edge_mm, thickness_mm, inside_hu=inside_hu)
    edges = fit_edges(plates, 3.0, 0.6, SCAN, 1.5)
    np.testing.assert_allclose(edges.offset_mm, edge_mm, atol=0.03)
    np.testing.assert_allclose(edges.thickness_mm, thickness_mm, atol=0.1)
    assert not edges.is_at_end.any()
    by_half = np.array([half_maximum_mm(profile) for profile in plates]) - edge_mm
    if thickness_mm < 1.0:
        assert (by_half > 0.07).all()
    if thickness_mm > 2.0:
        assert (np.abs(by_half) < 0.05).all()


def test_noise_moves_the_edge_by_little():
    rng = np.random.default_rng(2)
    edge_mm = rng.uniform(-0.5, 0.5, 1500)
    plates = profiles(edge_mm, rng.uniform(0.6, 4.0, 1500))
    plates += rng.normal(0.0, 25.0, plates.shape)
    error = fit_edges(plates, 3.0, 0.6, SCAN, 1.5).offset_mm - edge_mm
    assert abs(np.median(error)) < 0.02
    assert np.quantile(np.abs(error), 0.95) < 0.15


@pytest.mark.parametrize("edge_mm", [-0.3, 0.0, 0.3])
def test_a_neighbour_across_the_joint_is_not_looked_at(edge_mm):
    gap_mm = 1.3
    plate = profiles(edge_mm, 1.2)
    other = (1200.0 - 50.0) * ndtr((POSITIONS_MM - edge_mm - gap_mm) / 0.6)
    until_mm = edge_mm + 0.5 * gap_mm
    half = fit_edges(plate + other, until_mm, 0.6, SCAN, 0.9)
    assert half.offset_mm[0] == pytest.approx(edge_mm, abs=0.1)
    whole = fit_edges(plate + other, 3.0, 0.6, SCAN, 0.9)
    assert whole.misfit_hu2[0] > 100.0 * half.misfit_hu2[0]


def test_an_edge_beyond_reach_is_said():
    edges = fit_edges(profiles([-1.0, -0.2, 0.2, 1.0], 1.5), 3.0, 0.6, SCAN, 0.6)
    assert list(edges.is_at_end) == [True, False, False, True]
    assert (np.abs(edges.offset_mm) < 0.6 + 1e-9).all()


def test_a_plate_that_fades_is_explained_by_fading():
    plates = profiles([-0.3, 0.0, 0.4], [1.0, 1.5, 2.2], fading_mm=0.8)
    fading = Scan(1200.0, 50.0, 0.6, 0.8, 0.8)
    sharp = fit_edges(plates, 3.0, 0.6, SCAN, 0.9)
    faded = fit_edges(plates, 3.0, 0.6, fading, 0.9)
    np.testing.assert_allclose(faded.offset_mm, [-0.3, 0.0, 0.4], atol=0.01)
    assert (faded.misfit_hu2 < 0.1 * sharp.misfit_hu2).all()


def test_a_sharp_profile_weighs_more_than_a_flat_one():
    plates = np.vstack([profiles(0.0, 3.0), profiles(0.0, 3.0) * 0.3 + 35.0])
    edges = fit_edges(plates, 3.0, 0.6, Scan(1200.0, 50.0, 0.6, 0.8), 1.5)
    assert edges.sharpness[0] > 2.0 * edges.sharpness[1]


def test_blur_lies_between_that_of_the_plane_and_of_the_axis():
    share = np.array([0.0, 0.5, -0.5, 1.0])
    expected = [0.6, np.sqrt(0.75 * 0.36 + 0.25 * 0.64), np.sqrt(0.75 * 0.36 + 0.25 * 0.64), 0.8]
    np.testing.assert_allclose(SCAN.blur_mm(share), expected)


def test_more_profiles_than_one_chunk_are_all_answered():
    edge_mm = np.linspace(-0.4, 0.4, 5000)
    edges = fit_edges(profiles(edge_mm, 1.5), 3.0, 0.6, SCAN, 0.6)
    np.testing.assert_allclose(edges.offset_mm, edge_mm, atol=0.03)
    assert len(edges.thickness_mm) == len(edges.is_at_end) == 5000
