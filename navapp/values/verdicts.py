"""The judge's word on a pose, and the answer for one frame that it is a part of."""

from dataclasses import dataclass, replace
from enum import Enum

from navapp.geometry.transform import RigidTransform
from navapp.values.estimates import PoseEstimate
from navapp.values.measured import Foreground, RowCheck
from navapp.values.reasons import CAUSES, Reason
from navapp.values.timings import FrameTimings


class Status(Enum):
    """The judge's word on a pose."""

    OK = "OK"
    DEGRADED = "DEGRADED"
    LOST = "LOST"


@dataclass(frozen=True, slots=True)
class Verdict:
    """The judge's answer for one frame."""

    status: Status  # only OK may be shown
    # 95 % bound of the mean error over the stage's targets, or over the visible vertices when the
    # plan names no targets; None without a pose.
    predicted_tre_mm: float | None = None
    reasons: tuple[Reason, ...] = ()  # why it is not OK
    coverage: float = 0.0  # share of the visible model that was measured and fits
    occluded_fraction: float = 0.0  # share of the visible model that something nearer hides
    inlier_fraction: float = 0.0  # share of the measured, not hidden model pixels that fit
    # rms_mm, expected_rms_mm: of the residual.
    rms_mm: float | None = None
    expected_rms_mm: float | None = None
    spread_ratio: float = 0.0  # spread of the differences to the model over the sigma they claim

    @property
    def cause(self) -> Reason | None:
        """What is wrong for good, when that was found out."""
        return next((reason for reason in self.reasons if reason in CAUSES), None)

    @property
    def rank(self) -> tuple[int, bool, float]:
        """Smaller is better: by status, then not ambiguous, then by coverage."""
        return list(Status).index(self.status), Reason.AMBIGUOUS in self.reasons, -self.coverage


@dataclass(frozen=True, slots=True, eq=False)
class TrackedFrame:
    """What a tracker answers for one frame and one bone."""

    bone: str  # its name
    estimate: PoseEstimate | None  # of its pose, None without one
    verdict: Verdict  # of the judge
    timings: FrameTimings  # of the tracker's steps
    rows: RowCheck | None = None  # what the pair says of the rig itself; None when it says nothing
    foreground: Foreground | None = None  # at the pose; None without one
    is_matte: bool = False  # measured in pictures without highlights

    @property
    def left_from_bone(self) -> RigidTransform | None:
        """The pose, when there is one."""
        return None if self.estimate is None else self.estimate.camera_from_bone

    def with_cause(self, cause: Reason | None) -> "TrackedFrame":
        """The same answer with the cause of its failure in front; an OK has none."""
        if cause is None or self.verdict.status is Status.OK:
            return self
        others = tuple(reason for reason in self.verdict.reasons if reason is not cause)
        return replace(self, verdict=replace(self.verdict, reasons=(cause, *others)))

    @property
    def rows_disagree(self) -> bool:
        """Whether the cameras' rows surely do: no pose of this pair is OK then."""
        return self.rows is not None and self.rows.is_off
