"""Matching and fitting in turns, near an expected pose."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform
from navapp.tracking.frame import Fit, Frame
from navapp.tracking.scoring import FitScorer
from navapp.tracking.search import near
from navapp.tracking.search.near import LEAST_FRACTION, SURE_FRACTION, NearSearch
from navapp.tracking.surface_meter import NEAR_BOX, WIDE_BOX, Margins
from navapp.values import Reason
from tests.registration.shapes import TRUE
from tests.tracking.meters import FakeMeter, Laps, Listening, error_mm, frame_at, moved
from tests.tracking.rooms import room

FAR = moved((1.0, -1.0, 4.8), (0.0, 5.0, 0.0))


def search_of(
    meter: FakeMeter,
    score: Callable[[Fit], float] | None = None,
) -> NearSearch:
    by_share = score or (lambda fit: fit.measured.matched_fraction)
    return NearSearch(meter, by_share)


def find(search: NearSearch, start: RigidTransform | Frame) -> Fit | None:
    """Its first answer."""
    return next(search.find(start if isinstance(start, Frame) else frame_at(start)))


def find_on(search: NearSearch, start: RigidTransform | Frame) -> Fit | None:
    """Its last answer, of who asks on after the first."""
    return list(search.find(start if isinstance(start, Frame) else frame_at(start)))[-1]


@pytest.mark.parametrize(
    "start", [TRUE, moved((0.3, -0.2, 0.4), (0.2, -0.3, 0.2)), moved((0.5, 0.5, 0.9), (0.0,) * 3)]
)
def test_a_pose_that_is_right_stays_on_the_model(start: RigidTransform) -> None:
    meter = FakeMeter(free_bias_mm=5.0)
    fit = find(search_of(meter), start)
    assert "freely" not in meter.asked
    assert error_mm(fit.pose) < 0.05
    assert fit.pose.target == "left_rect"


@pytest.mark.parametrize("start", [FAR, moved((-2.0, 1.0, -4.5), (-3.0, 3.0, 2.6))])
def test_a_pose_that_is_far_off_is_found_through_a_free_search(start: RigidTransform) -> None:
    meter = FakeMeter()
    fit = find_on(search_of(meter, score=lambda fit: -error_mm(fit.pose)), start)
    assert error_mm(start) > 4.0
    assert meter.asked.count("freely") == 1
    assert error_mm(fit.pose) < 0.05


def test_a_search_ends_on_the_model() -> None:
    """What the free measurement is wrong by is gone: the model's own surface is exact."""
    meter = FakeMeter(free_bias_mm=0.4)
    found = search_of(meter).find_freely(frame_at(FAR), WIDE_BOX)
    assert meter.asked[0] == "freely"
    assert meter.asked[-1] == "on_model"
    assert meter.asked.count("freely") == 1
    assert error_mm(found.pose) < 0.05


def test_who_asks_on_has_it_searched_from_far_and_nearby() -> None:
    meter = FakeMeter()
    meter.share = 0.35
    find_on(search_of(meter), moved((1.0, 0.0, 1.0), (0.0,) * 3))
    followed = [k for k, what in enumerate(meter.asked) if what == "on_model"]
    first = meter.asked.index("freely")
    assert meter.asked.count("freely") == 1
    assert followed[0] < first < followed[-1]


def test_out_of_view_there_is_no_fit() -> None:
    meter = FakeMeter()
    meter.is_in_view = False
    search = search_of(meter)
    assert find(search, TRUE) is None
    assert set(meter.asked) <= {"freely"}
    assert search.find_freely(frame_at(TRUE), Margins(60, 35.0)) is None


@pytest.mark.parametrize("is_search_better", [True, False])
def test_what_is_found_freely_is_told_where_it_explains_more(is_search_better: bool) -> None:
    meter = FakeMeter()
    meter.share = 0.35
    rested: list[Fit] = []

    def score(fit: Fit) -> float:
        return 0.5 if any(fit is one for one in rested) else float(is_search_better)

    answers = search_of(meter, score=score).find(frame_at(moved((1.0, 0.0, 1.0), (0.0,) * 3)))
    # From samples of the model, then from all of it at once.
    rested += [next(answers), next(answers)]
    assert "freely" not in meter.asked
    assert len(list(answers)) == is_search_better
    assert meter.asked.count("freely") == 1


def test_where_samples_led_to_much_of_the_model_nothing_is_measured_freely() -> None:
    meter = FakeMeter()
    meter.share = SURE_FRACTION + 0.01
    assert len(list(search_of(meter).find(frame_at(TRUE)))) == 2
    assert "freely" not in meter.asked
    meter.share = SURE_FRACTION - 0.01
    list(search_of(meter).find(frame_at(TRUE)))
    assert "freely" in meter.asked


def test_samples_of_which_too_few_are_matched_are_not_followed() -> None:
    meter = FakeMeter()
    meter.share = LEAST_FRACTION - 0.01
    assert error_mm(find(search_of(meter), TRUE).pose) < 0.05
    assert meter.asked[:2] == ["sampled", "on_model"]


def test_a_bone_lost_during_the_search_leaves_what_stayed() -> None:
    class GoesBlind(FakeMeter):
        def measure_freely(self, *given) -> None:
            super().measure_freely(*given)

    meter = GoesBlind()
    meter.share = 0.35
    fit = find_on(search_of(meter), moved((1.0, 0.0, 1.0), (0.0,) * 3))
    assert "freely" in meter.asked
    assert error_mm(fit.pose) < 0.05


