"""What each of the operator's commands does to the session, its camera and its display."""

from navapp.control.camera_link import CameraLink
from navapp.control.device_watch import SlowDevices
from navapp.control.display_link import DisplayLink
from navapp.control.rig_watch import RigWatch
from navapp.control.session import Session, with_bound
from navapp.control.stages import stage_by_number
from navapp.control.states import (
    Accept,
    Blank,
    Cancel,
    Command,
    DistrustRig,
    EnterStage,
    EventLevel,
    Interrupt,
    Propose,
    Quit,
    Reconnect,
    Register,
    Reject,
    SessionState,
    Show,
)
from navapp.errors import UsageError
from navapp.values import Status


class Commands:
    """Obeys, or refuses with a reason that the operator reads."""

    def __init__(
        self,
        session: Session,
        camera: CameraLink,
        display: DisplayLink,
        rig: RigWatch,
        slow: SlowDevices,
    ) -> None:
        self._session = session
        self._camera = camera
        self._display = display
        self._rig = rig
        self._slow = slow

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
                self._on_accept()
            case Reject():
                self._on_reject()
            case Blank():
                self._on_blank()
            case Show():
                self._on_show()
            case EnterStage():
                self._on_enter_stage(command)
            case Reconnect():
                self._camera.retry_now()
                self._slow.restore()
            case Interrupt():
                self._session.lose_sight()
                self._session.fall_back("the camera was lost here when this was recorded")
            case DistrustRig():
                self._rig.distrust(command)
            case Quit():
                self._on_quit()

    def _on_register(self) -> None:
        session = self._session
        if not self._can_look("register"):
            return
        session.pursuit.drop()
        session.tracked = None
        session.change(SessionState.REGISTERING, f"searching for the {session.stage.bone}")

    def _on_propose(self, command: Propose) -> None:
        session = self._session
        if not self._can_look("propose"):
            return
        if command.left_from_bone.source != session.stage.bone:
            self._refuse("propose", f"the pose is not one of the {session.stage.bone}")
            return
        session.tracked = None
        session.pursuit.propose(session.stage, command.left_from_bone, session.clock.now_ns())
        session.change(SessionState.REVIEW, "a pose was proposed by hand")

    def _on_cancel(self) -> None:
        session = self._session
        if session.state is not SessionState.REGISTERING:
            self._refuse("cancel", "no registration is running")
            return
        session.pursuit.drop()
        session.fall_back("registration cancelled")

    def _on_accept(self) -> None:
        session = self._session
        candidate = session.pursuit.candidate
        if session.state is not SessionState.REVIEW or candidate is None:
            self._refuse("accept", "no candidate is under review")
            return
        verdict = candidate.tracked.verdict
        if verdict.status is Status.LOST:
            self._refuse("accept", "the judge calls this candidate lost")
            return
        session.pursuit.accept(session.stage)
        session.change(SessionState.NAVIGATING, with_bound("registration accepted", verdict))

    def _on_reject(self) -> None:
        session = self._session
        if session.state is not SessionState.REVIEW:
            self._refuse("reject", "no candidate is under review")
            return
        rejected = session.pursuit.reject()
        session.tracked = None
        text = f"candidate {rejected.number} of {rejected.count} rejected by the operator"
        if session.pursuit.candidate is None:
            session.fall_back(text)
        else:
            session.event("reject", text)

    def _on_blank(self) -> None:
        self._display.blank()
        self._session.event("blank", "display blanked by the operator")

    def _on_show(self) -> None:
        if self._display.is_blanked:
            self._display.show_again()
            self._session.event("show", "display shown again")

    def _on_enter_stage(self, command: EnterStage) -> None:
        session = self._session
        try:
            stage = session.pursuit.plan.stage(stage_by_number(command.number))
        except UsageError as error:
            self._refuse("stage", str(error))
            return
        if stage.number == session.stage.number:
            return
        is_other_bone = stage.bone != session.stage.bone
        session.enter(stage)
        if is_other_bone and session.state not in (SessionState.STARTING, SessionState.FAULT):
            session.pursuit.drop()
            session.fall_back(f"the {stage.bone} is now the bone to follow")

    def _on_quit(self) -> None:
        self._session.is_over = True
        self._display.darken()
        self._session.event("quit", "session ended by the operator")

    def _can_look(self, what: str) -> bool:
        session = self._session
        if session.rig_error is not None:
            self._refuse(what, session.rig_error.problem)
        elif session.state is SessionState.FAULT:
            self._refuse(what, "the camera is lost")
        elif not session.pursuit.is_planned(session.stage):
            self._refuse(what, f"the plan has no model of the {session.stage.bone}")
        else:
            return True
        return False

    def _refuse(self, what: str, why: str) -> None:
        self._session.event("refused", f"{what} refused: {why}", EventLevel.WARNING)
