"""Why a pose is not good, or why nothing is shown, and what the operator can do."""

from enum import Enum


class Reason(Enum):
    """Why a pose is not good, or why nothing is shown. The value is the phrase for people."""

    # of the judge
    NO_SURFACE = "no surface was measured where the bone should be"
    TOO_FEW_POINTS = "too few points on the bone"
    COVERAGE_LOW = "too little of the bone is seen"
    SEEN_THROUGH = "something is seen where the bone should be in the way"
    SURFACE_MISFIT = "surface does not fit the model"
    SIZE_DIFFERS = "the bone seen has another size than the model"
    OUTLIERS = "too many points fit no surface of the model"
    NOT_CONVERGED = "the estimate did not settle"
    AMBIGUOUS = "a different pose fits as well"
    CUES_DISAGREE = "surface and outline do not agree"
    DEGENERATE = "the seen surface leaves a direction free"
    POSE_UNCERTAIN = "the seen surface fixes the pose too loosely"
    MOTION_UNKNOWN = "how the bone moved while the pictures were taken is not known"
    CARTILAGE_UNCERTAIN = "the plan knows the cartilage too roughly"
    TRE_TOO_LARGE = "the predicted error exceeds the stage's tolerance"
    JUMPED = "the pose jumped further than a patient moves"
    ROWS_DISAGREE = "the cameras' rows do not agree: has the rig moved?"
    PICTURE_DARK = "one picture is dark or blocked"
    PICTURE_OVEREXPOSED = "one picture is overexposed"
    PICTURES_UNLIKE = "one picture is blurred or covered"
    PICTURES_DEFOCUSED = "the pictures are out of focus"
    PICTURES_SWAPPED = "left and right pictures are swapped"
    OTHER_SIDE = "the other side's bone fits better: is it the other knee's plan?"
    RIG_NOT_ACCEPTED = "the rig's calibration was not accepted"
    OUT_OF_VIEW = "the bone is outside the picture"
    # of the session
    NOT_NAVIGATING = "no registration has been accepted"
    BONE_LOST = "the bone is lost"
    BLANKED = "blanked by the operator"
    CAMERA_SILENT = "the camera sends no picture"
    DEVICE_FAULT = "a device has failed"
    RIG_MOVED = "rig moved, recalibrate"
    MIRROR_AWAY = "the mirror does not stand where the display was calibrated"
    PROJECTOR_ALTERS = "the projector alters the picture"
    PROJECTOR_LOST = "the projector does not answer"
    DISPLAY_DIFFERS = "the display is not as calibrated in the mirror"
    DISPLAY_NOT_ACCEPTED = "the calibration of the mirror was not accepted"
    DISPLAY_EXPIRED = "the calibration of the mirror has expired"
    MOVES_TOO_FAST = "the bone moves too fast for the display"
    OTHER_EYE = "guides are more than 1 mm off for the other eye"
    MIRROR_INEXACT = "guides in the mirror may be off by more than the stage allows"
    MIRROR_UNCHECKED = "nobody has checked what is seen in the mirror"
    MIRROR_CHECK_FAILED = "the check of the mirror has failed"
    MIRROR_CHECK_OLD = "the check of the mirror is too old"
    POSE_TOO_OLD = "the pose is too old"
    TOO_SLOW = "this computer is too slow for guides"
    STAGE_WITHOUT_BONE = "the plan has no model of this stage's bone"
    CHECK_FAILED = "the check on the patient failed"
    TIME_OUT_OPEN = "the time-out checklist is not done"

    @property
    def remedy(self) -> str:
        """What the operator can do."""
        return _REMEDIES[self]


