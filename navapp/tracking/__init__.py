"""From a sequence of stereo pictures to judged poses."""

from navapp.tracking.line import Line, LineSettings, RegistrationCancelled
from navapp.tracking.motion import TrackState

__all__ = ["Line", "LineSettings", "RegistrationCancelled", "TrackState"]
