"""What a session is about, before any device is opened."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from navapp.config import Configuration
from navapp.control.calibrated_display import CalibratedDisplay
from navapp.control.stages import STAGES
from navapp.geometry.display_model import DisplayModel
from navapp.geometry.rig import StereoRig
from navapp.tools.tool import Tool, ToolKind
from navapp.tracking import Method, Part, TrackerSettings
from navapp.values import Plan, Prior, StageSpec

_DEPTH_MM = TrackerSettings().depth_mm


@dataclass(frozen=True, slots=True, eq=False)
class SessionSpecification:
    """Everything that a session is started with, except its devices."""

    rig: StereoRig  # of the pictures
    plan: Plan  # of the operation
    prior: Prior  # where the bones may be before a first registration
    stage: StageSpec = STAGES[0]  # in force at the start
    method: Method = "bimcc"  # of pose estimation
    follows_refused: bool = False  # poses that the judge refuses are carried on, to be measured
    depth_mm: tuple[float, float] = _DEPTH_MM  # nearest and farthest surface of the working volume
    # bones that are looked for and followed, too, unasked: the tibia from the femur, others from
    # the prior.
    others: tuple[str, ...] = ()
    is_each: bool = False  # every frame stands for itself, and is the turn of each of them
    is_live: bool = False  # an operator accepts what is found; in a replay nobody is asked
    # how long a picture may stay on the display without a newer one.
    overlay_valid_ms: float = 500.0
    # where the mirror stood when the display was calibrated, if the display's model does not say.
    mirror_deg: float = 45.0
    display_delay_ms: float = 0.0  # from showing a picture until its light
    display_delay_bound_ms: float = 0.0  # 95 % bound of that delay's error, 0 when not known
    is_recording: bool = False  # the session is kept in a folder
    layers: tuple[str, ...] | None = None  # drawn in every stage; None: the stage's own
    display: CalibratedDisplay | None = None  # in the mirror; None: it shows the video
    made_steps: tuple[str, ...] = ()  # of the plan, made from the start
    frames_between_faces: int = 5  # faces of cuts are measured in every so many frames
    # guides wait for the time-out, and stages for what their gates ask for.
    has_gates: bool = False
    tools: Mapping[ToolKind, Tool] = field(default_factory=dict)  # that are looked for
    check_minutes: float = 30.0  # a check on the patient counts so long
    leaves_out: frozenset[Part] = frozenset()  # as of `TrackerSettings`, of an evaluation

    @property
    def display_model(self) -> DisplayModel | None:
        """Of the display in the mirror."""
        return None if self.display is None else self.display.model

    @property
    def calibrated_mirror_deg(self) -> float:
        """Where the mirror must stand."""
        known_deg = None if self.display is None else self.display.model.mirror_deg
        return self.mirror_deg if known_deg is None else known_deg

    @property
    def tracker_settings(self) -> TrackerSettings:
        """Of all trackers of the session."""
        return TrackerSettings(
            self.method, self.follows_refused, self.depth_mm, leaves_out=self.leaves_out
        )


def specify_session(
    configuration: Configuration,
    rig: StereoRig,
    plan: Plan,
    prior: Prior,
    stage: StageSpec,
    *,
    is_live: bool,
    method: Method | None = None,
    follows_refused: bool | None = None,
    others: tuple[str, ...] = (),
    is_each: bool = False,
    layers: tuple[str, ...] | None = None,
    calibrated_display: CalibratedDisplay | None = None,
    made_steps: tuple[str, ...] = (),
    has_gates: bool = False,
    tools: Mapping[ToolKind, Tool] | None = None,
    leaves_out: frozenset[Part] = frozenset(),
) -> SessionSpecification:
    """What is configured, for given rig, plan, prior and stage.

    Args:
        configuration: of everything else.
        rig: of the pictures.
        plan: of the operation.
        prior: where the bones may be before a first registration; the plan's usual approaches stand
            in for cones that it does not tell.
        stage: in force at the start.
        is_live: the display shows pictures as late as it was measured, and the session may be
            recorded; neither is true of a replay.
        method: of pose estimation; None: the configured one.
        follows_refused: poses that the judge refuses are carried on; None: as configured.
        others: bones that are looked for and followed unasked.
        is_each: every frame stands for itself.
        layers: drawn in every stage; None: the stage's own.
        calibrated_display: in the mirror; None: the display shows the video.
        made_steps: cuts, holes and parts of the plan that are made from the start.
        has_gates: guides wait for the time-out, and stages for what their gates ask for.
        tools: that are looked for; None: none.
        leaves_out: parts of pose estimation that are not made, to see what they are worth.
    """
    display = configuration.display
    return SessionSpecification(
        rig,
        plan,
        prior.with_cones(plan.approaches),
        stage,
        method or configuration.tracking.method,
        configuration.tracking.follow_refused if follows_refused is None else follows_refused,
        configuration.camera.depth_mm,
        others,
        is_each=is_each,
        is_live=is_live,
        overlay_valid_ms=display.withdrawn_ms if is_live else display.valid_ms,
        mirror_deg=configuration.mirror.calibrated_deg,
        display_delay_ms=display.delay_ms if is_live else 0.0,
        display_delay_bound_ms=display.delay_bound_ms if is_live else 0.0,
        is_recording=is_live and configuration.recording.folder is not None,
        layers=layers,
        display=calibrated_display,
        made_steps=made_steps,
        has_gates=has_gates,
        tools=tools or {},
        check_minutes=configuration.stages.check_minutes,
        leaves_out=leaves_out,
    )
