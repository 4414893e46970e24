"""What the operator's commands do to the session, its camera and its display."""

from navapp.control.bone_tracks import Candidate
from navapp.control.camera_link import CameraLink
from navapp.control.commands import (
    Accept,
    Blank,
    Cancel,
    CheckMirror,
    Command,
    ConfirmCross,
    ConfirmCut,
    DistrustRig,
    EnterStage,
    Interrupt,
    NudgeCross,
    Propose,
    Quit,
    Reconnect,
    Register,
    Reject,
    Show,
    ToggleDepth,
    ToggleEye,
    ToggleLayer,
    WithdrawCut,
)
from navapp.control.device_monitor import MonitoredDevices
from navapp.control.display_link import DisplayLink
from navapp.control.eye_preview import EyePreview
from navapp.control.mirror_checking import MirrorChecking
from navapp.control.rig_watch import RigWatch
from navapp.control.session import Session
from navapp.control.stages import stage_by_number
from navapp.control.states import EventLevel, SessionState
from navapp.errors import UsageError
from navapp.overlay import LAYERS
from navapp.values import Plan, Status

_NAVIGATING = SessionState.NAVIGATING


class CommandHandler:
    """Carries commands out, or refuses them with a reason that the operator reads."""

    def __init__(
        self,
        session: Session,
        camera: CameraLink,
        display: DisplayLink,
        rig: RigWatch,
        monitored: MonitoredDevices,
        mirror: MirrorChecking,
        eye: EyePreview,
        plan: Plan,
    ) -> None:
        self._session = session
        self._camera = camera
        self._display = display
        self._rig = rig
        self._monitored = monitored
        self._mirror = mirror
        self._eye = eye
        self._plan = plan

    def handle(self, command: Command) -> None:
        """Do what is asked."""
        match command:
            case Register():
                self._on_register()
            case Propose():
                self._on_propose(command)
            case Cancel():
                self._on_cancel()
            case Accept():
                self._on_accept(command)
            case Reject():
                self._on_reject(command)
            case Blank():
                self._on_blank()
            case Show():
                self._on_show()
            case ToggleDepth():
                self._session.toggle_depth()
            case ToggleEye():
                self._on_toggle_eye()
            case ToggleLayer():
                self._on_toggle_layer(command)
            case CheckMirror():
                self._on_check_mirror()
            case NudgeCross() | ConfirmCross():
                self._on_cross(command)
            case EnterStage():
                self._on_enter_stage(command)
            case ConfirmCut() | WithdrawCut():
                self._on_cut(command)
            case Reconnect():
                self._camera.retry_now()
                self._monitored.restore()
            case Interrupt():
                self._session.forget_sight()
                self._session.fall_back("the camera was lost here when this was recorded")
            case DistrustRig():
                self._rig.distrust(command)
            case Quit():
                self._on_quit()

    def _on_register(self) -> None:
        if self._can_look("register"):
            self._session.begin_registration()

    def _on_propose(self, command: Propose) -> None:
        if not self._can_look("propose"):
            return
        bone = self._session.stage.bone
        if command.left_from_bone.source != bone:
            self._refuse("propose", f"the pose is not one of the {bone}")
            return
        self._session.propose(command.left_from_bone)

    def _on_cancel(self) -> None:
        if self._session.state is not SessionState.REGISTERING:
            self._refuse("cancel", "no registration is running")
            return
        self._session.cancel_registration()

    def _on_accept(self, command: Accept) -> None:
        candidate = self._check_candidate("accept", command.candidate_id)
        if candidate is None:
            return
        if candidate.tracked.verdict.status is Status.LOST:
            self._refuse("accept", "the judge calls this candidate lost")
            return
        self._session.accept(candidate)

    def _on_reject(self, command: Reject) -> None:
        if self._check_candidate("reject", command.candidate_id) is not None:
            self._session.reject()

    def _check_candidate(self, what: str, candidate_id: int | None) -> Candidate | None:
        """The candidate that a decision is about; None, and refused, when it is not the one."""
        candidate = self._session.candidate
        if self._session.state is not SessionState.REVIEW or candidate is None:
            self._refuse(what, "no candidate is under review")
            return None
        if candidate_id not in (None, self._session.candidate_id):
            self._refuse(what, "another candidate is under review now")
            return None
        return candidate

    def _on_blank(self) -> None:
        self._display.blank()
        self._session.add_event("blank", "display blanked by the operator")

    def _on_show(self) -> None:
        if self._display.is_blanked:
            self._display.show_again()
            self._session.add_event("show", "display shown again")

    def _on_toggle_eye(self) -> None:
        if not self._eye.is_possible:
            self._refuse("eye", "there is no simulated mirror; start `navapp run --mirror`")
            return
        self._eye.toggle()
        shown = "what the eye sees in the mirror" if self._eye.is_on else "the video"
        self._session.add_event("eye", f"the screen shows {shown}")

    def _on_toggle_layer(self, command: ToggleLayer) -> None:
        if command.name not in LAYERS:
            self._refuse("layer", f"there is no layer '{command.name}'")
            return
        self._session.toggle_layer(command.name)

    def _on_check_mirror(self) -> None:
        if self._mirror.state is not None:
            self._mirror.give_up()
            self._session.add_event("mirror", "check of the mirror given up", EventLevel.WARNING)
            return
        tracked, is_navigating = self._session.tracked, self._session.state is _NAVIGATING
        if tracked is None or tracked.verdict.status is not Status.OK or not is_navigating:
            self._refuse("mirror", "the check needs an accepted bone whose pose is OK")
            return
        why = self._mirror.begin(tracked, self._plan.bones[tracked.bone].mesh)
        if why:
            self._refuse("mirror", why)
            return
        what = "corner of the board" if self._mirror.is_on_board else "place on the bone"
        self._session.add_event("mirror", f"check of the mirror: move each cross onto its {what}")

    def _on_cross(self, command: NudgeCross | ConfirmCross) -> None:
        tracked = self._session.tracked
        pose = None if tracked is None else tracked.left_from_bone
        if self._mirror.state is None or pose is None:
            self._refuse("mirror", "no check of the mirror is under way")
            return
        is_nudge = isinstance(command, NudgeCross)
        if not (self._mirror.was_cross_seen if is_nudge else self._mirror.is_cross_shown):
            self._refuse("mirror", "the cross is not shown yet")
            return
        if isinstance(command, NudgeCross):
            self._mirror.nudge(command.right_px, command.down_px)
            return
        why = self._mirror.find_moved()
        if why:
            self._refuse("mirror", f"{why}: hold it still, or begin the check again")
            return
        found = self._mirror.confirm(pose, self._session.now_ns)
        if found is not None:
            text = f"mirror checked: off by {found.residual_mm:.2f} mm"
            self._session.add_event("mirror", text)

    def _on_enter_stage(self, command: EnterStage) -> None:
        try:
            stage = self._plan.stage(stage_by_number(command.number))
        except UsageError as error:
            self._refuse("stage", str(error))
            return
        if stage.number != self._session.stage.number:
            self._session.enter_stage(stage)

    def _on_cut(self, command: ConfirmCut | WithdrawCut) -> None:
        try:
            if isinstance(command, ConfirmCut):
                self._session.confirm_cut(command.name)
            else:
                self._session.withdraw_cut(command.name)
        except UsageError as error:
            self._refuse("cut", str(error))

    def _on_quit(self) -> None:
        self._display.darken()
        self._session.end("quit", "session ended by the operator")

    def _can_look(self, what: str) -> bool:
        session = self._session
        if session.rig_error is not None:
            self._refuse(what, session.rig_error.problem)
        elif session.state is SessionState.FAULT:
            self._refuse(what, "the camera is lost")
        elif session.stage.bone not in self._plan.bones:
            self._refuse(what, f"the plan has no model of the {session.stage.bone}")
        else:
            return True
        return False

    def _refuse(self, what: str, why: str) -> None:
        self._session.add_event("refused", f"{what} refused: {why}", EventLevel.WARNING)
