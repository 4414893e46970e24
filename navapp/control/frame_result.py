"""What the controller tells its listeners about every frame."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from drivers.frames import StereoFrame
from navapp.control.states import SessionState, ToolReading
from navapp.limb import LimbMeasurement
from navapp.tools.tool import ToolKind
from navapp.values import FrameTimings, Measured, OverlayPicture, StageSpec, TrackedFrame


@dataclass(frozen=True, slots=True, eq=False)
class FrameResult:
    """One handled frame."""

    frame: StereoFrame  # as the camera gave it
    state: SessionState  # after the frame
    stage: StageSpec  # in force
    # the active bone's pose and verdict; None when nothing was looked for.
    tracked: TrackedFrame | None
    picture: OverlayPicture  # what was made for the display
    timings: FrameTimings  # of tracking and overlay; their sum is the processing time
    is_navigable: bool  # guides are in the picture
    # other bones than the active one, whose turn it was in this very frame.
    others: Mapping[str, TrackedFrame] = field(default_factory=dict)
    # faces of cuts and holes that were measured in this very frame, by the step's name.
    measured: Mapping[str, Measured] = field(default_factory=dict)
    bone_version: int = 0  # of the stage's bone, that the pose was judged by
    # what femur and tibia say together; None unless both are OK in this very frame.
    limb: LimbMeasurement | None = None
    # tools that were seen in this very frame.
    tools: Mapping[ToolKind, ToolReading] = field(default_factory=dict)


FrameListener = Callable[[FrameResult], None]
