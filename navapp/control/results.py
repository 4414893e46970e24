"""What the controller tells its listeners about every frame."""

from collections.abc import Callable
from dataclasses import dataclass

from drivers.frames import StereoFrame
from navapp.control.states import SessionState
from navapp.values import LineTimings, OverlayPicture, StageSpec, TrackedFrame


@dataclass(frozen=True, slots=True, eq=False)
class FrameResult:
    """One handled frame.

    Attributes:
        frame: as the camera gave it.
        state: after the frame.
        stage: in force.
        tracked: the active bone's pose and verdict; None when nothing was looked for.
        picture: what was made for the display.
        timings: of the line and the overlay.
        is_navigable: guides are in the picture.
    """

    frame: StereoFrame
    state: SessionState
    stage: StageSpec
    tracked: TrackedFrame | None
    picture: OverlayPicture
    timings: LineTimings
    is_navigable: bool


FrameListener = Callable[[FrameResult], None]
