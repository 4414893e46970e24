"""What flows between the steps: plain values, no behaviour beyond small derivations.

Lengths are mm; a pose is `left_from_<bone>`: the left camera before rectification, OpenCV axes.
"""

from navapp.values.bones import (
    FOLLOWED_BONES,
    AspectGraph,
    BoneModel,
    FollowedBone,
    Side,
)
from navapp.values.conditions import Condition, ConditionKind
from navapp.values.contents import (
    ANKLE_CENTRE,
    HIP_CENTRE,
    Box,
    Cylinder,
    Defect,
    DrillAxis,
    Landmark,
    Part,
    PlannedStep,
    ResectionPlane,
    RiskStructure,
    Shape,
    Sphere,
    StageContent,
    StepKind,
    SurgicalContent,
    kind_of,
)
from navapp.values.estimates import PoseEstimate, SizedPose
from navapp.values.faces import MeasuredFace, join_faces
from navapp.values.holes import Measured, MeasuredHole, join_measured
from navapp.values.measured import (
    DisparityMap,
    Foreground,
    Origin,
    RowCheck,
    SurfaceCloud,
    Surroundings,
)
from navapp.values.pictures import DEPTH_COLOURS, OverlayMode, OverlayPicture
from navapp.values.plans import FEWEST_PICKS, Pick, Plan, Prior, StageSpec, find_crowded
from navapp.values.reasons import Reason
from navapp.values.stereo_pictures import StereoPictures
from navapp.values.timings import FrameTimings, Stopwatch
from navapp.values.verdicts import Status, TrackedFrame, Verdict

__all__ = [
    "ANKLE_CENTRE",
    "DEPTH_COLOURS",
    "FEWEST_PICKS",
    "FOLLOWED_BONES",
    "HIP_CENTRE",
    "AspectGraph",
    "BoneModel",
    "Box",
    "Condition",
    "ConditionKind",
    "Cylinder",
    "Defect",
    "DisparityMap",
    "DrillAxis",
    "FollowedBone",
    "Foreground",
    "FrameTimings",
    "Landmark",
    "Measured",
    "MeasuredFace",
    "MeasuredHole",
    "Origin",
    "OverlayMode",
    "OverlayPicture",
    "Part",
    "Pick",
    "Plan",
    "PlannedStep",
    "PoseEstimate",
    "Prior",
    "Reason",
    "ResectionPlane",
    "RiskStructure",
    "RowCheck",
    "Shape",
    "Side",
    "SizedPose",
    "Sphere",
    "StageContent",
    "StageSpec",
    "Status",
    "StepKind",
    "StereoPictures",
    "Stopwatch",
    "SurfaceCloud",
    "SurgicalContent",
    "Surroundings",
    "TrackedFrame",
    "Verdict",
    "find_crowded",
    "join_faces",
    "join_measured",
    "kind_of",
]
