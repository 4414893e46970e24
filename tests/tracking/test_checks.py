"""Checks that run while a pose is fitted."""

import time
from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.bands import begin_on_helper
from navapp.geometry.box import Box
from navapp.geometry.zbuffer import render_rectified
from navapp.stereo import CoarseMap, NearerSearch
from navapp.tracking import checks as checks_module
from navapp.tracking.agreement import compare
from navapp.tracking.checks import PairChecks
from navapp.tracking.surface_meter import Measurement
from navapp.values import DisparityMap, Stopwatch, SurfaceCloud
from tests.registration.shapes import GEOMETRY, TRUE, femur, femur_for_registration
from tests.tracking.rooms import blank_pair, measured_map

MAP = measured_map(femur())
NO_CLOUD = SurfaceCloud(
    np.empty((0, 3)), np.empty(0), np.empty((0, 2), np.int32), np.empty(0, np.uint8)
)

NOTHING_NEARER = NearerSearch(0.0, {})


def measurement(*, is_on_model: bool = False) -> Measurement:
    model = femur_for_registration()
    view = render_rectified(model.rendered_mesh, TRUE, GEOMETRY, MAP.box) if is_on_model else None
    return Measurement(MAP, lambda: NO_CLOUD, 0.0, 11.0, view)


class CoarseMeter:
    """Counts the coarse maps that are asked of it."""

    model, geometry = femur_for_registration(), GEOMETRY

    def __init__(self, fails: bool = False, disparity_px: float = 200.0) -> None:
        self.disparity_px = disparity_px
        self.asked: list[Box | None] = []
        self.ended = 0
        self.fails = fails

    def measure_coarsely(self, pair, pose, box=None) -> CoarseMap:
        assert pose is TRUE
        self.asked.append(box)
        if self.fails:
            time.sleep(0.05)
            self.ended += 1
            raise ValueError("coarsely")
        found = box or Box(0, 0, GEOMETRY.width, GEOMETRY.height)
        shape = found.height, found.width
        return CoarseMap(np.full(shape, self.disparity_px, np.float32), found)


def checks_with(meter: CoarseMeter) -> PairChecks:
    return PairChecks(meter, blank_pair())


def test_a_measurement_whose_check_was_begun_is_checked_once() -> None:
    meter, measured = CoarseMeter(), measurement()
    with checks_with(meter) as checks:
        begun = checks.check(measured, TRUE)
        assert checks.check(measured, TRUE) is begun
        begun.result()
    assert meter.asked == [MAP.box]


def test_another_measurement_has_a_check_of_its_own() -> None:
    meter, begun, other = CoarseMeter(), measurement(), measurement(is_on_model=True)
    with checks_with(meter) as checks:
        checks.check(begun, TRUE)
        assert checks.check(other, TRUE).result().agreement is not None
    assert meter.asked[-1] == MAP.box


def test_the_newest_measurement_is_the_one_that_is_kept() -> None:
    meter, old, new = CoarseMeter(), measurement(), measurement()
    with checks_with(meter) as checks:
        checks.check(old, TRUE)
        kept = checks.check(new, TRUE)
        assert checks.check(new, TRUE) is kept
        assert checks.check(old, TRUE) is not kept


def test_no_check_outlives_its_pair() -> None:
    meter = CoarseMeter(fails=True)
    with checks_with(meter) as checks:
        checks.check(measurement(), TRUE)
        while not meter.asked:
            time.sleep(0.001)
    assert meter.ended == 1


def test_a_check_that_fails_is_told_to_who_asks() -> None:
    measured = measurement()
    with (
        checks_with(CoarseMeter(fails=True)) as checks,
        pytest.raises(ValueError, match="coarsely"),
    ):
        checks.check(measured, TRUE).result()


def test_a_coarse_map_that_reaches_is_used_and_a_smaller_one_is_made_anew() -> None:
    box = MAP.box
    for around, asked in ((box.grow(3), []), (Box(box.x + 1, box.y, 9, 9), [box])):
        meter, known_px = CoarseMeter(), np.full((around.height, around.width), 7.0, np.float32)
        job = begin_on_helper(lambda px=known_px, where=around: CoarseMap(px, where))
        with PairChecks(meter, blank_pair(), job) as checks:
            found = checks.check(measurement(), TRUE).result()
        assert meter.asked == asked
        assert found.coarse_px.shape == MAP.disparity_px.shape
        assert (found.coarse_px == (200.0 if asked else 7.0)).all()


