"""From a sequence of stereo pictures to judged poses."""

from navapp.registration.verdict import Goal
from navapp.tracking.methods import make_tracker
from navapp.tracking.motion import TrackState
from navapp.tracking.tracker import Method, Tracker, TrackerSettings

__all__ = [
    "Goal",
    "Method",
    "TrackState",
    "Tracker",
    "TrackerSettings",
    "make_tracker",
]