def test_a_rest_is_looked_for_on_the_model_and_never_freely() -> None:
    meter = FakeMeter()
    sampled, whole = search_of(meter).find_on_model(frame_at(moved((0.5, -0.5, 0.8), (0.0,) * 3)))
    assert error_mm(sampled.pose) < 0.05
    assert error_mm(whole.pose) < 0.05
    assert "freely" not in meter.asked
    meter.share = LEAST_FRACTION - 0.01
    assert len(list(search_of(meter).find_on_model(frame_at(TRUE)))) == 1
    meter.is_in_view = False
    assert list(search_of(meter).find_on_model(frame_at(TRUE))) == []


@pytest.mark.parametrize(
    ("start", "share"), [(TRUE, None), (FAR, None), (moved((1.0, 0.0, 1.0), (0.0,) * 3), 0.35)]
)
@pytest.mark.parametrize("is_free", [False, True])
def test_the_time_of_every_matching_and_fit_is_told(
    start: RigidTransform, share: float | None, is_free: bool
) -> None:
    """Also that of the path which was not taken."""
    meter, watch = FakeMeter(), Laps()
    meter.share = share
    search, frame = search_of(meter), frame_at(start, watch)
    if is_free:
        search.find_freely(frame, WIDE_BOX)
    else:
        find_on(search, frame)
    assert watch.parts.count("stereo") == len(meter.asked)
    assert watch.parts.count("estimate") >= len(meter.asked)
    assert watch.parts[-1] == "estimate"
    timings = watch.timings
    assert 0.0 < timings.estimate_ms < timings.total_ms
    assert timings.total_ms == timings.stereo_ms + timings.estimate_ms


def test_the_margins_of_tracking_and_of_a_first_search_are_kept_apart() -> None:
    meter = FakeMeter()
    find(search_of(meter), FAR)
    assert set(meter.margins) == {NEAR_BOX}
    meter = FakeMeter()
    search_of(meter).find_freely(frame_at(FAR), WIDE_BOX)
    assert meter.margins[0] == WIDE_BOX
    assert set(meter.margins[1:]) == {NEAR_BOX}


def test_what_is_measured_next_to_the_expected_pose_is_told() -> None:
    told = []
    checks = SimpleNamespace(check=lambda measured, pose: told.append(measured))
    frame = frame_at(TRUE, checks=checks)
    fit = find(search_of(FakeMeter()), frame)
    assert told[-1] is fit.measured


# --- simulated pictures -------------------------------------------------------------------------


def seen_knee() -> tuple[Frame, NearSearch, list[str]]:
    """A frame that starts at the truth, a search in it, and what that asks for."""
    a = room()
    frame, tracker = a.frames[0], a.tracker
    begun = tracker.begin(frame, a.truth(frame))
    meter = Listening(tracker.meter)
    search = NearSearch(meter, FitScorer(tracker.meter).score)
    return begun, search, meter.asked


def surface_error_mm(pose: RigidTransform, true: RigidTransform) -> float:
    points_mm = room().tracker.model.points_mm
    return float(np.linalg.norm(pose.apply(points_mm) - true.apply(points_mm), axis=1).mean())


def test_in_pictures_a_right_pose_stays_on_the_model() -> None:
    frame, search, asked = seen_knee()
    fit = find(search, frame)
    assert set(asked) == {"measure_on_samples", "measure_on_model"}
    assert surface_error_mm(fit.pose, frame.start) < 0.3


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_in_pictures_a_pose_5_mm_and_5_deg_off_is_found(sign: float) -> None:
    frame, search, asked = seen_knee()
    shift, turn = np.array([3.0, -2.0, 3.5]), np.array([0.6, -0.5, 0.62])
    twist = sign * np.concatenate([shift, np.radians(5.0) * turn / np.linalg.norm(turn)])
    off = frame.start.move(twist, frame.start.apply(room().tracker.model.centre_mm))
    fit = find(search, replace(frame, start=off))
    assert asked.count("measure_freely") == 1
    assert surface_error_mm(off, frame.start) > 3.0
    assert surface_error_mm(fit.pose, frame.start) < 0.3


def test_in_pictures_a_bone_out_of_view_gives_none() -> None:
    frame, search, _ = seen_knee()
    away = frame.start.move((900.0, 0, 0, 0, 0, 0), (0.0,) * 3)
    assert find(search, replace(frame, start=away)) is None


def test_a_dark_pair_gives_no_pose_of_its_own() -> None:
    frame, search, asked = seen_knee()
    black = np.zeros_like(frame.pair.left)
    fit = find(search, replace(frame, pair=replace(frame.pair, left=black, right=black)))
    assert asked.count("measure_freely") == 1
    assert Reason.TOO_FEW_POINTS in fit.estimate.reasons


def test_a_small_bone_is_fitted_freely_with_a_narrow_kernel(monkeypatch) -> None:
    a, asked = room(), []
    fit = near.fit_bimcc

    def note(scene, model, start, settings):
        asked.append(settings.widest_mm)
        return fit(scene, model, start, settings)

    monkeypatch.setattr(near, "fit_bimcc", note)
    monkeypatch.setattr(a.tracker.model, "radius_mm", 18.0)
    frame = a.tracker.begin(a.frames[0], a.truth(a.frames[0]))
    a.tracker.near.find_freely(frame, WIDE_BOX)
    assert asked[0] == pytest.approx(6.0)
