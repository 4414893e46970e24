"""What a session knows, and every way in which frames and commands change it."""

from collections import Counter
from collections.abc import Sequence

from drivers.clock import Clock
from drivers.frames import StereoFrame
from navapp.control.bone_tracks import BoneTracks, Candidate
from navapp.control.commands import Command, Interrupt
from navapp.control.event_log import EventLog
from navapp.control.frame_result import FrameResult
from navapp.control.layer_choice import LayerChoice
from navapp.control.made_steps import MadeSteps
from navapp.control.other_bones import OtherBones
from navapp.control.pictures import OperatorPicture
from navapp.control.rates import RateMeter
from navapp.control.registration_job import RegistrationJob
from navapp.control.states import (
    Event,
    EventLevel,
    LimbLine,
    OtherBone,
    Rates,
    SessionState,
    StepLine,
)
from navapp.errors import RigError
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform
from navapp.limb import LimbMeasurement
from navapp.resection import CutBone
from navapp.values import Measured, Prior, Reason, StageSpec, Status, TrackedFrame, Verdict


class Session:
    """State, stage, poses and events of a session; changed through its methods alone.

    Args:
        clock: of the session.
        log: of its events.
        tracks: of the session's bones.
        registration: searches for the stage's bone.
        others: the other bones that are followed.
        steps: that have been made.
        stage: to start in.
        layers: that are drawn; by default those of the stage.
        meter: of its frames.
    """

    def __init__(
        self,
        clock: Clock,
        log: EventLog,
        tracks: BoneTracks,
        registration: RegistrationJob,
        others: OtherBones,
        steps: MadeSteps,
        stage: StageSpec,
        layers: LayerChoice | None = None,
        meter: RateMeter | None = None,
    ) -> None:
        self._clock = clock
        self._log = log
        self._tracks = tracks
        self._registration = registration
        self._others = others
        self._steps = steps
        self._state = SessionState.STARTING
        self._tracked: TrackedFrame | None = None
        self._shows_depth = False
        self._layers = layers or LayerChoice()
        self._tracked_at_ns = self._time_ns = 0
        self._picture: OperatorPicture | None = None
        self._meter = meter or RateMeter()
        self._n_accepted: Counter[str] = Counter()
        self._is_over = False
        self._rig_error: RigError | None = None
        self._stage = stage
        self._put_in_force(stage)

    @property
    def state(self) -> SessionState:
        """Where the session stands."""
        return self._state

    @property
    def stage(self) -> StageSpec:
        """In force."""
        return self._stage

    @property
    def tracked(self) -> TrackedFrame | None:
        """The newest answer on the stage's bone; None when there is none that counts."""
        return self._tracked

    @property
    def candidate(self) -> Candidate | None:
        """The pose under review."""
        return self._tracks.candidate

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """All that wait for a decision, by their numbers."""
        return self._tracks.candidates

    @property
    def candidate_id(self) -> int | None:
        """Of the pose under review; None when there is none."""
        return self._tracks.candidate_id

    @property
    def search_progress(self) -> float | None:
        """Share done of the registration that runs; None when none runs."""
        return self._registration.progress

    @property
    def sequence(self) -> int:
        """Of the newest handled frame, -1 before the first."""
        return self._log.sequence

    @property
    def picture(self) -> OperatorPicture | None:
        """Of the newest frame, None before the first."""
        return self._picture

    @property
    def is_over(self) -> bool:
        """Nothing is handled any more."""
        return self._is_over

    @property
    def rig_error(self) -> RigError | None:
        """Why the rig is not believed any more; None while it is."""
        return self._rig_error

    @property
    def events(self) -> tuple[Event, ...]:
        """The newest, oldest first."""
        return self._log.events

    @property
    def now_ns(self) -> int:
        """On the session's clock."""
        return self._clock.now_ns()

    def pose_age_ms(self, now_ns: int) -> float | None:
        """Since the capture of the frame that `tracked` belongs to; None without an answer."""
        return None if self._tracked is None else (now_ns - self._tracked_at_ns) / 1e6

    def predict_pose(self, time_ns: int) -> RigidTransform | None:
        """Where the stage's bone will be at a moment; None when it moves too fast to know."""
        return self._tracks.predict(self._stage, time_ns)

    def other_bones(self, now_ns: int) -> tuple[OtherBone, ...]:
        """The other bones that are followed, as of now."""
        return self._others.describe(self._stage, now_ns)

    def rates(self, n_dropped: int) -> Rates:
        """How fast frames are handled."""
        return self._meter.rates(n_dropped)

    def begin_frame(self, frame: StereoFrame) -> None:
        """A frame is about to be handled; the first one ends the start."""
        self._log.begin_frame(frame.sequence)
        self._time_ns = frame.captured_ns
        if self._state is SessionState.STARTING:
            self.change_state(SessionState.READY, "pictures arrive")

    def look_for_bone(self, frame: StereoFrame) -> None:
        """Register, review or follow the stage's bone in a frame, as the state asks.

        A bone that is lost suspends the navigation, its return resumes it.
        """
        tracked = self._look_for_bone(frame)
        self._tracked, self._tracked_at_ns = tracked, frame.captured_ns
        if tracked is None:
            return
        verdict = tracked.verdict
        is_lost = verdict.status is Status.LOST
        if self._state is SessionState.NAVIGATING and is_lost:
            why = f": {verdict.reasons[0].value}" if verdict.reasons else ""
            self.change_state(SessionState.SUSPENDED, f"bone lost{why}", EventLevel.ALARM)
        elif self._state is SessionState.SUSPENDED and not is_lost:
            self.change_state(SessionState.NAVIGATING, "bone found again")

    def follow_others(self, frame: StereoFrame) -> dict[str, TrackedFrame]:
        """Follow another bone into a frame; in a fault none: nothing that is measured counts."""
        if self._state is SessionState.FAULT:
            return {}
        return self._others.follow(self._stage, frame, self._tracked, is_accepted=self._is_accepted)

    def measure_limb(
        self, frame: StereoFrame, others: dict[str, TrackedFrame]
    ) -> LimbMeasurement | None:
        """What femur and tibia say together in a frame; None unless both are OK in it."""
        return self._others.measure_limb(
            self._stage, frame, self._tracked, others, is_accepted=self._is_accepted
        )

    @property
    def _is_accepted(self) -> bool:
        """The pose of the stage's bone was accepted, and is followed."""
        return self._state is SessionState.NAVIGATING

    def limb(self, now_ns: int) -> LimbLine | None:
        """What they said together last, as of now; None while they are not both followed."""
        return self._others.describe_limb(self._stage, now_ns)

    def confirm_step(self, name: str) -> None:
        """A planned step has been made.

        Raises:
            UsageError: the plan has no such step.
        """
        self._take_step(self._steps.confirm(name), f"{name} confirmed")

    def withdraw_step(self, name: str) -> None:
        """A step has not been made after all.

        Raises:
            UsageError: it was not confirmed.
        """
        self._take_step(self._steps.withdraw(name), f"{name} withdrawn")

    def read_thickness(self, name: str, thickness_mm: Sequence[float]) -> None:
        """The thickness below a cut that is made was read.

        Raises:
            UsageError: as of `MadeSteps.read_thickness`.
        """
        bone = self._steps.read_thickness(name, thickness_mm)
        self._take_step(bone, f"thickness below {name} read")

    def _take_step(self, bone: CutBone, text: str) -> None:
        name = bone.planned.name
        if name == self._stage.bone:
            # What was judged by the old model says nothing of the new one.
            self._tracked = None
            self._tracks.forget_verdicts()
        self.add_event("step", f"{text}: version {bone.version} of the {name} is in force")
        if name == self._stage.bone and self._state is SessionState.REGISTERING:
            # What runs searches for the bone as it was.
            self.begin_registration()

    def steps_of(self, stage: StageSpec) -> tuple[StepLine, ...]:
        """The steps of a stage: planned, made, measured."""
        return self._steps.describe(stage)

    @property
    def time_ns(self) -> int:
        """Capture of the newest frame: conditions go by it, so that they replay."""
        return self._time_ns

    @property
    def rig_problem(self) -> str:
        """Why the rig is not believed; empty while it is."""
        return "" if self._rig_error is None else self._rig_error.problem

    @property
    def bone(self) -> str:
        """Of the stage in force."""
        return self._stage.bone

    def registration_of(self, bone: str) -> int:
        """How many registrations of a bone were accepted by now."""
        return self._n_accepted[bone]

    def is_bone_ok(self, stage: StageSpec) -> bool:
        """Whether a stage's bone is the present one, accepted, and its newest pose is OK."""
        is_ok = self._tracked is not None and self._tracked.verdict.status is Status.OK
        return is_ok and stage.bone == self.bone and self._is_accepted

    @property
    def bone_version(self) -> int:
        """Of the stage's bone; 0 without a model of it."""
        return self._steps.version(self._stage.bone)

    @property
    def bone_surface(self) -> TriangleMesh | None:
        """What is left of the stage's bone; None: all of it."""
        return self._steps.surface(self._stage.bone)

    def measure_steps(self, frame: StereoFrame) -> dict[str, Measured]:
        """Measure faces of cuts and holes of the stage's bone in a frame; in a fault none."""
        if self._state is SessionState.FAULT:
            return {}
        before = self.bone_version
        measured = self._steps.measure(frame, self._tracked, is_accepted=self._is_accepted)
        if self.bone_version != before:
            text = f"faces measured: version {self.bone_version} of the {self._stage.bone}"
            self.add_event("step", f"{text} is in force")
        return measured

    @property
    def shows_depth(self) -> bool:
        """The operator's picture is coloured by what is known of the depth."""
        return self._shows_depth

    def toggle_depth(self) -> None:
        """Colour the operator's picture by what is known of the depth, or no longer."""
        self._shows_depth = not self._shows_depth
        self.add_event("depth", f"depth {'marked' if self._shows_depth else 'no longer marked'}")

    @property
    def layers(self) -> tuple[str, ...]:
        """Names of the layers drawn: the stage's, but for what the operator has switched."""
        return self._layers.of(self._stage)

    def toggle_layer(self, name: str) -> None:
        """Draw a layer, or no longer, in the stage in force and until it is left."""
        self._layers.toggle(name)
        self.add_event("layer", f"layer {name} {'on' if name in self.layers else 'off'}")

    def keep_picture(self, picture: OperatorPicture) -> None:
        """What the newest frame shows the operator."""
        self._picture = picture

    def end_frame(self, result: FrameResult, latency_ms: float | None) -> None:
        """Count a frame that was handled, and tell its result; latency as of `RateMeter`."""
        self._meter.add(latency_ms, result.frame.skew_ns)
        self._log.tell_frame(result)

    def take_over(self, next_sequence: int) -> TrackedFrame | None:
        """Bring a finished registration under review; its best answer, when there is one.

        Raises:
            Exception: what the search has raised.
        """
        registration = self._registration.take_due(next_sequence)
        if registration is None:
            return None
        self._tracks.offer(registration)
        self._log.tell_take_over(next_sequence)
        best = self._tracks.candidate
        if best is None:
            failure = registration.answers[0] if registration.answers else None
            why = f"nothing tells where the {self._stage.bone} is: draw a box around it"
            if failure is not None and failure.verdict.reasons:
                why = failure.verdict.reasons[0].value
            self.fall_back(f"registration failed: {why}", EventLevel.WARNING)
            return failure
        text = add_bound(f"candidate 1 of {best.count}", best.tracked.verdict)
        self.change_state(SessionState.REVIEW, text)
        return best.tracked

    def enter_stage(self, stage: StageSpec, how: str = "") -> None:
        """Put a stage in force; one of another bone ends the search and the review.

        Args:
            stage: to enter.
            how: it may be entered, for the event.
        """
        is_other_bone = stage.bone != self._stage.bone
        self._put_in_force(stage, how)
        if is_other_bone and self._state not in (SessionState.STARTING, SessionState.FAULT):
            self._stop_search()
            self.fall_back(f"the {stage.bone} is now the bone to follow")

    def begin_registration(self, start: Prior | None = None) -> None:
        """Search for the stage's bone from the next frame on; what is under review is dropped.

        Args:
            start: where an operator says that it is; None: as before.
        """
        self._stop_search()
        self._tracked = None
        bone = self._stage.bone
        if start is not None:
            self._registration.set_start(bone, start)
        told = describe_start(self._registration.start_of(bone), bone)
        self.change_state(SessionState.REGISTERING, f"searching for the {bone}{told}")

    def cancel_registration(self) -> None:
        """Stop the search."""
        self._stop_search()
        self.fall_back("registration cancelled")

    def propose(self, pose: RigidTransform) -> None:
        """Put a pose of the stage's bone under review that was made by hand."""
        self._tracked = None
        self._registration.cancel()
        self._tracks.propose(self._stage.bone, pose, self.now_ns)
        self.change_state(SessionState.REVIEW, "a pose was proposed by hand")

    def accept(self) -> None:
        """Navigate by the candidate under review, if there is one."""
        if (candidate := self._tracks.candidate) is None:
            return
        self._steps.forget_measured(self._stage.bone)
        self._n_accepted[self._stage.bone] += 1
        self._tracks.accept(self._stage)
        text = add_bound("registration accepted", candidate.tracked.verdict)
        self.change_state(SessionState.NAVIGATING, text)

    def reject(self) -> None:
        """Drop the candidate under review; the next one, if any, takes its place."""
        rejected = self._tracks.reject()
        self._tracked = None
        text = f"candidate {rejected.number} of {rejected.count} rejected by the operator"
        if self._tracks.candidate is None:
            self.fall_back(text)
        else:
            self.add_event("reject", text)

    def choose_candidate(self, step: int) -> None:
        """Put the next candidate by its number under review, or with -1 the one before."""
        chosen = self._tracks.choose(step)
        self._tracked = None
        self.add_event("candidate", f"candidate {chosen.number} of {chosen.count} under review")

    def lose_camera(self, why: str, *, can_return: bool) -> None:
        """The camera is gone: a fault, and the end of the session unless it can return."""
        self.tell_command(Interrupt())
        self.forget_sight()
        self.change_state(SessionState.FAULT, why, EventLevel.ALARM)
        self._is_over = not can_return

    def forget_sight(self) -> None:
        """Nothing that was seen counts any more; accepted tracks stay."""
        self._stop_search()
        self._others.forget()
        self._tracked = None

    def distrust_rig(self, why: str) -> None:
        """The rig has moved: a fault that does not end."""
        if self._rig_error is not None:
            return
        self._rig_error = RigError(describe_moved_rig(why), remedy=Reason.RIG_MOVED.remedy)
        self.forget_sight()
        self.change_state(SessionState.FAULT, self._rig_error.problem, EventLevel.ALARM)

    def end(self, kind: str, text: str) -> None:
        """Handle nothing any more, and tell why."""
        self._is_over = True
        self.add_event(kind, text)

    def close(self) -> None:
        """End without a word and stop the search."""
        self._is_over = True
        self._stop_search()
        self._others.close()

    def go_offline(self) -> None:
        """The devices are closed."""
        self._state = SessionState.OFFLINE

    def change_state(
        self, state: SessionState, text: str, level: EventLevel = EventLevel.INFO
    ) -> None:
        """Stand elsewhere from now on, and tell why."""
        self._state = state
        self.add_event("state", text, level)

    def fall_back(self, text: str, level: EventLevel = EventLevel.INFO) -> None:
        """Go to the state that the session has without a candidate."""
        if self._rig_error is not None:
            self.change_state(SessionState.FAULT, text, level)
            return
        is_known = self._tracks.is_accepted(self._stage)
        self.change_state(SessionState.SUSPENDED if is_known else SessionState.READY, text, level)

    def add_event(self, kind: str, text: str, level: EventLevel = EventLevel.INFO) -> None:
        """Keep and tell what has just happened."""
        self._log.add(kind, text, level)

    def tell_command(self, command: Command) -> None:
        """A command is about to be handled."""
        self._log.tell_command(command)

    def _put_in_force(self, stage: StageSpec, how: str = "") -> None:
        self._stage = stage
        self._layers.reset()
        # What was judged by the old stage's targets and tolerance says nothing in the new one.
        self._tracked = None
        self._tracks.forget_verdicts()
        text = f"stage {stage.number} {stage.name} entered"
        self.add_event("stage", f"{text}, {how}" if how else text)
        self._log.tell_stage(stage.name)

    def _look_for_bone(self, frame: StereoFrame) -> TrackedFrame | None:
        if self._state is SessionState.REGISTERING:
            # A search that began earlier is taken over before a frame, never within one: its
            # answer belongs to another picture and must be followed into this one first.
            is_of_this_frame = self._registration.start(self._stage, frame)
            return self.take_over(frame.sequence) if is_of_this_frame else None
        if self._state is SessionState.REVIEW:
            return self._tracks.review(self._stage, frame)
        if self._state in (SessionState.NAVIGATING, SessionState.SUSPENDED):
            return self._tracks.follow(self._stage, frame)
        return None

    def _stop_search(self) -> None:
        self._registration.cancel()
        self._tracks.drop_candidates()


def describe_moved_rig(why: str) -> str:
    """What is said of a rig that has moved, with how that was found."""
    return f"{Reason.RIG_MOVED.value} ({why})"


def describe_start(start: Prior, bone: str) -> str:
    """Where a bone is searched for, for people; empty for a rough pose."""
    if bone in start.left_from_bone:
        return ""
    if picks := start.picks_of(bone):
        return f" from {len(picks)} picked landmarks"
    cone = start.cones.get(bone)
    side = "" if cone is None else f" within {cone.half_angle_deg:.0f} deg of its approach"
    return f"{' in the box that was drawn' if start.box is not None else ''}{side}"


def add_bound(text: str, verdict: Verdict) -> str:
    """A text with the predicted error, when there is one."""
    bound_mm = verdict.predicted_tre_mm
    return text if bound_mm is None else f"{text}, predicted error {bound_mm:.2f} mm"
