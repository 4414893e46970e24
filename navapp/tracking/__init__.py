"""From a sequence of stereo pictures to judged poses."""

from navapp.tracking.judge import Goal
from navapp.tracking.line import Line, LineSettings
from navapp.tracking.locator import LocatorSettings, Method
from navapp.tracking.motion import TrackState

__all__ = [
    "Goal",
    "Line",
    "LineSettings",
    "LocatorSettings",
    "Method",
    "TrackState",
]
