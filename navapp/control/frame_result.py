"""What the controller tells its listeners about every frame."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from drivers.frames import StereoFrame
from navapp.control.states import SessionState
from navapp.values import FrameTimings, OverlayPicture, StageSpec, TrackedFrame


@dataclass(frozen=True, slots=True, eq=False)
class FrameResult:
    """One handled frame.

    Attributes:
        frame: as the camera gave it.
        state: after the frame.
        stage: in force.
        tracked: the active bone's pose and verdict; None when nothing was looked for.
        picture: what was made for the display.
        timings: of tracking and overlay; their sum is the processing time.
        is_navigable: guides are in the picture.
        others: other bones than the active one, whose turn it was in this very frame.
    """

    frame: StereoFrame
    state: SessionState
    stage: StageSpec
    tracked: TrackedFrame | None
    picture: OverlayPicture
    timings: FrameTimings
    is_navigable: bool
    others: Mapping[str, TrackedFrame] = field(default_factory=dict)


FrameListener = Callable[[FrameResult], None]
