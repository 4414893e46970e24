"""The check on the patient: takes touched points, asks for more, and tells what they say."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from navapp.control.commands import CheckPicks, TouchPoint
from navapp.control.next_touch import choose_next_touch, name_place
from navapp.control.session import Session
from navapp.control.stages import STAGES
from navapp.control.states import EventLevel, PatientCheck, ToolReading
from navapp.control.tool_watch import ToolWatch
from navapp.control.touches import RestingTip, see_pick, touch_landmark, touch_surface
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray
from navapp.tools.patient_check import (
    CheckAnswer,
    CheckResult,
    Touched,
    judge_touches,
)
from navapp.tools.tool_on_bone import ToolOnBone
from navapp.values import Pick, Plan, StageSpec

# It is waited for so many frames that the tip rests.
_MOST_WAITED_FRAMES = 45
# A registration is good for no more than this, whatever the stage allows.
_MOST_MM = 1.0
# A touch further off is on something else.
_FARTHEST_MM = 10.0


class PatientChecking:
    """The check of a session; changed by commands and frames of its loop alone.

    Args:
        session: that is checked.
        tools: that touch.
        plan: of the operation.
        rig: in whose left picture landmarks are picked.
        valid_minutes: a decided check counts so long.
    """

    def __init__(
        self,
        session: Session,
        tools: ToolWatch,
        plan: Plan,
        rig: StereoRig,
        valid_minutes: float,
    ) -> None:
        self._session, self._tools, self._plan, self._rig = session, tools, plan, rig
        self._valid_ns = round(valid_minutes * 60e9)
        self._stages = tuple(plan.stage(stage) for stage in STAGES)
        self._touches: list[Touched] = []
        self._tip = RestingTip()
        self._waiting: tuple[int, str] | None = None  # frames left, landmark
        self._of: tuple[str, int] = ("", 0)  # bone and registration of the touches
        self._result: CheckResult | None = None
        self._decided_ns = 0  # when
        self._wanted: tuple[str, FloatArray] | None = None
        # Bones with the registrations that a check has found wrong, and none has found right since.
        self._failed: set[tuple[str, int]] = set()

    @property
    def state(self) -> PatientCheck | None:
        """As the operator sees it."""
        if not self._touches and self._waiting is None and not self._has_failed:
            return None
        answer = CheckAnswer.OPEN if self._result is None else self._result.answer
        wanted, wanted_mm = self._wanted or ("", None)
        n = len(self._touches)
        is_old = (
            answer is not CheckAnswer.OPEN
            and self._session.time_ns - self._decided_ns > self._valid_ns
        )
        is_in_force = self._is_of_now() and not is_old
        return PatientCheck(
            answer, self._of[0], n, self._result, wanted, wanted_mm, is_in_force, self._has_failed
        )

    @property
    def _has_failed(self) -> bool:
        return self._now in self._failed

    @property
    def _now(self) -> tuple[str, int]:
        bone = self._session.bone
        return bone, self._session.registration_of(bone)

    @property
    def why_unconfirmed(self) -> str:
        """Why nobody may say that the bone was checked: a check that failed; empty: they may."""
        if not self._has_failed:
            return ""
        return "the check on the patient failed: register again, or check again"

    def why_not(self, command: TouchPoint | CheckPicks) -> str:
        """Why no point can be taken now; empty: it can."""
        if isinstance(command, TouchPoint) and "pointer" not in self._tools.kinds:
            return "no pointer is known: name its file in [tools] pointer"
        if not self._session.is_bone_ok(self._session.stage):
            return "the check needs an accepted bone whose pose is OK"
        known = self._plan.landmarks_of(self._session.bone)
        named = [command.landmark] if isinstance(command, TouchPoint) else _names(command.picks)
        missing = [name for name in named if name and name not in known]
        if missing:
            return f"the plan has no landmark '{missing[0]}' of the {self._session.bone}"
        return ""

    def begin_touch(self, landmark: str) -> None:
        """Take a point as soon as the tip rests."""
        if not self._is_of_now():
            self.forget()
        self._of = self._now
        self._waiting = _MOST_WAITED_FRAMES, landmark
        self._tip = RestingTip()

    def add_picks(self, picks: Sequence[Pick], stage: StageSpec) -> CheckAnswer | None:
        """Landmarks picked in the left picture: what they say.

        A pick says where its landmark is across the line of sight and nothing along it: picks
        alone can find an error, but never pass.
        """
        tracked = self._session.tracked
        pose = None if tracked is None else tracked.left_from_bone
        if pose is None:
            return None
        if not self._is_of_now():
            self.forget()
        self._of = self._now
        for pick in picks:
            self._keep(see_pick(pick, pose, self._rig.left, self._plan))
        self._session.add_event("check", f"{len(picks)} picked landmarks are compared")
        return self._decide(stage)

    def drop(self) -> CheckAnswer | None:
        """Forget the last touch; what the others say, when they decide."""
        self._waiting = None
        if not self._is_of_now():
            self.forget()
        if not self._touches:
            return None
        self._touches.pop()
        self._session.add_event("check", f"point {len(self._touches) + 1} dropped")
        return self._decide(self._session.stage)

    def forget(self) -> None:
        """Begin anew."""
        self._touches, self._result, self._wanted, self._waiting = [], None, None, None

    def add(self, reading: ToolReading | None, stage: StageSpec) -> CheckAnswer | None:
        """A pointer's reading in the newest frame; the answer, once it is decided."""
        if self._waiting is None:
            return None
        left, landmark = self._waiting
        if not self._is_of_now():
            self.forget()
            text = "no point was taken: another bone or registration is in force"
            self._session.add_event("check", text, EventLevel.WARNING)
            return None
        placed = None if reading is None else reading.placed
        tip_mm = self._tip.add(None if placed is None else placed.tip_mm)
        if placed is not None and tip_mm is not None:
            self._waiting = None
            return self._take(placed, tip_mm, landmark, stage)
        if left <= 1:
            self._waiting = None
            why = "the tip did not rest" if self._tip.is_seen else "the pointer is not seen"
            self._session.add_event("check", f"no point was taken: {why}", EventLevel.WARNING)
            return None
        self._waiting = left - 1, landmark
        return None

    def _is_of_now(self) -> bool:
        return self._of == self._now

    def _keep(self, touched: Touched) -> None:
        """A landmark counts once: how well it is known does not grow with every touch."""
        if touched.name:
            self._touches = [one for one in self._touches if one.name != touched.name]
        self._touches.append(touched)

    def _take(
        self, placed: ToolOnBone, tip_mm: FloatArray, landmark: str, stage: StageSpec
    ) -> CheckAnswer | None:
        session = self._session
        if landmark:
            touched = touch_landmark(placed, tip_mm, landmark, self._plan)
        else:
            version, left_of_it = session.bone_version, session.bone_surface
            surface = self._tools.find_surface(placed.bone, version, left_of_it)
            touched = touch_surface(placed, tip_mm, surface)
        off_mm = float(np.linalg.norm(touched.off_mm))
        if off_mm > _FARTHEST_MM:
            text = f"no point was taken: the tip is {off_mm:.0f} mm away"
            session.add_event("check", text, EventLevel.WARNING)
            return None
        self._keep(touched)
        where = landmark or "surface"
        session.add_event("check", f"point {len(self._touches)}, {where}: {off_mm:.2f} mm off")
        return self._decide(stage)

    def _decide(self, stage: StageSpec) -> CheckAnswer | None:
        """What the touches say now; told when it is decided."""
        self._result, self._wanted = None, None
        if not self._touches:
            return None
        self._result = result = self._judge(stage)
        if result.answer is CheckAnswer.OPEN:
            self._wanted = self._choose_next(stage)
            return None
        self._decided_ns = self._session.time_ns
        if result.answer is CheckAnswer.FAILED:
            self._failed.add(self._of)
        elif result.answer is CheckAnswer.PASSED:
            self._failed.discard(self._of)
        level = EventLevel.ALARM if result.answer is CheckAnswer.FAILED else EventLevel.INFO
        self._session.add_event("check", tell_result(result, stage.bone), level)
        return result.answer

    def _judge(self, stage: StageSpec) -> CheckResult:
        """By the targets and tolerances of all stages of the bone: the worst of their answers.

        A check counts for every stage of its bone, so it must hold in each.
        """
        common_mm = self._tools.tip_sigma_mm("pointer")
        results = [
            judge_touches(
                self._touches, self._find_targets(one), min(one.tolerance_mm, _MOST_MM), common_mm
            )
            for one in self._stages
            if one.bone == stage.bone
        ]
        result = min(results, key=lambda one: (_WORST_FIRST.index(one.answer), -one.most_mm))
        is_picked = all(len(one.directions) == 2 for one in self._touches)
        if is_picked and result.answer in (CheckAnswer.OPEN, CheckAnswer.PASSED):
            reason = "picks in one picture tell no depth: touch the bone with a pointer"
            return replace(result, answer=CheckAnswer.CANNOT_TELL, reason=reason)
        return result

    def _find_targets(self, stage: StageSpec) -> FloatArray:
        """Of a stage; of a plan without any, the landmarks of its bone, or its middle."""
        targets_mm: FloatArray = self._plan.targets_of(stage.targets)
        if len(targets_mm):
            return targets_mm
        landmarks = self._plan.landmarks_of(stage.bone)
        if landmarks:
            return np.array(list(landmarks.values()))
        middle_mm: FloatArray = self._plan.bones[stage.bone].mesh.vertices_mm.mean(axis=0)
        return middle_mm[None]

    def _choose_next(self, stage: StageSpec) -> tuple[str, FloatArray] | None:
        """Where the next touch tells most, among what faces the cameras."""
        targets_mm = np.concatenate(
            [self._find_targets(one) for one in self._stages if one.bone == stage.bone]
        )
        tracked = self._session.tracked
        pose = None if tracked is None else tracked.left_from_bone
        if pose is None:
            return None
        surface = self._session.bone_surface or self._plan.bones[stage.bone].make_seen_surface()
        place_mm = choose_next_touch(self._touches, targets_mm, surface, pose)
        if place_mm is None:
            return None
        return name_place(place_mm, self._plan.landmarks_of(stage.bone)), place_mm


# Of the answers of several stages.
_WORST_FIRST = (
    CheckAnswer.FAILED,
    CheckAnswer.OPEN,
    CheckAnswer.CANNOT_TELL,
    CheckAnswer.PASSED,
)


def _names(picks: Sequence[Pick]) -> list[str]:
    return [pick.name for pick in picks]


def tell_result(result: CheckResult, bone: str) -> str:
    """One sentence for people."""
    figures = f"{result.measured_mm:.2f} mm off, {result.most_mm:.2f} at most"
    limit = f"{result.limit_mm:.1f} mm are allowed"
    limit += f"; {result.size_note}" if result.size_note else ""
    match result.answer:
        case CheckAnswer.PASSED:
            return f"{bone} checked on the patient: {figures}; {limit}"
        case CheckAnswer.FAILED:
            return f"{bone}: the check on the patient FAILED: {result.reason} ({figures}; {limit})"
        case CheckAnswer.CANNOT_TELL:
            return f"{bone}: the check cannot tell: {result.reason} ({figures}; {limit})"
    return f"{bone}: {figures}; {limit}; more points are needed"