_REMEDIES = {
    Reason.NO_SURFACE: "aim the cameras at the bone, or check the light",
    Reason.TOO_FEW_POINTS: "clear the view, or check the light",
    Reason.COVERAGE_LOW: "move the instrument or hand away",
    Reason.SEEN_THROUGH: "check that this is the right bone and plan; register again",
    Reason.SURFACE_MISFIT: "check that this is the right bone and plan; register again",
    Reason.SIZE_DIFFERS: "check that this is the right plan, and its scale",
    Reason.OUTLIERS: "clear the view of the bone; register again",
    Reason.NOT_CONVERGED: "hold still, or register again",
    Reason.AMBIGUOUS: "expose more of the bone, or start nearer to it",
    Reason.CUES_DISAGREE: "check that this is the right bone and plan; register again",
    Reason.DEGENERATE: "expose more of the bone",
    Reason.POSE_UNCERTAIN: "move the instrument or hand away, or expose more of the bone",
    Reason.MOTION_UNKNOWN: "hold still; cameras that expose all rows at once do not need it",
    Reason.CARTILAGE_UNCERTAIN: "give the plan a surface of the cartilage",
    Reason.TRE_TOO_LARGE: "expose more of the bone, or come closer",
    Reason.JUMPED: "wait for the next frames, or register again",
    Reason.ROWS_DISAGREE: "hold still; if it stays, calibrate the rig again",
    Reason.PICTURE_DARK: "uncover both cameras, or check the light",
    Reason.PICTURE_OVEREXPOSED: "turn the light or the exposure down",
    Reason.PICTURES_UNLIKE: "clean and uncover both cameras",
    Reason.PICTURES_DEFOCUSED: "focus both cameras, and clean their lenses",
    Reason.PICTURES_SWAPPED: "swap the cameras' cables, or their names in the settings",
    Reason.OTHER_SIDE: "check the patient, the side and the plan; load the right one",
    Reason.RIG_NOT_ACCEPTED: "calibrate the rig again",
    Reason.OUT_OF_VIEW: "bring the bone back into both pictures",
    Reason.NOT_NAVIGATING: "register, then accept the candidate",
    Reason.BONE_LOST: "clear the view; it is searched for where it was last seen",
    Reason.BLANKED: "press the show key to leave blank",
    Reason.CAMERA_SILENT: "check the camera's cable",
    Reason.DEVICE_FAULT: "see the events, then check the device",
    Reason.RIG_MOVED: "end the session; check the rig on the board, or calibrate it",
    Reason.MIRROR_AWAY: "reopen brings it back; keep hands off, see the devices",
    Reason.PROJECTOR_ALTERS: "set flips, keystone, freeze and source back on the projector",
    Reason.PROJECTOR_LOST: "check its mains, its lamp and its control cable",
    Reason.DISPLAY_DIFFERS: "set its size and flips back, or calibrate",
    Reason.DISPLAY_NOT_ACCEPTED: "calibrate the mirror again",
    Reason.DISPLAY_EXPIRED: "calibrate the mirror again",
    Reason.MOVES_TOO_FAST: "hold the leg still until it is shown again",
    Reason.OTHER_EYE: "cover it and say so ([mirror] eyes), or move the display",
    Reason.MIRROR_INEXACT: "bring the display's picture nearer to the bone, or calibrate again",
    Reason.MIRROR_UNCHECKED: "check it on three corners of a board, or points of the bone",
    Reason.MIRROR_CHECK_FAILED: "look from the calibrated place and check again, or calibrate",
    Reason.MIRROR_CHECK_OLD: "check it again on three corners or points",
    Reason.POSE_TOO_OLD: "wait for the next frame",
    Reason.TOO_SLOW: "end other programs, or use a faster computer",
    Reason.STAGE_WITHOUT_BONE: "add the bone's surface to the plan",
    Reason.CHECK_FAILED: "register again, or check again on the page of the tools (u)",
    Reason.TIME_OUT_OPEN: "confirm patient, side and plan on the page of the gates",
}


# What stays wrong until somebody mends it: told in front of the reasons of a bone that is not OK.
CAUSES = (Reason.PICTURES_SWAPPED, Reason.OTHER_SIDE)
