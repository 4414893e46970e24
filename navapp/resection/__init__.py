"""What has been cut of the bones, and what was made against the plan."""

from navapp.resection.caliper import CaliperPoint, find_face, list_caliper_points, needs_caliper
from navapp.resection.cut_bone import CutBone
from navapp.resection.face_meter import HIGHLIGHT_PX, FaceMeter
from navapp.resection.hole_meter import HoleMeter
from navapp.resection.remaining_bone import Cut
from navapp.resection.thickness import Thickness, measure_thickness

__all__ = [
    "HIGHLIGHT_PX",
    "CaliperPoint",
    "Cut",
    "CutBone",
    "FaceMeter",
    "HoleMeter",
    "Thickness",
    "find_face",
    "list_caliper_points",
    "measure_thickness",
    "needs_caliper",
]
