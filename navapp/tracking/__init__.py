"""From a sequence of stereo pictures to judged poses."""

from navapp.tracking.methods import make_tracker
from navapp.tracking.motion import TrackState
from navapp.tracking.search.near import NearSettings
from navapp.tracking.tracker import Method, Tracker, TrackerSettings
from navapp.tracking.verdict import Goal

__all__ = [
    "Goal",
    "Method",
    "NearSettings",
    "TrackState",
    "Tracker",
    "TrackerSettings",
    "make_tracker",
]
