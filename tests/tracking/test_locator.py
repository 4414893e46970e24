"""Matching and fitting in turns."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform
from navapp.registration import RegistrationModel, fit_icp
from navapp.tracking import follower
from navapp.tracking import locator as module
from navapp.tracking.follower import Fit
from navapp.tracking.locator import Locator, LocatorSettings
from navapp.tracking.surface_meter import Margins, Measurement
from navapp.values import BoneModel, DisparityMap, LineTimings, Reason
from tests.registration.shapes import TRUE, as_cloud, grid_mesh
from tests.tracking.rooms import room

# What the meters of these tests are handed is not looked at.
PAIR = None
NO_MAP = DisparityMap(*np.empty((2, 0, 0), np.float32), np.empty((0, 0), np.uint8), 0, 0)
SAMPLED_MS, ON_MODEL_MS, FREELY_MS, RENDER_MS = 1.0, 10.0, 1000.0, 0.1


def height_mm(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 0.008 * x**2 + 0.012 * y**2 + 1.5 * np.sin(x / 8.0) * np.cos(y / 9.0)


MODEL = RegistrationModel(BoneModel("femur", grid_mesh(height_mm), "right"))


def moved(mm: tuple[float, float, float], deg: tuple[float, float, float]) -> RigidTransform:
    """`TRUE`, moved about the bone's centre."""
    return TRUE.moved((*mm, *np.radians(deg)), TRUE.apply(MODEL.centre_mm))


FAR = moved((1.0, -1.0, 4.8), (0.0, 5.0, 0.0))


def error_mm(pose: RigidTransform, true: RigidTransform = TRUE) -> float:
    """Mean displacement of the model's surface."""
    offset_mm = pose.apply(MODEL.points_mm) - true.apply(MODEL.points_mm)
    return float(np.linalg.norm(offset_mm, axis=1).mean())


@dataclass
class FakeExpected:
    """A model at a pose."""

    pose: RigidTransform
    render_ms: float = RENDER_MS


class FakeMeter:
    """Sees a bone that lies at `true`; notes which matchings it was asked for.

    Freely it sees all of it, but too far away by `free_bias_mm`. On the model it answers where the
    model lies within `REACH_MM` of the surface, unless `share` tells it how much to claim.
    """

    REACH_MM = 1.5

    def __init__(self, true: RigidTransform = TRUE, free_bias_mm: float = 0.0) -> None:
        self.true = true
        self.free_bias_mm = free_bias_mm
        self.share: float | None = None
        self.is_in_view = True
        self.n_points = 1200
        self.asked: list[str] = []
        self.n_rendered = 0
        self.margins: list[Margins] = []
        self.baselines: list[bool] = []

    def freely(self, pair, pose, margins, *, is_baseline: bool = False) -> Measurement | None:
        self._note("freely", margins)
        self.baselines.append(is_baseline)
        if not self.is_in_view:
            return None
        points_mm = self._points_mm() + np.array([0.0, 0.0, self.free_bias_mm])
        return self._measurement(points_mm, FREELY_MS, 1.0)

    def expected(self, pair, pose, margins) -> FakeExpected | None:
        self.margins.append(margins)
        self.n_rendered += self.is_in_view
        return FakeExpected(pose) if self.is_in_view else None

    def on_model(self, expected: FakeExpected) -> Measurement:
        return self._near_the_model("on_model", expected, ON_MODEL_MS)

    def sampled(self, expected: FakeExpected) -> Measurement:
        return self._near_the_model("sampled", expected, SAMPLED_MS)

    def _near_the_model(self, what: str, expected: FakeExpected, ms: float) -> Measurement:
        self.asked.append(what)
        points_mm = self._points_mm()
        is_near = self._is_near(points_mm, expected.pose)
        return self._measurement(points_mm[is_near], ms, self._share(is_near))

    def _is_near(self, points_mm: np.ndarray, pose: RigidTransform) -> np.ndarray:
        at_bone = pose.inverse().apply(points_mm)
        index, distance_mm = MODEL.nearest(at_bone)
        offset_mm = np.einsum("ij,ij->i", at_bone - MODEL.points_mm[index], MODEL.normals[index])
        return np.isfinite(distance_mm) & (np.abs(offset_mm) < self.REACH_MM)

    def _share(self, is_near: np.ndarray) -> float:
        return float(is_near.mean()) if self.share is None else self.share

    def _note(self, what: str, margins: Margins) -> None:
        self.asked.append(what)
        self.margins.append(margins)

    def _points_mm(self) -> np.ndarray:
        """Every measurement has another noise."""
        rng = np.random.default_rng(len(self.asked))
        x, y = rng.uniform(-35.0, 35.0, (2, self.n_points))
        noise_mm = rng.normal(0.0, 0.02, (self.n_points, 3))
        return self.true.apply(np.column_stack([x, y, height_mm(x, y)])) + noise_mm

    def _measurement(self, points_mm: np.ndarray, stereo_ms: float, share: float) -> Measurement:
        return Measurement(
            NO_MAP,
            as_cloud(points_mm, 0.1),
            LineTimings(stereo_ms=stereo_ms),
            share,
            11.0,
        )


