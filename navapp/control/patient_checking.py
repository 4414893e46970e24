"""The check on the patient: takes touched points, asks for more, and tells what they say."""

from collections import deque
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from navapp.control.commands import CheckPicks, TouchPoint
from navapp.control.session import Session
from navapp.control.stages import STAGES
from navapp.control.states import EventLevel, PatientCheck, ToolReading
from navapp.control.tool_watch import ToolWatch
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.tools.patient_check import (
    CheckAnswer,
    CheckResult,
    Touched,
    find_next_place,
    judge_touches,
)
from navapp.tools.tool_on_bone import ToolOnBone
from navapp.values import Pick, Plan, StageSpec

# A tip rests when so many readings lie within so much of each other.
_N_RESTING, _REST_MM = 5, 0.3
# It is waited for so many frames that the tip rests.
_MOST_WAITED_FRAMES = 45
# A registration is good for no more than this, whatever the stage allows.
_MOST_MM = 1.0
# What pressing on tissue, and a model's own error, add to a touch.
_TOUCH_SIGMA_MM = 0.15
# Of a pick in the picture, with the magnifier.
_PICK_SIGMA_PX = 2.0
# Of a landmark of which the plan does not say how well it is known.
_LANDMARK_SIGMA_MM = 0.5
# A touch further off is on something else.
_FARTHEST_MM = 10.0
# Places that the next touch is chosen from; those that face the camera so much can be reached.
_N_PLACES, _LEAST_FACING = 300, 0.35


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
        self._readings: deque[FloatArray] = deque(maxlen=_N_RESTING)
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
        self._readings.clear()

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
            self._keep(self._see_pick(pick, pose))
        self._session.add_event("check", f"{len(picks)} picked landmarks are compared")
        return self._decide(stage)

    def _see_pick(self, pick: Pick, left_from_bone: RigidTransform) -> Touched:
        ray = self._rig.left.rays(np.array([pick.left_px]))[0]
        sight = ray / np.linalg.norm(ray)
        place = left_from_bone.apply(pick.model_mm)
        across = np.linalg.svd(sight[None])[2][1:]
        depth_mm = float(place @ sight)
        off_mm = across @ (depth_mm * sight - place)
        sigma_mm = _PICK_SIGMA_PX * depth_mm / self._rig.left.focal_px
        directions = across @ left_from_bone.rotation
        known_mm = self._landmark_sigma_mm(pick.name)
        sigma_mm = float(np.hypot(sigma_mm, known_mm))
        return Touched(pick.model_mm, directions, off_mm, sigma_mm, pick.name)

    def _landmark_sigma_mm(self, landmark: str) -> float:
        planned = self._plan.content.landmarks.get(landmark)
        known_mm = None if planned is None else planned.sd_mm
        return _LANDMARK_SIGMA_MM if known_mm is None else known_mm

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
        if placed is None:
            self._readings.clear()
        else:
            self._readings.append(placed.tip_mm)
        if placed is not None and self._is_resting():
            self._waiting = None
            return self._take(placed, landmark, stage)
        if left <= 1:
            self._waiting = None
            why = "the tip did not rest" if self._readings else "the pointer is not seen"
            self._session.add_event("check", f"no point was taken: {why}", EventLevel.WARNING)
            return None
        self._waiting = left - 1, landmark
        return None

    def _is_resting(self) -> bool:
        tips = np.array(self._readings)
        return len(tips) == _N_RESTING and float(np.ptp(tips, axis=0).max()) <= _REST_MM

    def _is_of_now(self) -> bool:
        return self._of == self._now

    def _keep(self, touched: Touched) -> None:
        """A landmark counts once: how well it is known does not grow with every touch."""
        if touched.name:
            self._touches = [one for one in self._touches if one.name != touched.name]
        self._touches.append(touched)

    def _take(self, placed: ToolOnBone, landmark: str, stage: StageSpec) -> CheckAnswer | None:
        tip_mm = np.mean(self._readings, axis=0)
        session = self._session
        surface = self._tools.find_surface(placed.bone, session.bone_version, session.bone_surface)
        if landmark:
            touched = self._touch_landmark(placed, tip_mm, landmark)
        else:
            distance_mm, foot_mm, normal = surface.find(tip_mm)
            sigma_mm = float(np.sqrt(normal @ placed.covariance_mm2 @ normal))
            touched = Touched(foot_mm, normal[None], np.array([distance_mm]), _with_touch(sigma_mm))
        off_mm = float(np.linalg.norm(touched.off_mm))
        if off_mm > _FARTHEST_MM:
            text = f"no point was taken: the tip is {off_mm:.0f} mm away"
            session.add_event("check", text, EventLevel.WARNING)
            return None
        self._keep(touched)
        where = landmark or "surface"
        session.add_event("check", f"point {len(self._touches)}, {where}: {off_mm:.2f} mm off")
        return self._decide(stage)

    def _touch_landmark(self, placed: ToolOnBone, tip_mm: FloatArray, landmark: str) -> Touched:
        point_mm = self._plan.landmarks_of(placed.bone)[landmark]
        sigma_mm = float(np.sqrt(np.trace(placed.covariance_mm2) / 3.0))
        sigma_mm = float(np.hypot(sigma_mm, self._landmark_sigma_mm(landmark)))
        return Touched(point_mm, np.eye(3), tip_mm - point_mm, _with_touch(sigma_mm), landmark)

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
        mesh = self._session.bone_surface or self._plan.bones[stage.bone].make_seen_surface()
        used = np.unique(mesh.faces)
        some = used[:: max(1, len(used) // (4 * _N_PLACES))]
        places, normals = mesh.vertices_mm[some], mesh.normals[some]
        in_left = pose.apply(places)
        facing = -np.einsum("nj,nj->n", pose.rotate(normals), in_left)
        is_seen = facing > _LEAST_FACING * np.linalg.norm(in_left, axis=1)
        box = self._seen_box(targets_mm)
        is_seen &= ((places >= box[0]) & (places <= box[1])).all(axis=1)
        if not is_seen.any():
            return None
        places, normals = places[is_seen], normals[is_seen]
        best = find_next_place(self._touches, targets_mm, places, normals, _with_touch(0.1))
        return self._name_place(places[best], stage), places[best]

    def _seen_box(self, targets_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What is laid bare: around the targets and what was touched."""
        points = np.concatenate([targets_mm, [one.point_mm for one in self._touches]])
        return points.min(axis=0) - 15.0, points.max(axis=0) + 15.0

    def _name_place(self, place_mm: FloatArray, stage: StageSpec) -> str:
        landmarks = self._plan.landmarks_of(stage.bone)
        if not landmarks:
            return "at the cross in the picture"
        name = min(landmarks, key=lambda one: float(np.linalg.norm(landmarks[one] - place_mm)))
        away_mm = float(np.linalg.norm(landmarks[name] - place_mm))
        return f"at the cross, {away_mm:.0f} mm from {name.split('/')[-1].replace('_', ' ')}"


_WORST_FIRST = (
    CheckAnswer.FAILED,
    CheckAnswer.OPEN,
    CheckAnswer.CANNOT_TELL,
    CheckAnswer.PASSED,
)


def _names(picks: Sequence[Pick]) -> list[str]:
    return [pick.name for pick in picks]


def _with_touch(sigma_mm: float) -> float:
    return float(np.hypot(sigma_mm, _TOUCH_SIGMA_MM))


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
