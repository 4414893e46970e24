"""What the operator's commands do to the session, its camera and its display."""

from navapp.control.camera_link import CameraLink
from navapp.control.commands import (
    PROJECTOR_SETTINGS,
    Accept,
    Blank,
    Cancel,
    CheckMirror,
    CheckPicks,
    ChooseCandidate,
    Command,
    ConfirmCondition,
    ConfirmCross,
    ConfirmStep,
    DistrustRig,
    DropPoint,
    EnterStage,
    ForgetPoints,
    Interrupt,
    NudgeCross,
    OverrideGate,
    Propose,
    Quit,
    ReadThickness,
    Reconnect,
    Register,
    Reject,
    SetProjector,
    Show,
    StepCommand,
    ToggleDepth,
    ToggleEye,
    ToggleLayer,
    TouchPoint,
    WithdrawCondition,
    WithdrawStep,
)
from navapp.control.device_monitor import MonitoredDevices
from navapp.control.display_link import DisplayLink
from navapp.control.eye_preview import EyePreview
from navapp.control.gate_keeper import GateKeeper
from navapp.control.mirror_checking import MirrorChecking
from navapp.control.patient_checking import PatientChecking
from navapp.control.rig_watch import RigWatch
from navapp.control.rules import why_refused
from navapp.control.session import Session
from navapp.control.stages import stage_by_number
from navapp.control.states import EventLevel, Snapshot
from navapp.errors import UsageError
from navapp.values import Plan, StageSpec

# What a refusal calls the command.
_NAMES: dict[type[Command], str] = {
    Register: "register",
    Propose: "propose",
    Cancel: "cancel",
    Accept: "accept",
    Reject: "reject",
    ChooseCandidate: "candidate",
    Show: "show",
    ToggleEye: "eye",
    ToggleLayer: "layer",
    CheckMirror: "mirror",
    NudgeCross: "mirror",
    ConfirmCross: "mirror",
    EnterStage: "stage",
    OverrideGate: "override",
    Reconnect: "reopen",
    SetProjector: "projector",
    DistrustRig: "rig",
}


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
        gates: GateKeeper,
        patient: PatientChecking,
    ) -> None:
        self._session, self._gates, self._patient = session, gates, patient
        self._camera = camera
        self._display = display
        self._rig = rig
        self._monitored = monitored
        self._mirror = mirror
        self._eye = eye
        self._plan = plan

    def handle(self, command: Command, snapshot: Snapshot) -> None:
        """Do what is asked, in a session as the snapshot has it."""
        why = why_refused(command, snapshot)
        if why:
            self._refuse(_NAMES[type(command)], why)
            return
        session = self._session
        match command:
            case Register():
                session.begin_registration(command.start)
            case Propose():
                session.propose(command.left_from_bone)
            case Cancel():
                session.cancel_registration()
            case Accept():
                session.accept()
            case Reject():
                session.reject()
            case ChooseCandidate():
                session.choose_candidate(command.step)
            case Blank():
                self._on_blank()
            case Show():
                self._display.show_again()
                session.add_event("show", "display shown again")
            case ToggleDepth():
                session.toggle_depth()
            case ToggleEye():
                self._on_toggle_eye()
            case ToggleLayer():
                session.toggle_layer(command.name)
            case CheckMirror():
                self._on_check_mirror()
            case NudgeCross() | ConfirmCross():
                self._on_cross(command)
            case EnterStage():
                self._gates.enter(self._stage(command.number))
            case OverrideGate():
                self._gates.override(self._stage(command.number), command.reason)
            case (
                ConfirmStep() | WithdrawStep() | ReadThickness()
                | ConfirmCondition() | WithdrawCondition()
            ):  # fmt: skip
                self._on_word(command)
            case TouchPoint() | CheckPicks() | DropPoint() | ForgetPoints():
                self._on_touch(command)
            case Reconnect():
                session.add_event("reopen", "lost devices are opened again")
                self._camera.retry_now()
                self._monitored.restore()
            case SetProjector():
                session.add_event("projector", f"projector: {PROJECTOR_SETTINGS[command.name]}")
                self._monitored.set_projector(command.name)
            case Interrupt():
                session.forget_sight()
                session.fall_back("the camera was lost here when this was recorded")
            case DistrustRig():
                self._rig.distrust(command)
            case Quit():
                self._on_quit()

    def _on_blank(self) -> None:
        self._display.blank()
        self._session.add_event("blank", "display blanked by the operator")

    def _on_toggle_eye(self) -> None:
        self._eye.toggle()
        shown = "what the eye sees in the mirror" if self._eye.is_on else "the video"
        self._session.add_event("eye", f"the screen shows {shown}")

    def _on_check_mirror(self) -> None:
        if self._mirror.state is not None:
            self._mirror.give_up()
            self._session.add_event("mirror", "check of the mirror given up", EventLevel.WARNING)
            return
        if (tracked := self._session.tracked) is None:
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

    def _on_word(self, command: StepCommand | ConfirmCondition | WithdrawCondition) -> None:
        """A person says what was made, or what is so."""
        session = self._session
        try:
            match command:
                case ConfirmStep():
                    session.confirm_step(command.name)
                case WithdrawStep():
                    session.withdraw_step(command.name)
                case ReadThickness():
                    session.read_thickness(command.name, command.thickness_mm)
                case ConfirmCondition():
                    self._gates.confirm(command.name)
                case WithdrawCondition():
                    self._gates.withdraw(command.name)
        except UsageError as error:
            is_step = isinstance(command, StepCommand)
            self._refuse("step" if is_step else "gate", str(error))

    def _on_touch(self, command: TouchPoint | CheckPicks | DropPoint | ForgetPoints) -> None:
        """A point of the check on the patient."""
        if isinstance(command, DropPoint):
            answer = self._patient.drop()
            if answer is not None:
                self._gates.take_check(answer)
        elif isinstance(command, ForgetPoints):
            self._patient.forget()
            self._session.add_event("check", "check on the patient begun anew")
        elif why := self._patient.why_not(command):
            self._refuse("check", why)
        elif isinstance(command, CheckPicks):
            answer = self._patient.add_picks(command.picks, self._session.stage)
            if answer is not None:
                self._gates.take_check(answer)
        else:
            self._patient.begin_touch(command.landmark)

    def _on_quit(self) -> None:
        self._display.darken()
        self._gates.tell_open_at_end()
        self._session.end("quit", "session ended by the operator")

    def _stage(self, number: int) -> StageSpec:
        return self._plan.stage(stage_by_number(number))

    def _refuse(self, what: str, why: str) -> None:
        self._session.add_event("refused", f"{what} refused: {why}", EventLevel.WARNING)