def locator_of(meter, settings: LocatorSettings | None = None, score=None) -> Locator:
    by_share = score or (lambda fit: fit.measured.answered_share)
    return Locator(meter, MODEL, by_share, settings or LocatorSettings())


@pytest.mark.parametrize(
    "start", [TRUE, moved((0.3, -0.2, 0.4), (0.2, -0.3, 0.2)), moved((0.5, 0.5, 0.9), (0.0,) * 3)]
)
def test_a_pose_that_is_right_stays_on_the_model(start: RigidTransform) -> None:
    meter = FakeMeter(free_bias_mm=5.0)
    fit = locator_of(meter).locate(PAIR, start)
    assert "freely" not in meter.asked
    assert error_mm(fit.pose) < 0.05
    assert fit.pose.target == "left_rect"


@pytest.mark.parametrize("start", [FAR, moved((-2.0, 1.0, -4.5), (-3.0, 3.0, 2.6))])
def test_a_pose_that_is_far_off_is_found_through_a_free_search(start: RigidTransform) -> None:
    meter = FakeMeter()
    fit = locator_of(meter).locate(PAIR, start)
    assert error_mm(start) > 4.0
    assert meter.asked.count("freely") == 1
    # At most a first matching tells that it is elsewhere.
    assert meter.asked.index("freely") <= 1
    assert error_mm(fit.pose) < 0.05


def test_a_search_ends_on_the_model() -> None:
    """What the free measurement is wrong by is gone: the model's own surface is exact."""
    meter = FakeMeter(free_bias_mm=0.4)
    found = locator_of(meter).search(PAIR, FAR, LocatorSettings().search)
    assert meter.asked[0] == "freely"
    assert meter.asked[-1] == "on_model"
    assert meter.asked.count("freely") == 1
    assert error_mm(found.pose) < 0.05


def test_what_does_not_convince_is_searched_from_far_and_nearby() -> None:
    meter = FakeMeter()
    meter.share = 0.35
    locator_of(meter).locate(PAIR, moved((1.0, 0.0, 1.0), (0.0,) * 3))
    followed = [k for k, what in enumerate(meter.asked) if what == "on_model"]
    first = meter.asked.index("freely")
    assert meter.asked.count("freely") == 1
    assert followed[0] < first < followed[-1]


@pytest.mark.parametrize("method", ["bimcc", "icp"])
def test_out_of_view_there_is_no_fit(method: str) -> None:
    meter = FakeMeter()
    meter.is_in_view = False
    locator = locator_of(meter, LocatorSettings(method=method))
    assert locator.locate(PAIR, TRUE) is None
    assert set(meter.asked) <= {"freely"}
    assert locator.search(PAIR, TRUE, Margins(60, 35.0)) is None


def test_the_baseline_makes_one_matching_and_one_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    fits = []

    def spy(*given):
        fits.append(given)
        return fit_icp(*given)

    monkeypatch.setattr(module, "fit_icp", spy)
    monkeypatch.setattr(follower, "fit_bimcc", None)
    settings = LocatorSettings(method="icp")
    start = moved((0.5, -0.5, 1.0), (1.0, 0.0, 0.0))
    for locate, margins in (
        (lambda locator: locator.locate(PAIR, start), settings.tracking),
        (lambda locator: locator.search(PAIR, start, settings.search), settings.search),
    ):
        meter = FakeMeter()
        fits.clear()
        fit = locate(locator_of(meter, settings))
        assert (meter.asked, meter.baselines, meter.margins) == (["freely"], [True], [margins])
        assert len(fits) == fit.n_rounds == 1
        expected = fit_icp(fit.measured.scene, MODEL, start)
        np.testing.assert_array_equal(fit.pose.matrix, expected.camera_from_bone.matrix)


