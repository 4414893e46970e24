"""The snapshot of a session, with the interlocks' answer in it."""

from dataclasses import dataclass
from datetime import date

from navapp.control.camera_link import CameraLink
from navapp.control.device_handlers import DeviceReport
from navapp.control.device_lines import camera_line, display_line, rig_line, with_remedy
from navapp.control.device_monitor import MonitoredDevices
from navapp.control.display_link import DisplayLink
from navapp.control.eye_preview import EyePreview
from navapp.control.gate_keeper import GateKeeper
from navapp.control.interlocks import judge
from navapp.control.mirror_checking import MirrorChecking
from navapp.control.mirror_error import MirrorError
from navapp.control.mirror_judging import MirrorJudge
from navapp.control.patient_checking import PatientChecking
from navapp.control.recorder import SessionRecorder
from navapp.control.rig_watch import RigWatch
from navapp.control.session import Session
from navapp.control.specification import SessionSpecification
from navapp.control.stages import STAGES
from navapp.control.states import (
    CandidateLine,
    DeviceLine,
    Progress,
    SessionState,
    Snapshot,
)
from navapp.control.tool_watch import ToolWatch
from navapp.geometry.box import Box
from navapp.geometry.transform import RigidTransform
from navapp.values import Reason, TrackedFrame

# That tell where a bone lies in the picture.
_N_POINTS_OF_BOX = 300


