"""From a sequence of stereo pictures to judged poses."""

from navapp.registration.verdict import Goal
from navapp.tracking.methods import make_tracker
from navapp.tracking.motion import TrackState
from navapp.tracking.settings import Method, Part, TrackerSettings
from navapp.tracking.tracker import Tracker

__all__ = ["Goal", "Method", "Part", "TrackState", "Tracker", "TrackerSettings", "make_tracker"]
