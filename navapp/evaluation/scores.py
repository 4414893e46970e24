"""A frame that was judged against the truth, and its place in files."""

from dataclasses import dataclass

# Shares of errors that bounds are to hold for.
LEVELS = (0.5, 0.8, 0.95, 0.99)
# A pose that is called OK and further off than this, and than its bound, is wrong.
WRONG_MM = 1.0


@dataclass(frozen=True, slots=True)
class ErrorBudget:
    """Root mean square errors over the stage's targets, mm, from the least to what was reached."""

    limit_mm: float  # Cramer-Rao bound of the pixels that obey the model
    # of the estimator that uses each of these pixels as the model says, told which they are.
    ideal_mm: float
    matched_mm: float  # of the matcher's disparities, fitted by plain weighted least squares
    reached_mm: float  # of the method's own pose


@dataclass(frozen=True, slots=True)
class FrameScore:
    """What a method said of one frame, beside where the bone really was."""

    index: int  # of the frame in its sequence
    status: str  # the judge's word
    reasons: tuple[str, ...]
    tre_mm: float | None  # mean over the stage's targets; None without a pose or truth
    # displacement_mm, outline_mm: of the drawn bone (`overlay_error`); None as well.
    displacement_mm: float | None
    outline_mm: float | None
    bound_mm: float | None  # that the judge predicts for `tre_mm`, 95 %
    seen: float | None  # share of the bone's side towards the camera that agrees
    hidden: float | None  # share of it that something hides
    total_ms: float  # that the frame took, from rectification to overlay
    is_search: bool = False  # a registration was made in it
    # bounds for `tre_mm` at `LEVELS` that follow from the pose's covariance alone, without what the
    # judge adds for plan and rig; None without a pose.
    claimed_mm: tuple[float, ...] | None = None
    rms_ratio: float | None = None  # residual of the fit over the expected one
    budget: ErrorBudget | None = None  # measured in a part of the frames

    @property
    def is_ok(self) -> bool:
        """The judge believes it."""
        return self.status == "OK"

    @property
    def is_far(self) -> bool:
        """Its error is known, and larger than `WRONG_MM`."""
        return self.tre_mm is not None and self.tre_mm > WRONG_MM

    @property
    def is_within_bound(self) -> bool:
        """Error and predicted bound are known, and the error is below the bound."""
        if self.tre_mm is None or self.bound_mm is None:
            return False
        return self.tre_mm <= self.bound_mm

    @property
    def is_wrong(self) -> bool:
        """It is called OK, and is further off than `WRONG_MM` and than its bound."""
        return self.is_ok and self.is_far and not self.is_within_bound

    @property
    def was_followed(self) -> bool:
        """A registered bone was followed or looked for again in it, and judged; needs no truth.

        False in the frame of a registration, and as long as none has found the bone.
        """
        return self.seen is not None and not self.is_search


@dataclass(frozen=True, slots=True)
class SequenceScore:
    """The scores of one method on one sequence."""

    # until the first registration whose pose was followed, with those that failed before; None:
    # none was.
    registration_s: float | None
    n_registrations: int  # searches that were made
    frames: tuple[FrameScore, ...]  # after the frame of the first search

    @property
    def times_ms(self) -> list[float]:
        """Of the frames in which a bone was followed; those of a search are none."""
        return [frame.total_ms for frame in self.frames if frame.was_followed]
