"""What has been cut of the bones, and what was made against the plan."""

from navapp.resection.cut_bone import CutBone
from navapp.resection.face_meter import FaceMeter
from navapp.resection.hole_meter import HoleMeter
from navapp.resection.thickness import Thickness, measure_thickness

__all__ = ["CutBone", "FaceMeter", "HoleMeter", "Thickness", "measure_thickness"]