def test_only_what_was_measured_on_the_model_is_compared_with_it() -> None:
    free, on_model = measurement(), measurement(is_on_model=True)
    with checks_with(CoarseMeter()) as checks:
        assert checks.check(free, TRUE).result().agreement is None
        found = checks.check(on_model, TRUE).result()
    model = femur_for_registration()
    assert found.agreement == compare(on_model.rendered, model, MAP, GEOMETRY, found.coarse_px)
    assert found.agreement.coverage > 0.9


@pytest.mark.parametrize("grey", [250, 255])
def test_what_is_seen_through_the_model_beside_clipped_pixels_does_not_count(grey: int) -> None:
    on_model = measurement(is_on_model=True)
    rows, columns = np.nonzero(on_model.rendered.mask)
    middle = slice(int(np.median(rows)), None), slice(int(np.median(columns)), None)
    hole = np.zeros(MAP.origin.shape, dtype=np.bool_)
    hole[middle][:12, :12] = True
    meter, pair = CoarseMeter(disparity_px=20.0), blank_pair()
    pair.left[MAP.box.slices][hole] = grey
    with PairChecks(meter, pair) as checks:
        found = checks.check(replace(on_model, disparity=MAP.only(~hole)), TRUE).result()
    assert found.is_near_clipped.any() == (grey == 255)
    assert (found.agreement.behind_fraction > 0.0) == (grey == 250)


def test_unknown_maps_are_checked_too() -> None:
    nothing = DisparityMap(
        np.full_like(MAP.disparity_px, np.nan), MAP.sigma_px, np.zeros_like(MAP.origin),
        MAP.x, MAP.y,
    )  # fmt: skip
    with checks_with(CoarseMeter()) as checks:
        found = checks.check(Measurement(nothing, lambda: NO_CLOUD, 0.0, 11.0), TRUE).result()
    assert np.isnan(found.health.row_offset_px)


def test_gaps_are_filled_once_for_all_measurements_and_only_when_asked_for() -> None:
    around = MAP.box.grow(3)
    known_px = np.full((around.height, around.width), 7.0, np.float32)
    for nearer in (None, NOTHING_NEARER):
        coarse = begin_on_helper(lambda: CoarseMap(known_px, around))
        with PairChecks(CoarseMeter(), blank_pair(), coarse, nearer) as checks:
            watch = Stopwatch()
            first = checks.surroundings(watch)
            told_ms = watch.timings.fill_beside_ms
            assert checks.surroundings(watch) is first
        assert (first is not None) is (nearer is not None)
        assert watch.timings.fill_beside_ms == told_ms
    assert first.box == around


def test_gaps_of_nothing_are_nothing() -> None:
    coarse = begin_on_helper(lambda: None)
    with PairChecks(CoarseMeter(), blank_pair(), coarse, NOTHING_NEARER) as checks:
        assert checks.surroundings(Stopwatch()) is None


def test_a_fill_that_nobody_asks_for_ends_with_the_checks(monkeypatch) -> None:
    begun, ended = [], []

    def fill_slowly(*_: object) -> None:
        begun.append(True)
        time.sleep(0.05)
        ended.append(True)

    monkeypatch.setattr(checks_module, "fill_surroundings", fill_slowly)
    known_px = np.full((9, 9), 7.0, np.float32)
    coarse = begin_on_helper(lambda: CoarseMap(known_px, Box(0, 0, 9, 9)))
    with PairChecks(CoarseMeter(), blank_pair(), coarse, NOTHING_NEARER) as checks:
        checks.check(measurement(), TRUE).result()
        deadline = time.monotonic() + 10.0
        while not begun and time.monotonic() < deadline:
            time.sleep(0.001)
    assert ended == [True]


def test_nothing_is_filled_before_something_was_measured() -> None:
    coarse = begin_on_helper(lambda: CoarseMap(np.full((9, 9), 7.0, np.float32), Box(0, 0, 9, 9)))
    with PairChecks(CoarseMeter(), blank_pair(), coarse, NOTHING_NEARER) as checks:
        assert checks._filling is None
        checks.check(measurement(), TRUE).result()
        assert checks._filling is not None
