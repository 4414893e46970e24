import numpy as np
import pytest

from sim_devices.exposure import Shutter, expose

MS = 1_000_000
N_ROWS = 720


def shutter(exposure_ms=0.0, rolling_ms=0.0, n_rows=N_ROWS):
    row_delay_ns = round(rolling_ms * MS / (n_rows - 1))
    return Shutter(round(exposure_ms * MS), row_delay_ns, n_rows)


def row_times_ns(one):
    return (np.arange(one.n_rows) - 0.5 * (one.n_rows - 1)) * one.row_delay_ns


ALL = [(8.0, 0.0), (0.0, 15.0), (8.0, 15.0), (0.5, 15.0), (8.0, 1.0)]


@pytest.mark.parametrize("one", [shutter(*times) for times in ALL])
def test_what_hardly_moves_is_rendered_once(one):
    instants_ns, weights = one.weigh(0.2)
    np.testing.assert_array_equal(instants_ns, [0.0])
    np.testing.assert_array_equal(weights, np.ones((1, N_ROWS)))


@pytest.mark.parametrize("one", [shutter(*times) for times in ALL])
@pytest.mark.parametrize("path_px", [0.6, 2.0, 7.3, 30.0])
def test_each_row_takes_the_mean_over_its_own_exposure(one, path_px):
    instants_ns, weights = one.weigh(path_px)
    np.testing.assert_allclose(weights.sum(axis=0), 1.0)
    step_ns = np.diff(instants_ns).max()
    step_px = path_px * step_ns / one.total_ns
    assert step_px <= (0.5 if one.exposure_ns * path_px >= 0.5 * one.total_ns else 0.26) + 0.25
    means_ns = instants_ns @ weights
    np.testing.assert_allclose(means_ns, row_times_ns(one), atol=0.13 * step_ns)
    # No instant counts for a row that is not exposed then, give or take the step around it.
    apart_ns = np.abs(instants_ns[:, None] - row_times_ns(one))
    assert apart_ns[weights > 0.0].max() <= 0.5 * max(one.exposure_ns, step_ns) + 0.5001 * step_ns


def test_the_blur_has_steps_of_half_a_pixel():
    instants_ns, weights = shutter(8.0).weigh(6.0)
    assert len(instants_ns) == 12
    np.testing.assert_allclose(np.diff(instants_ns), 8.0 * MS / 12)
    np.testing.assert_allclose(weights, 1.0 / 12)


def test_without_blur_the_rows_have_steps_of_a_quarter_of_a_pixel():
    instants_ns, _ = shutter(0.0, 15.0).weigh(6.0)
    assert 6.0 / (len(instants_ns) - 1) == pytest.approx(0.25, abs=0.02)
    assert instants_ns[-1] - instants_ns[0] == pytest.approx(15.0 * MS, rel=1e-3)


def test_a_flash_is_not_rendered_for_minutes():
    assert len(shutter(8.0, 15.0).weigh(1e6)[0]) == 160


def edge(time_ns, speed_px_s, n_rows=8, width=64):
    """White left of an edge that is in the middle at time 0."""
    place_px = 0.5 * width + speed_px_s * time_ns * 1e-9
    columns = np.clip(place_px - np.arange(width) + 0.5, 0.0, 1.0)
    return np.broadcast_to(columns[None, :, None], (n_rows, width, 3)).astype(np.float32)


def test_an_edge_is_blurred_as_far_as_it_moves():
    speed_px_s = 10.0 / 0.008
    picture = expose(lambda t, _: edge(t, speed_px_s), shutter(8.0, n_rows=8), 10.0, 0)
    place_px = np.arange(64) - 32.0
    ramp = np.clip(0.5 - place_px / 10.0, 0.0, 1.0)
    np.testing.assert_allclose(picture[4, :, 0], ramp, atol=0.05)


def test_an_edge_is_sheared_from_row_to_row_and_only_asked_rows_are_taken():
    n_rows, speed_px_s = 48, 12.0 / 0.015
    asked = []

    def render(time_ns, rows):
        asked.append(rows)
        picture = edge(time_ns, speed_px_s, n_rows).copy()
        picture[: rows[0]], picture[rows[1] :] = np.nan, np.nan
        return picture

    one = shutter(0.0, 15.0, n_rows)
    picture = expose(render, one, 12.0, 5 * MS)
    places_px = picture[:, :, 0].sum(axis=1) - 0.5
    expected_px = 31.5 + speed_px_s * (row_times_ns(one) * 1e-9 + 0.005) + 0.5
    np.testing.assert_allclose(places_px, expected_px, atol=0.02)
    assert max(last - first for first, last in asked) <= 3
