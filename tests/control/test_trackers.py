"""Trackers are made once, and right, whichever threads ask for them."""

import threading
from dataclasses import replace

import numpy as np
import pytest

from navapp.control.stages import STAGES
from navapp.control.trackers import Trackers
from navapp.geometry.directions import ViewCone
from navapp.resection import FaceMeter
from navapp.tracking import TrackerSettings
from navapp.values import (
    AspectGraph,
    MeasuredFace,
    PoseEstimate,
    Prior,
    Reason,
    ResectionPlane,
    Status,
)
from tests.control.fakes import (
    FakeTracker,
    Script,
    a_frame,
    a_plan,
    a_pose,
    a_rig,
    answer,
    wait_for,
)

OPENING = STAGES[0]
FROM_ABOVE = Prior(cones={"femur": ViewCone(np.array([0.0, 0.0, 1.0]), 30.0)})


class Maker:
    """Makes fake trackers; those without aspects only when the gate is open."""

    def __init__(self) -> None:
        self.made: list[tuple[str, bool]] = []
        self.waiting = threading.Event()
        self.gate = threading.Event()
        self.gate.set()

    def __call__(self, rig, bone, settings, aspects: AspectGraph | None) -> FakeTracker:
        if aspects is None:
            self.waiting.set()
            assert self.gate.wait(10.0)
        self.made.append((bone.name, aspects is not None))
        tracker = FakeTracker(Script(), bone)
        tracker.has_aspects = aspects is not None
        return tracker


@pytest.fixture
def maker() -> Maker:
    return Maker()


def trackers(maker: Maker, prior: Prior = FROM_ABOVE) -> Trackers:
    plan = a_plan()
    # What the plan brings need not be built.
    plan = replace(plan, aspects={"femur": SomeAspects()})
    return Trackers(a_rig(), plan, prior, TrackerSettings(), maker)


class SomeAspects:
    """Stands for edges that were looked at before."""

    def within(self, cone) -> "SomeAspects":
        return self


def test_a_tracker_is_made_once_for_each_bone(maker: Maker) -> None:
    known = trackers(maker)
    assert known.tracker("femur") is known.tracker("femur")
    assert known.tracker("tibia") is not known.tracker("femur")
    assert maker.made == [("femur", False), ("tibia", False)]


def test_a_search_without_a_pose_makes_a_tracker_with_aspects_that_stays(maker: Maker) -> None:
    known = trackers(maker)
    known.tracker("femur")
    for _ in range(2):
        known.register(OPENING, a_frame())
    assert maker.made == [("femur", False), ("femur", True)]
    assert known.tracker("femur").has_aspects


@pytest.mark.parametrize("method", ["paper", "icp"])
def test_the_papers_chains_follow_with_the_views_of_the_plan(maker: Maker, method) -> None:
    plan = replace(a_plan(), aspects={"femur": SomeAspects()})
    settings = TrackerSettings(method, follows_refused=True)
    known = Trackers(a_rig(), plan, FROM_ABOVE, settings, maker)
    assert known.tracker("femur").has_aspects
    assert not known.tracker("tibia").has_aspects
    assert known.follows_refused


@pytest.mark.parametrize("prior", [Prior(), Prior({"femur": a_pose()})])
def test_a_search_from_a_pose_or_a_box_needs_no_aspects(maker: Maker, prior: Prior) -> None:
    known = trackers(maker, prior)
    known.register(OPENING, a_frame())
    assert maker.made == [("femur", False)]


def test_the_tracker_with_aspects_stays_when_the_loop_makes_one_meanwhile(maker: Maker) -> None:
    """A worker searches for the bone, and ends while the loop makes the tracker that follows it."""
    known = trackers(maker)
    maker.gate.clear()
    followed: list[FakeTracker] = []
    loop = threading.Thread(target=lambda: followed.append(known.tracker("femur")))
    loop.start()
    assert maker.waiting.wait(5.0)
    worker = threading.Thread(target=known.register, args=(OPENING, a_frame()))
    worker.start()
    worker.join(5.0)
    assert not worker.is_alive()
    maker.gate.set()
    loop.join(5.0)
    assert followed[0].has_aspects
    assert known.tracker("femur") is followed[0]
    known.register(OPENING, a_frame())
    assert maker.made.count(("femur", True)) == 1


def test_nobody_waits_for_a_tracker_of_another_bone(maker: Maker) -> None:
    known = trackers(maker)
    tibia = known.tracker("tibia")
    maker.gate.clear()
    slow = threading.Thread(target=known.tracker, args=("femur",))
    slow.start()
    assert maker.waiting.wait(5.0)
    assert known.tracker("tibia") is tibia
    maker.gate.set()
    slow.join(5.0)
    wait_for(lambda: ("femur", False) in maker.made, "the femur's tracker")


def test_a_tracker_of_an_older_bone_is_not_used_for_a_newer_one(maker: Maker) -> None:
    """The bone is cut while another thread makes its tracker."""
    plane = ResectionPlane("femur", np.array([0.0, 0.0, 8.0]), np.array([0.0, 0.0, 1.0]))
    known = trackers(maker)
    maker.gate.clear()
    slow = threading.Thread(target=known.tracker, args=("femur",))
    slow.start()
    assert maker.waiting.wait(5.0)
    known.set_bone(known.bone("femur").make("top", plane))
    maker.gate.set()
    slow.join(5.0)
    assert known.tracker("femur").bone.is_removed.any()


class LooseMaker(Maker):
    """Its trackers find a bone of which more than half is gone too loosely."""

    def __call__(self, rig, bone, settings, aspects) -> FakeTracker:
        tracker = super().__call__(rig, bone, settings, aspects)
        is_loose = bone.is_removed.mean() > 0.5
        loose = answer(Status.DEGRADED, Reason.POSE_UNCERTAIN)
        tracker.script = Script(found=[loose if is_loose else answer(Status.OK)])
        return tracker


@pytest.mark.parametrize("is_seen", [True, False])
def test_faces_in_the_same_picture_make_a_loose_registration_a_sure_one(
    monkeypatch: pytest.MonkeyPatch, is_seen: bool
) -> None:
    normal = np.array([0.0, 0.0, 1.0])
    plane = ResectionPlane("femur", np.array([0.0, 0.0, 8.0]), normal, (100.0, 100.0))
    asked: list[PoseEstimate] = []

    def measure(meter, left, right, estimate, planned, others, expected=None):
        asked.append(estimate)
        little = np.diag([2e-6, 2e-6, 2e-4])
        face = MeasuredFace(planned, np.array([0.0, 0.0, 6.0]), little, 0.9)
        return face if is_seen else None

    monkeypatch.setattr(FaceMeter, "measure", measure)
    known = Trackers(a_rig(), a_plan(), Prior({"femur": a_pose()}), TrackerSettings(), LooseMaker())
    known.set_bone(known.bone("femur").make("top", plane))
    (best,) = known.register(OPENING, a_frame())
    assert best.verdict.status is (Status.OK if is_seen else Status.DEGRADED)
    # The pose's own error moves bone and face together.
    assert not asked[0].covariance.any()
    # The session's bone is not changed by what one picture says.
    assert known.bone("femur").unmeasured == ("top",)
