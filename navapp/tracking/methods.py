"""The trackers by the names of their methods."""

from navapp.geometry.rig import StereoRig
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.tracking.icp_tracker import IcpTracker
from navapp.tracking.tracker import Tracker, TrackerSettings
from navapp.values import AspectGraph, BoneModel


def make_tracker(
    rig: StereoRig,
    bone: BoneModel,
    settings: TrackerSettings | None = None,
    aspects: AspectGraph | None = None,
) -> Tracker:
    """The tracker of `settings.method`; see `BimccTracker` for the arguments."""
    settings = settings or TrackerSettings()
    if settings.method == "icp":
        return IcpTracker(rig, bone, settings)
    return BimccTracker(rig, bone, settings, aspects)
