"""States of a session, and the snapshot that all clients read."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from navapp.control.length_check import LengthCheck
from navapp.control.mirror_error import MirrorError
from navapp.geometry.box import Box
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.limb import LimbMeasurement
from navapp.resection import CaliperPoint, Thickness
from navapp.tools.patient_check import CheckAnswer, CheckResult
from navapp.tools.tool import SeenTool, ToolKind
from navapp.tools.tool_on_bone import HoleOffset, ToolOnBone
from navapp.values import Measured, Reason, RowCheck, StageSpec, StepKind, Verdict


class SessionState(Enum):
    """OFFLINE -> STARTING -> READY -> REGISTERING -> REVIEW -> NAVIGATING <-> SUSPENDED; FAULT."""

    OFFLINE = "offline"
    STARTING = "starting"
    READY = "ready"
    REGISTERING = "registering"
    REVIEW = "review"
    NAVIGATING = "navigating"
    SUSPENDED = "suspended"
    FAULT = "fault"


class EventLevel(Enum):
    """How important an event is; ALARM rings the terminal's bell once."""

    INFO = "info"
    WARNING = "warning"
    ALARM = "alarm"


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened."""

    time_ns: int  # on the session's clock
    kind: str  # short name for programs, for example `state`, `stage`, `accept`, `device`
    text: str  # one line for people
    level: EventLevel = EventLevel.INFO
    sequence: int = -1  # the frame after which it happened, -1 before the first


class DeviceHealth(Enum):
    """State of a device, as the devices panel shows it."""

    OK = "ok"
    ABSENT = "absent"
    UNKNOWN = "unknown"
    TROUBLE = "trouble"
    LOST = "lost"


@dataclass(frozen=True, slots=True)
class DeviceLine:
    """One device in the devices panel."""

    kind: str
    name: str
    health: DeviceHealth
    detail: str = ""
    remedy: str = ""  # of one in trouble: what to do


@dataclass(frozen=True, slots=True)
class CaptureToLight:
    """From the capture of a frame until the light of its picture, the display's delay included."""

    mean_ms: float  # over the last frames
    # 95 % of frames are within so much of it, the error of the display's delay included.
    spread_ms: float


@dataclass(frozen=True, slots=True)
class Rates:
    """How fast frames are handled; None before there is a figure."""

    frames_per_s: float | None = None  # over the last seconds
    # from the capture of the newest frame until its picture was handed to the display; None of
    # frames that wait to be read (docs/conventions.md).
    latency_ms: float | None = None
    # fps_history, latency_history_ms: the last values, oldest first, for sparklines.
    fps_history: tuple[float, ...] = ()
    latency_history_ms: tuple[float, ...] = ()
    light: CaptureToLight | None = None  # None when the display's delay is not known
    n_frames: int = 0  # handled so far
    n_dropped: int = 0  # replaced by newer ones before they were handled
    skew_ms: float | None = None  # between the two cameras, newest frame


@dataclass(frozen=True, slots=True)
class Progress:
    """Long work that is running."""

    what: str
    share: float  # that is done; NaN: not known


@dataclass(frozen=True, slots=True)
class MirrorCheck:
    """The surgeon's check of what is seen in the mirror."""

    time_ns: int  # when it was finished
    residual_mm: float  # the largest distance of a cross from its point, at the bone


@dataclass(frozen=True, slots=True)
class CrossCheck:
    """A check of the mirror that is under way."""

    number: int  # of the cross that is shown, from 0
    count: int  # of all crosses
    nudge_px: tuple[int, int]  # to the right and downwards, as the eye sees it


@dataclass(frozen=True, slots=True)
class OtherBone:
    """Another bone than the stage's that is followed; never drawn."""

    name: str  # of the bone
    # on the newest frame that was its turn, by its own stage's goal; None before one.
    verdict: Verdict | None = None
    # since the newest frame in which it was OK, now; None when there was none.
    age_ms: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class CandidateLine:
    """One of several candidates that wait for the operator's decision."""

    number: int  # 1 is the one that the search takes for the best
    verdict: Verdict  # on the pose that it was last seen at
    is_shown: bool  # it is under review: accept and reject are about this one
    # uint8 (h, w, 3) BGR: around the bone, with its outline at that pose; None before there is one.
    picture: NDArray[np.uint8] | None