def test_only_the_baseline_asks_for_the_baseline() -> None:
    meter = FakeMeter()
    locator_of(meter).locate(PAIR, FAR)
    assert meter.baselines == [False]


@pytest.mark.parametrize(("sign", "is_search"), [(1.0, True), (-1.0, False)])
def test_the_better_of_staying_and_searching_wins(sign: float, is_search: bool) -> None:
    meter = FakeMeter()
    meter.share = 0.35
    told: list[Fit] = []

    def score(fit: Fit) -> float:
        told.append(fit)
        return sign * fit.timings.stereo_ms

    fit = locator_of(meter, score=score).locate(PAIR, moved((1.0, 0.0, 1.0), (0.0,) * 3))
    # The search compared its two ways before; only it has the free measurement in its time.
    stayed, searched = told[-2:]
    assert stayed.timings.stereo_ms < FREELY_MS < searched.timings.stereo_ms
    assert fit.estimate is (searched if is_search else stayed).estimate


def test_a_bone_half_hidden_where_it_was_expected_is_not_searched() -> None:
    settings = LocatorSettings()
    meter = FakeMeter()
    meter.share = 0.5 * (settings.hidden_share + settings.near_share)
    near = moved((0.0, 0.0, 0.5 * settings.stay_mm), (0.0,) * 3)
    assert error_mm(locator_of(meter).locate(PAIR, near).pose) < 0.05
    assert "freely" not in meter.asked
    # The same share after a longer way is not believed.
    locator_of(meter).locate(PAIR, moved((0.0, 0.0, 1.8 * settings.stay_mm), (0.0,) * 3))
    assert "freely" in meter.asked


def test_too_small_an_answer_is_not_followed() -> None:
    meter = FakeMeter()
    meter.share = LocatorSettings().hidden_share - 0.01
    locator_of(meter).locate(PAIR, TRUE)
    assert meter.asked.index("freely") <= 1


def test_a_bone_lost_during_the_search_leaves_what_stayed() -> None:
    class GoesBlind(FakeMeter):
        def freely(self, *given, **named) -> None:
            super().freely(*given, **named)

    meter = GoesBlind()
    meter.share = 0.35
    fit = locator_of(meter).locate(PAIR, moved((1.0, 0.0, 1.0), (0.0,) * 3))
    assert "freely" in meter.asked
    assert error_mm(fit.pose) < 0.05


def test_a_rest_is_looked_for_on_the_model_and_never_freely() -> None:
    meter = FakeMeter()
    sampled, whole = locator_of(meter).rests(PAIR, moved((0.5, -0.5, 0.8), (0.0,) * 3))
    assert error_mm(sampled.pose) < 0.05
    assert error_mm(whole.pose) < 0.05
    assert "freely" not in meter.asked
    meter.share = LocatorSettings().hidden_share - 0.01
    assert len(list(locator_of(meter).rests(PAIR, TRUE))) == 1
    meter.is_in_view = False
    assert list(locator_of(meter).rests(PAIR, TRUE)) == []


def test_the_baseline_rests_where_its_one_fit_does() -> None:
    meter = FakeMeter()
    (fit,) = locator_of(meter, LocatorSettings(method="icp")).rests(PAIR, TRUE)
    assert (meter.asked, fit.n_rounds) == (["freely"], 1)


def spent_ms(meter: FakeMeter) -> float:
    """What all that it was asked for took."""
    cost = {"freely": FREELY_MS, "on_model": ON_MODEL_MS, "sampled": SAMPLED_MS}
    return sum(cost[what] for what in meter.asked) + RENDER_MS * meter.n_rendered


