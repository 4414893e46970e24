"""A bone of a joint beside the other one, whose pose is known."""

from navapp.joint.knee_search import KneeSearch
from navapp.joint.occluded_tracker import OccludedTracker

__all__ = ["KneeSearch", "OccludedTracker"]
