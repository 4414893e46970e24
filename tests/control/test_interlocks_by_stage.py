"""Every cause that must hide guides, in every stage: dark in time, and the right reason told."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from drivers.fixed_mirror import FixedMirror
from drivers.no_projector import NoProjector
from navapp.control.commands import (
    Blank,
    ConfirmCondition,
    ConfirmStep,
    DistrustRig,
    EnterStage,
    OverrideGate,
    Register,
    WithdrawCondition,
)
from navapp.control.device_handlers import MIRROR_TOLERANCE_DEG
from navapp.control.stages import STAGES
from navapp.errors import DeviceLost, DeviceTimeout
from navapp.values import Plan, Reason, Status, SurgicalContent
from tests.control.cuts import TOP
from tests.control.fakes import DOUBTED, LOST, PERIOD_NS, Bench, a_plan, a_pose, answer

VALID_MS = 300.0
BONES = tuple(dict.fromkeys(stage.bone for stage in STAGES))


def _answers(bench: Bench, status: Status, *reasons: Reason) -> None:
    bench.script.tracked = answer(status, *reasons, pose=a_pose(bench.snapshot.stage.bone))


def _unplug(bench: Bench) -> None:
    bench.camera.error = DeviceLost("unplugged")


def _silence(bench: Bench) -> None:
    bench.camera.is_silent = True


class Turnable(FixedMirror):
    """Stands where it is put."""

    angle_deg = 45.0

    def position_deg(self) -> float:
        return self.angle_deg


class Silent(NoProjector):
    """Answers until it does not."""

    is_silent = False

    def status(self):
        if self.is_silent:
            raise DeviceTimeout("the projector does not answer")
        return super().status()


def _turn_mirror(bench: Bench) -> None:
    bench.mirror.angle_deg = 45.0 + 2.0 * MIRROR_TOLERANCE_DEG


def _silence_projector(bench: Bench) -> None:
    bench.projector.is_silent = True


def _cut(bench: Bench) -> None:
    """What was judged by the whole bone says nothing of what is left of it."""
    bench.do(ConfirmStep(f"top of the {bench.snapshot.stage.bone}"))


CAUSES: dict[str, tuple[Callable[[Bench], object], Reason]] = {
    "bone lost": (lambda bench: _answers(bench, LOST.verdict.status, Reason.COVERAGE_LOW),
                  Reason.BONE_LOST),
    "pose not good enough": (lambda bench: _answers(bench, DOUBTED.verdict.status,
                                                    Reason.TRE_TOO_LARGE), Reason.TRE_TOO_LARGE),
    "camera unplugged": (_unplug, Reason.DEVICE_FAULT),
    "camera silent": (_silence, Reason.CAMERA_SILENT),
    "blanked": (lambda bench: bench.do(Blank()), Reason.BLANKED),
    "rig moved": (lambda bench: bench.do(DistrustRig("the board looks longer")), Reason.RIG_MOVED),
    "time-out withdrawn": (lambda bench: bench.do(WithdrawCondition("side")),
                           Reason.TIME_OUT_OPEN),
    "mirror turned away": (_turn_mirror, Reason.MIRROR_AWAY),
    "projector silent": (_silence_projector, Reason.PROJECTOR_LOST),
    "bone cut": (_cut, Reason.BONE_LOST),
    "another registration": (lambda bench: bench.do(Register()), Reason.NOT_NAVIGATING),
}  # fmt: skip


def _plan() -> Plan:
    """With a cut of every bone."""
    planes = {f"top of the {bone}": replace(TOP, bone=bone) for bone in BONES}
    return replace(a_plan(*BONES), content=SurgicalContent(planes=planes), digest="")


def guided(number: int) -> Bench:
    """Guides are shown in a stage, on its own bone."""
    mirror, projector = Turnable(45.0), Silent()
    bench = Bench(
        plan=_plan(), has_gates=True, overlay_valid_ms=VALID_MS, mirror=mirror, projector=projector
    )
    bench.mirror, bench.projector = mirror, projector
    bench.frames(1)
    for name in ("patient", "side", "plan"):
        bench.do(ConfirmCondition(name))
    if number > 1:
        bench.do(EnterStage(number))
        bench.do(OverrideGate(number, "a test"))
    bench.script.found = [answer(pose=a_pose(bench.snapshot.stage.bone))]
    _answers(bench, Status.OK)
    bench.do(Register())
    bench.frames(1)
    bench.accept()
    bench.frames(2)
    assert bench.snapshot.stage.number == number
    assert bench.shows_guides
    return bench


@pytest.mark.parametrize("number", [stage.number for stage in STAGES])
@pytest.mark.parametrize(("deed", "reason"), CAUSES.values(), ids=CAUSES)
def test_every_cause_hides_guides_in_every_stage(
    number: int, deed: Callable[[Bench], object], reason: Reason
) -> None:
    bench = guided(number)
    seen_ns = bench.results[-1].frame.captured_ns
    deed(bench)
    # A cut hides them until the next frame is judged by what is left.
    told = bench.snapshot.reasons
    while bench.shows_guides:
        assert bench.clock.now_ns() - seen_ns <= VALID_MS * 1e6 + PERIOD_NS
        bench.controller.step(timeout_s=0.02)
    # Whatever is told first, this is among it.
    for _ in range(60):
        if reason in told or reason in bench.snapshot.reasons:
            break
        bench.controller.step(timeout_s=0.02)
    assert reason in (*told, *bench.snapshot.reasons)
    assert not bench.shows_guides


@pytest.mark.parametrize("number", [stage.number for stage in STAGES])
def test_a_pose_that_grows_old_hides_guides_in_every_stage(number: int) -> None:
    bench = guided(number)
    bench.clock.advance_ns(round(VALID_MS * 1e6) + 1)
    assert Reason.POSE_TOO_OLD in bench.controller.snapshot_now().reasons
    assert not bench.shows_guides
