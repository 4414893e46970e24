"""Matching on the model itself, and fitting, in turns."""

import pytest

from navapp.geometry.transform import RigidTransform
from navapp.tracking.following import Follower, RestSettings
from navapp.tracking.surface_meter import NEAR_BOX, Measurement
from navapp.values import Reason
from tests.registration.shapes import TRUE
from tests.tracking.meters import FakeMeter, Laps, error_mm, frame_at, moved

NEAR = moved((0.3, -0.2, 0.4), (0.2, -0.3, 0.2))
RESTLESS = RestSettings(rest_mm=0.0)


def follower(meter: FakeMeter, settings: RestSettings | None = None) -> Follower:
    return Follower(meter, settings)


@pytest.mark.parametrize("start", [TRUE, NEAR, moved((0.5, 0.5, 0.9), (0.0,) * 3)])
def test_a_near_pose_comes_to_rest_where_the_bone_is(start: RigidTransform) -> None:
    meter = FakeMeter()
    fit = follower(meter).follow(frame_at(start), start)
    assert error_mm(fit.pose) < 0.05
    assert len(meter.asked) <= RestSettings().max_rounds
    assert set(meter.margins) == {NEAR_BOX}


def test_samples_come_first_and_the_whole_model_last() -> None:
    meter = FakeMeter()
    follower(meter).follow(frame_at(NEAR), NEAR)
    n_sampled = meter.asked.count("sampled")
    assert 1 <= n_sampled <= RestSettings().max_sampled
    assert meter.asked[:n_sampled] == ["sampled"] * n_sampled
    assert set(meter.asked[n_sampled:]) == {"on_model"}


def test_at_rest_the_model_is_rendered_once() -> None:
    meter = FakeMeter()
    follower(meter).follow(frame_at(TRUE), TRUE)
    assert meter.asked == ["sampled", "on_model"]
    assert meter.n_rendered == 1


def test_after_a_move_the_model_is_rendered_again() -> None:
    meter = FakeMeter()
    follower(meter).follow(frame_at(NEAR), NEAR)
    assert meter.n_rendered >= 2


@pytest.mark.parametrize("max_rounds", [2, 3, 6])
def test_it_never_takes_more_rounds_than_allowed(max_rounds: int) -> None:
    meter = FakeMeter()
    settings = RestSettings(max_sampled=1, max_rounds=max_rounds, rest_mm=0.0)
    fit = follower(meter, settings).follow(frame_at(TRUE), TRUE)
    assert fit is not None
    assert len(meter.asked) == max_rounds
    assert meter.n_rendered == max_rounds


def test_a_bone_that_keeps_moving_is_measured_everywhere_all_the_same() -> None:
    meter = FakeMeter()
    restless = RestSettings(near_mm=0.0, rest_mm=0.0)
    follower(meter, restless).follow(frame_at(TRUE), TRUE)
    assert meter.asked == ["sampled"] * restless.max_sampled + ["on_model"] * (
        restless.max_rounds - restless.max_sampled
    )


def test_too_few_samples_end_it() -> None:
    meter = FakeMeter()
    meter.share = 0.2
    watch = Laps()
    assert follower(meter).follow(frame_at(TRUE, watch), TRUE, 0.3) is None
    assert meter.asked == ["sampled"]
    assert watch.parts.count("stereo") == 1
    assert follower(meter).follow(frame_at(TRUE), TRUE, 0.1) is not None


def test_out_of_view_there_is_no_fit() -> None:
    meter = FakeMeter()
    meter.is_in_view = False
    watch = Laps()
    assert follower(meter).follow(frame_at(TRUE, watch), TRUE) is None
    assert meter.asked == []
    assert watch.timings.total_ms == 0.0


@pytest.mark.parametrize("blind_after", ["sampled", "on_model"])
@pytest.mark.parametrize("is_in_view", [True, False])
def test_a_matching_without_points_does_not_replace_a_fit(
    is_in_view: bool, blind_after: str
) -> None:
    class GoesBlind(FakeMeter):
        def _near_the_model(self, what: str, *given) -> Measurement:
            measured = super()._near_the_model(what, *given)
            if what == blind_after:
                self.n_points, self.is_in_view = 10, is_in_view
            return measured

    meter = GoesBlind()
    settings = RestSettings(max_sampled=1, rest_mm=0.0)
    fit = follower(meter, settings).follow(frame_at(NEAR), NEAR)
    if blind_after == "sampled":
        assert fit is None
        return
    assert len(fit.measured.cloud) > 10
    assert not fit.estimate.reasons
    assert error_mm(fit.pose) < 0.1


def test_a_bone_that_never_rests_has_not_settled() -> None:
    class Wanders(FakeMeter):
        """The bone runs ahead of every look."""

        def _near_the_model(self, what: str, *given) -> Measurement:
            self.true = moved((0.5 * (-1.0) ** len(self.asked), 0.0, 0.0), (0.0,) * 3)
            return super()._near_the_model(what, *given)

    fit = follower(Wanders()).follow(frame_at(TRUE), TRUE)
    assert Reason.NOT_CONVERGED in fit.estimate.reasons
    fit = follower(FakeMeter()).follow(frame_at(NEAR), NEAR)
    assert Reason.NOT_CONVERGED not in fit.estimate.reasons


def test_what_is_measured_on_the_model_is_told_before_it_is_fitted() -> None:
    meter, told = FakeMeter(), []

    def tell(measured: Measurement, pose: RigidTransform) -> None:
        assert "cloud" not in vars(measured)  # it is made while what is told is checked
        told.append((measured, pose))

    fit = follower(meter, RESTLESS).follow(frame_at(NEAR), NEAR, on_measured=tell)
    assert len(told) == meter.asked.count("on_model") > 1
    assert told[-1][0] is fit.measured
    assert told[-1][1] is not fit.pose