@dataclass(frozen=True, slots=True, eq=False)
class SnapshotMaker:
    """Makes the snapshots of a session and its devices."""

    session: Session  # what is known
    camera: CameraLink  # in use
    display: DisplayLink  # in use
    monitored: MonitoredDevices  # projector and mirror
    mirror_checking: MirrorChecking  # of what is seen in the mirror
    mirror_judge: MirrorJudge | None  # of guides in it; None: guides lie over video
    eye: EyePreview  # into a simulated mirror
    specification: SessionSpecification  # of the session
    rig_watch: RigWatch  # that watches the rig
    gates: GateKeeper  # between the stages
    tools: ToolWatch  # that follows tools
    patient: PatientChecking  # the check on the patient
    recorder: SessionRecorder | None = None  # of the session; None: it is not kept

    def make(self) -> Snapshot:
        """As of now."""
        session = self.session
        now_ns = session.now_ns
        tracked, picture = session.tracked, session.picture
        shows_eye = picture is not None and picture.is_of_eye
        reports = self.monitored.reports
        rig, plan = self.specification.rig, self.specification.plan
        bone = plan.bones.get(session.stage.bone)
        draft = Snapshot(
            time_ns=now_ns,
            state=session.state,
            stage=session.stage,
            stages=STAGES,
            reasons=(),
            is_blanked=self.display.is_blanked,
            verdict=None if tracked is None else tracked.verdict,
            left_from_bone=None if tracked is None else tracked.left_from_bone,
            candidate_id=session.candidate_id,
            candidates=self._list_candidates(),
            pose_age_ms=session.pose_age_ms(now_ns),
            others=session.other_bones(now_ns),
            limb=session.limb(now_ns),
            valid_ms=self.specification.overlay_valid_ms,
            pose_at_light=self._predict_pose(now_ns),
            picture=None if picture is None else picture.drawn,
            residual_picture=None if picture is None else picture.residuals,
            bone_box=self._find_bone(tracked),
            picture_size_px=(rig.width, rig.height),
            left_picture=None if picture is None else picture.left,
            can_draw_start=self.specification.method == "bimcc",
            landmarks=plan.landmarks_of(session.stage.bone),
            plain_picture=None if picture is None else picture.plain,
            shows_depth=session.shows_depth and not shows_eye,
            has_eye=self.eye.is_possible,
            shows_eye=shows_eye,
            layers=session.layers,
            time_out=self.gates.time_out,
            gate=self.gates.gate,
            refused_stage=self.gates.refused_stage,
            steps=session.steps_of(session.stage),
            bone_version=session.bone_version,
            bone_surface=session.bone_surface,
            tools=self.tools.describe(now_ns),
            patient_check=self.patient.state,
            rates=session.rates(self.camera.n_dropped),
            devices=self._device_lines(reports),
            events=session.events,
            progress=self._progress(),
            rig_name=rig.name,
            is_simulated=self._is_simulated,
            is_recording=self._is_recording,
            plan_name=plan.name,
            plan_digest=plan.digest,
            side="" if bone is None or bone.side is None else bone.side,
            sequence=session.sequence,
            is_bone_planned=bone is not None,
            device_reasons=self._device_reasons(reports),
            has_mirror=self.specification.display is not None,
            mirror_error=self._judge_mirror(tracked, now_ns),
            mirror_reason=self.mirror_checking.find_reason(now_ns),
            cross_check=self.mirror_checking.state,
            is_camera_silent=self.camera.is_silent,
            rig_alarm="" if session.rig_error is None else session.rig_error.problem,
            rows=None if tracked is None else tracked.rows,
            length_check=self.rig_watch.length_check,
            is_over=session.is_over,
        )
        return judge(draft)

    def _list_candidates(self) -> tuple[CandidateLine, ...]:
        session = self.session
        pictures = {} if session.picture is None else session.picture.candidates
        return tuple(
            CandidateLine(
                one.number,
                one.tracked.verdict,
                one is session.candidate,
                pictures.get(one.number),
            )
            for one in session.candidates
        )

    def _device_reasons(self, reports: tuple[DeviceReport, ...]) -> tuple[Reason, ...]:
        """Of projector, mirror and a display that is seen in it."""
        reasons = [report.reason for report in reports if report.reason is not None]
        calibrated = self.specification.display
        if calibrated is not None:
            of_display = calibrated.find_reason(self.display.display.info, date.today())
            reasons += [] if of_display is None else [of_display]
        return tuple(reasons)

    def _predict_pose(self, now_ns: int) -> RigidTransform | None:
        """At the moment in which light from the display is seen; None over video."""
        if self.mirror_judge is None or self.session.state is not SessionState.NAVIGATING:
            return None
        delay_ns = round(self.specification.display_delay_ms * 1e6)
        return self.session.predict_pose(now_ns + delay_ns)

    def _find_bone(self, tracked: TrackedFrame | None) -> Box | None:
        """Where the stage's bone lies in the left picture, as far as it is in it."""
        bone = self.specification.plan.bones.get(self.session.stage.bone)
        if bone is None or tracked is None or tracked.left_from_bone is None:
            return None
        vertices_mm = bone.mesh.vertices_mm
        some_mm = vertices_mm[:: max(1, len(vertices_mm) // _N_POINTS_OF_BOX)]
        camera = self.specification.rig.left
        box = Box.around(camera.project(tracked.left_from_bone.apply(some_mm)))
        box = None if box is None else box.clip(camera.width, camera.height)
        return None if box is None or box.is_empty else box

    def _judge_mirror(self, tracked: TrackedFrame | None, now_ns: int) -> MirrorError | None:
        if self.mirror_judge is None:
            return None
        session = self.session
        made = frozenset(step.name for step in session.steps_of(session.stage) if step.is_made)
        return self.mirror_judge.judge(
            session.stage, session.layers, tracked, now_ns, session.bone_surface, made
        )

    @property
    def _is_simulated(self) -> bool:
        """The pictures are not of this world; a replayed rig still says so by its name."""
        return self.camera.camera.info.is_simulated or self.specification.rig.name.startswith(
            "sim:"
        )

    @property
    def _is_recording(self) -> bool:
        has_stopped = self.recorder is not None and not self.recorder.is_running
        return self.specification.is_recording and not has_stopped

    def _device_lines(self, reports: tuple[DeviceReport, ...]) -> tuple[DeviceLine, ...]:
        return tuple(with_remedy(line) for line in self._list_devices(reports))

    def _list_devices(self, reports: tuple[DeviceReport, ...]) -> tuple[DeviceLine, ...]:
        lines = (
            camera_line(self.camera.camera.info, self.camera.trouble, self.camera.silence),
            display_line(self.display.display.info, self.display.trouble),
            *(report.line for report in reports),
        )
        if self.recorder is not None and (kept := self.recorder.line) is not None:
            lines = (*lines, kept)
        if self.session.rig_error is None and not self.rig_watch.has_board:
            return lines
        problem = "" if self.session.rig_error is None else self.session.rig_error.problem
        watch, now_ns = self.rig_watch, self.session.now_ns
        line = rig_line(
            self.specification.rig.name, problem, watch.length_check, now_ns, watch.unjudged
        )
        return (*lines, line)

    def _progress(self) -> Progress | None:
        share = self.session.search_progress
        if share is not None:
            return Progress(f"searching for the {self.session.stage.bone}", share)
        if self.session.state is SessionState.STARTING:
            return Progress("waiting for the first picture", 0.0)
        return None
