"""Display and screen agree, also when the machine is slow; what they disagree on is an event."""

import numpy as np
import pytest

from navapp.control.commands import Blank, Register
from navapp.control.interlocks import grow_older
from navapp.control.states import Event, Rates, Snapshot
from navapp.values import Reason
from sim_devices.display import SimulatedDisplay
from tests.control.fakes import CLEAR, Bench, navigating

MS = 1_000_000


def lit(bench: Bench) -> bool:
    return bool(bench.display.visible_image()[CLEAR].any())


def shows_guides(snapshot: Snapshot) -> bool:
    """On black pictures nothing else lies in the middle."""
    assert snapshot.picture is not None
    return bool(snapshot.picture[24:72].any())


def told(bench: Bench) -> list[str]:
    return [event.text for event in bench.events if event.kind == "display"]


def test_a_step_that_hangs_shows_no_guides_on_the_screen_either() -> None:
    """The display's picture ends by itself; the screen judges at the moment of showing."""
    bench = navigating(Bench(overlay_valid_ms=300.0))
    assert lit(bench)
    now = bench.controller.snapshot_now()
    assert now.is_navigable
    assert shows_guides(now)
    bench.clock.advance_ns(310 * MS)
    later = bench.controller.snapshot_now()
    assert not lit(bench)
    assert later.reasons == (Reason.POSE_TOO_OLD,)
    assert not shows_guides(later)
    assert later.pose_age_ms == pytest.approx(now.pose_age_ms + 310.0)
    # The clients tell a silent session by the time of its snapshots.
    assert later.time_ns == now.time_ns


@pytest.mark.parametrize("passed_ms", [0, 100, 250, 290, 310, 400, 700])
def test_screen_and_display_change_in_the_same_moment(passed_ms: int) -> None:
    bench = navigating(Bench(overlay_valid_ms=300.0))
    bench.clock.advance_ns(passed_ms * MS)
    age_ms = bench.controller.snapshot_now().pose_age_ms
    assert age_ms is not None
    if abs(age_ms - 300.0) > 1e-6:
        assert bench.controller.snapshot_now().is_navigable == lit(bench)


class SlowDisplay(SimulatedDisplay):
    """It takes its time before it looks whether a picture is still valid."""

    delay_ns = 0

    def show(self, image: np.ndarray, valid_until_ns: int) -> None:
        self._clock.advance_ns(self.delay_ns)
        super().show(image, valid_until_ns)


def test_pictures_that_come_too_late_are_told_once_and_so_is_their_end() -> None:
    bench = navigating(Bench(overlay_valid_ms=300.0, make_display=SlowDisplay))
    bench.display.delay_ns = 400 * MS
    bench.frames(3)
    assert not lit(bench)
    assert not bench.snapshot.is_navigable
    assert not shows_guides(bench.snapshot)
    (late,) = told(bench)
    assert late.startswith("the display stays dark: the picture was 4")
    assert late.endswith("300 ms are allowed")
    bench.display.delay_ns = 0
    bench.frames(2)
    assert lit(bench)
    assert bench.snapshot.is_navigable
    assert told(bench)[1:] == ["pictures are ready in time again"]


def test_guides_that_grow_old_between_two_frames_are_withdrawn_and_told() -> None:
    bench = navigating(Bench(overlay_valid_ms=300.0))
    bench.clock.advance_ns(320 * MS)
    bench.camera.is_silent = True
    bench.frames()
    assert [event for event in bench.events if event.kind == "display"] == [
        Event(*_as_told(bench, f"guides withdrawn: {Reason.POSE_TOO_OLD.value}"))
    ]
    assert not shows_guides(bench.snapshot)


def _as_told(bench: Bench, text: str) -> tuple:
    (event,) = [event for event in bench.events if event.kind == "display"]
    return event.time_ns, "display", text, event.level, event.sequence


def test_a_blank_is_on_the_screen_before_the_step_ends() -> None:
    bench = navigating(Bench())
    bench.controller.submit(Blank())
    now = bench.controller.snapshot_now()
    assert now.reasons[0] is Reason.BLANKED
    assert not shows_guides(now)
    assert not lit(bench)


def test_a_candidate_that_grows_old_is_not_drawn() -> None:
    bench = Bench()
    bench.do(Register())
    bench.frames(2)
    assert bench.snapshot.is_candidate
    assert shows_guides(bench.controller.snapshot_now())
    bench.clock.advance_ns(510 * MS)
    assert not shows_guides(bench.controller.snapshot_now())


def test_no_picture_stays_longer_than_a_pose_is_believed() -> None:
    bench = navigating(Bench(overlay_valid_ms=60_000.0))
    bench.clock.advance_ns(510 * MS)
    assert not bench.controller.snapshot_now().is_navigable
    assert not lit(bench)


def test_an_older_look_changes_nothing_but_ages() -> None:
    bench = navigating(Bench())
    snapshot = bench.snapshot
    same = grow_older(snapshot, snapshot.time_ns)
    assert same.reasons == snapshot.reasons
    assert same.pose_age_ms == snapshot.pose_age_ms
    # A clock that stands before the snapshot's time makes nothing younger.
    before = grow_older(snapshot, snapshot.time_ns - 50 * MS)
    assert before.pose_age_ms == snapshot.pose_age_ms


class SlowMeter:
    """Counts as a computer that makes three pictures a second."""

    is_slow = True

    def add(self, latency_ms: float | None, skew_ns: int) -> None:
        pass

    def rates(self, n_dropped: int) -> Rates:
        latency_ms = 340.0 if self.is_slow else 20.0
        fps = 2.9 if self.is_slow else 30.0
        return Rates(fps, latency_ms, (fps,), (latency_ms,) * 12)


def test_a_slow_computer_is_told_once_and_again_when_it_has_been_fast_meanwhile() -> None:
    bench = navigating(Bench())
    meter = SlowMeter()
    bench.controller._session._meter = meter
    for is_slow in (True, True, False, True):
        meter.is_slow = is_slow
        bench.frames(2)
        bench.clock.advance_ns(600 * MS)
        bench.camera.is_silent = True
        bench.frames()
        bench.camera.is_silent = False
    slow = [text for text in told(bench) if text.startswith("no guides: too slow: 2.9 pictures")]
    assert len(slow) == 2
    assert bench.controller.snapshot_now().reasons == (Reason.TOO_SLOW,)
