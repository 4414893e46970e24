"""The trackers by the names of their methods."""

from navapp.geometry.rig import StereoRig
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.tracking.icp_tracker import IcpTracker
from navapp.tracking.paper_tracker import PaperTracker
from navapp.tracking.settings import Method, TrackerSettings
from navapp.tracking.tracker import Tracker
from navapp.values import AspectGraph, BoneModel

_TRACKERS: dict[Method, type[BimccTracker | IcpTracker]] = {
    "bimcc": BimccTracker,
    "paper": PaperTracker,
    "icp": IcpTracker,
}


def make_tracker(
    rig: StereoRig,
    bone: BoneModel,
    settings: TrackerSettings | None = None,
    aspects: AspectGraph | None = None,
) -> Tracker:
    """The tracker of `settings.method`; its class says what the aspects are for."""
    settings = settings or TrackerSettings()
    return _TRACKERS[settings.method](rig, bone, settings, aspects)