@pytest.mark.parametrize(
    ("start", "share"), [(TRUE, None), (FAR, None), (moved((1.0, 0.0, 1.0), (0.0,) * 3), 0.35)]
)
def test_the_time_of_every_matching_and_fit_is_told(
    start: RigidTransform, share: float | None
) -> None:
    """Also that of the path which was not taken."""
    for way in ("locate", "search"):
        meter = FakeMeter()
        meter.share = share
        locator = locator_of(meter)
        if way == "locate":
            fit = locator.locate(PAIR, start)
        else:
            fit = locator.search(PAIR, start, LocatorSettings().search)
        assert fit.timings.stereo_ms == pytest.approx(spent_ms(meter))
        assert 0.0 < fit.timings.estimate_ms < fit.timings.total_ms


def test_the_margins_of_tracking_and_of_a_first_search_are_kept_apart() -> None:
    settings = LocatorSettings(tracking=Margins(3, 4.0), search=Margins(50, 60.0))
    meter = FakeMeter()
    locator_of(meter, settings).locate(PAIR, FAR)
    assert set(meter.margins) == {settings.tracking}
    meter = FakeMeter()
    locator_of(meter, settings).search(PAIR, FAR, settings.search)
    assert meter.margins[0] == settings.search
    assert set(meter.margins[1:]) == {settings.tracking}


# --- simulated pictures -------------------------------------------------------------------------


class Listening:
    """A meter that notes which matchings it was asked for."""

    def __init__(self, meter) -> None:
        self.meter, self.asked = meter, []

    def freely(self, *given, **named) -> Measurement | None:
        self.asked.append("freely")
        return self.meter.freely(*given, **named)

    def expected(self, *given):
        return self.meter.expected(*given)

    def on_model(self, *given) -> Measurement:
        self.asked.append("on_model")
        return self.meter.on_model(*given)

    def sampled(self, *given) -> Measurement:
        self.asked.append("sampled")
        return self.meter.sampled(*given)


def seen_knee():
    """A frame's pair, the true pose in the rectified camera, a locator and what it asks for."""
    a = room()
    frame, line = a.frames[0], a.line
    true = line._rectified(a.truth(frame))
    pair, _ = line._rectified_pair(frame.left, frame.right, true)
    meter = Listening(line._meter)
    locator = Locator(meter, line.model, line._fit_judge.score, LocatorSettings())
    return pair, true, locator, meter.asked


def surface_error_mm(pose: RigidTransform, true: RigidTransform) -> float:
    points_mm = room().line.model.points_mm
    return float(np.linalg.norm(pose.apply(points_mm) - true.apply(points_mm), axis=1).mean())


def test_in_pictures_a_right_pose_stays_on_the_model() -> None:
    pair, true, locator, asked = seen_knee()
    fit = locator.locate(pair, true)
    assert set(asked) == {"sampled", "on_model"}
    assert surface_error_mm(fit.pose, true) < 0.3


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_in_pictures_a_pose_5_mm_and_5_deg_off_is_found(sign: float) -> None:
    pair, true, locator, asked = seen_knee()
    shift, turn = np.array([3.0, -2.0, 3.5]), np.array([0.6, -0.5, 0.62])
    twist = sign * np.concatenate([shift, np.radians(5.0) * turn / np.linalg.norm(turn)])
    off = true.moved(twist, true.apply(room().line.centre_mm))
    fit = locator.locate(pair, off)
    assert asked.count("freely") == 1
    assert surface_error_mm(off, true) > 3.0
    assert surface_error_mm(fit.pose, true) < 0.3


def test_in_pictures_a_bone_out_of_view_gives_none() -> None:
    pair, true, locator, _ = seen_knee()
    assert locator.locate(pair, true.moved((900.0, 0, 0, 0, 0, 0), (0.0,) * 3)) is None


def test_a_dark_pair_gives_no_pose_of_its_own() -> None:
    pair, true, locator, asked = seen_knee()
    dark = replace(pair, left=np.zeros_like(pair.left), right=np.zeros_like(pair.right))
    fit = locator.locate(dark, true)
    assert asked.count("freely") == 1
    assert Reason.TOO_FEW_POINTS in fit.estimate.reasons


def test_what_is_measured_next_to_the_expected_pose_is_told() -> None:
    told = []
    fit = locator_of(FakeMeter()).locate(PAIR, TRUE, lambda measured, pose: told.append(measured))
    assert told[-1] is fit.measured