@dataclass(frozen=True, slots=True, eq=False)
class LimbLine:
    """What femur and tibia said together last."""

    measurement: LimbMeasurement | None = None  # None: they were never OK in one picture
    age_ms: float | None = None  # since that picture, now


@dataclass(frozen=True, slots=True, eq=False)
class StepLine:
    """A planned step of the stage: a cut, a hole, a part; made, and measured."""

    name: str  # in the plan
    kind: StepKind
    is_made: bool  # an operator has confirmed it
    measured: Measured | None = None  # all measurements together; None: not measurable yet
    seen_share: float | None = None  # of face or rim in the newest look; None: not seen at all
    n_made: int = 0  # how often it was confirmed: a cut may be made again
    # the newest measurement since it was confirmed, whatever was registered anew since then.
    last_measured: Measured | None = None
    # of the piece that a cut took off, by its measured face or by the caliper.
    thickness: Thickness | None = None
    # of a cut after which the bone is tracked by its face: where a caliper is read, or why the plan
    # allows no reading, and the mm that it read.
    caliper_points: tuple[CaliperPoint, ...] = ()
    caliper_refusal: str = ""
    remaining_mm: tuple[float, ...] = ()

    @property
    def is_caliper_readable(self) -> bool:
        """A cut that is made, below which a caliper can be read, or read again."""
        return self.is_made and bool(self.caliper_points)


@dataclass(frozen=True, slots=True, eq=False)
class ToolReading:
    """What a tool says in one pair of pictures."""

    seen: SeenTool
    placed: ToolOnBone | None  # in the bone's coordinates; None while that is not OK
    surface_mm: float | None = None  # of the tip from the bone's surface, positive outside
    # name and distance of the plan's nearest landmark, mm.
    nearest: tuple[str, float] | None = None
    hole: HoleOffset | None = None  # of the stage's holes the one whose entry is nearest


@dataclass(frozen=True, slots=True, eq=False)
class ToolLine:
    """A tool as it was seen last."""

    kind: ToolKind
    reading: ToolReading | None  # None while it is not seen
    missing: str = ""  # why not
    age_ms: float | None = None  # since that pair of pictures, now


@dataclass(frozen=True, slots=True, eq=False)
class PatientCheck:
    """The check on the patient that is under way, or was finished."""

    answer: CheckAnswer
    bone: str
    n_touches: int
    result: CheckResult | None  # None before the first touch
    wanted: str  # where the next touch is asked for, in words; empty once it is decided
    wanted_mm: FloatArray | None  # (3,) that place, bone coordinates
    is_valid: bool  # it was made with the registration in force, and is not too old
    has_failed: bool = False  # a check found that registration wrong, and none found it right since


@dataclass(frozen=True, slots=True)
class ConditionLine:
    """A condition of the time-out or of a gate, as it stands."""

    name: str  # for programs
    text: str  # for people
    is_met: bool
    is_personal: bool = False  # a person confirms it, by its name
    note: str = ""  # more about it: what is asked for, or when it was confirmed


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """All that a client may show; immutable."""

    time_ns: int
    state: SessionState  # of the session
    stage: StageSpec  # in force
    stages: tuple[StageSpec, ...]  # all five, in order
    reasons: tuple[Reason, ...]  # why guides are not shown; empty means navigable
    is_blanked: bool = False
    verdict: Verdict | None = None  # on the newest pose, None before there is one
    left_from_bone: RigidTransform | None = None  # the newest pose, None when there is none
    # of the candidate that waits for the operator's decision: another one for every candidate of a
    # session; None when none waits. It is on the screen when there is a verdict.
    candidate_id: int | None = None
    candidates: tuple[CandidateLine, ...] = ()  # all that wait for a decision, by their numbers
    pose_age_ms: float | None = None  # of that pose, now
    valid_ms: float = 500.0  # a pose that is older is not where the bone is
    # in the mirror: where the bone will be when light from the display is seen; None when it moves
    # too fast to know.
    pose_at_light: RigidTransform | None = None
    others: tuple[OtherBone, ...] = ()  # the other bones that are followed
    limb: LimbLine | None = None  # None while femur and tibia are not both followed
    # for the operator, uint8, (H, W, 3) BGR or (H, W) grey, overlay drawn in; None before the first
    # frame. `plain_picture` is the same without guides, None when it has none.
    picture: NDArray[np.uint8] | None = None
    plain_picture: NDArray[np.uint8] | None = None
    picture_size_px: tuple[int, int] = (0, 0)  # width and height of the left picture
    left_picture: NDArray[np.uint8] | None = None  # the newest one as it came
    # (H, W, 3) BGR of a candidate: how far the measured surface lies from the model; None without.
    residual_picture: NDArray[np.uint8] | None = None
    # where the stage's bone lies in the left picture, at the newest pose; None without one.
    bone_box: Box | None = None
    # of the stage's bone: what can be picked in that picture, (3,) mm in bone coordinates.
    landmarks: Mapping[str, FloatArray] = field(default_factory=dict)
    can_draw_start: bool = True  # the method finds a bone in a box, or from picked landmarks
    shows_depth: bool = False  # it is coloured by what is known of the depth
    has_eye: bool = False  # what an eye sees in a simulated mirror can be shown instead
    shows_eye: bool = False  # it is shown
    layers: tuple[str, ...] = ()  # names of those that are drawn where guides are
    time_out: tuple[ConditionLine, ...] = ()  # before the first guides; empty: none is asked for
    # the stage whose gate was told as not met, and may be overridden; None: none was.
    refused_stage: int | None = None
    gate: tuple[ConditionLine, ...] = ()  # before that stage, or else the next one
    steps: tuple[StepLine, ...] = ()  # planned for the stage
    bone_version: int = 0  # of the stage's bone: counts what is confirmed, measured, withdrawn
    bone_surface: TriangleMesh | None = None  # what is left of it; None: all
    tools: tuple[ToolLine, ...] = ()  # that are looked for
    patient_check: PatientCheck | None = None  # None before the first touch
    rates: Rates = field(default_factory=Rates)
    devices: tuple[DeviceLine, ...] = ()
    events: tuple[Event, ...] = ()  # the newest, oldest first
    progress: Progress | None = None
    rig_name: str = ""
    plan_name: str = ""
    plan_digest: str = ""
    side: str = ""
    sequence: int = -1
    is_bone_planned: bool = True  # the plan has a model of the stage's bone
    # no picture has come for longer than the camera's period explains.
    is_camera_silent: bool = False
    rig_alarm: str = ""  # why the rig is not believed any more; empty while it is
    rows: RowCheck | None = None  # of the newest pair, as far as the bone tells; None: nothing
    # the newest look at a known length that says something of the rig, else the newest; None before
    # one.
    length_check: LengthCheck | None = None
    # what projector and mirror have against guides; nothing at all is shown then.
    device_reasons: tuple[Reason, ...] = ()
    has_mirror: bool = False  # the display is seen in the mirror
    mirror_error: MirrorError | None = None  # of guides in the mirror; None without any
    mirror_reason: Reason | None = None  # what the check of the mirror has against guides
    cross_check: CrossCheck | None = None  # that is under way; no guide is shown meanwhile
    is_simulated: bool = False  # the pictures are not of this world
    is_recording: bool = False  # the session is kept in a folder
    is_over: bool = False

    @property
    def is_navigable(self) -> bool:
        """Guides may be shown."""
        return not self.reasons

    @property
    def gate_stage(self) -> int:
        """Number of the stage that `gate` stands before."""
        return self.refused_stage or self.stage.number + 1

    @property
    def is_candidate(self) -> bool:
        """The pose waits for the operator's decision."""
        return self.candidate_id is not None and self.verdict is not None
