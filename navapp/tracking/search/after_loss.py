"""After a loss: around the last pose, and in every other search further off.

A search has no time for all starts further off: each tries a part of them that is spread over all
directions, until every start had its turn.
"""

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration import make_scattered_starts, select_poses
from navapp.tracking.frame import Fit, Frame
from navapp.tracking.scoring import FitScorer
from navapp.tracking.search.near import NearSearch
from navapp.tracking.surface_meter import WIDE_BOX, WIDE_VIEW, SurfaceMeter

# Steps along each axis, and the tilts of each: (mm, ((deg, how many), ...)); chosen.
_RINGS = (
    (20.0, ((15.0, 6), (28.0, 12))),
    (40.0, ((20.0, 6), (35.0, 8))),
)
_PARTS = 10
# So many of the answers are measured exactly.
_N_REFINED = 2


class SearchAfterLoss:
    """Searches for one bone that was lost."""

    def __init__(self, meter: SurfaceMeter, near: NearSearch, scorer: FitScorer) -> None:
        self._meter, self._near, self._scorer = meter, near, scorer

    def find(self, frame: Frame, n_searches: int) -> list[Fit | None]:
        """Around the start; or in every other search further off. None out of view.

        So many were made since the bone was lost, before this one.
        """
        starts = make_starts_after_loss(frame.start, self._meter.model.centre_mm, n_searches)
        measured = None
        if starts:
            measured = self._meter.measure_freely(frame.pair, frame.start, WIDE_VIEW)
            frame.watch.lap("stereo")
        if measured is None or len(measured.cloud) == 0:
            return [self._near.find_freely(frame, WIDE_BOX)]
        scored = self._scorer.find_poses(measured, starts)
        poses = select_poses(scored, _N_REFINED) or [frame.start]
        # Far from where it was, a bone may look like itself in several ways.
        fits = [self._near.fit_nearby(frame, measured, pose) for pose in poses]
        return [self._scorer.rank(fits)[0]]


def make_starts_after_loss(
    last: RigidTransform, centre_mm: FloatArray, n_searches: int
) -> list[RigidTransform]:
    """Starts further off than the last pose; none in every other search.

    Args:
        last: pose of the bone when it was seen last.
        centre_mm: (3,) of the model, in bone coordinates.
        n_searches: made since the bone was lost, before this one.
    """
    if n_searches % 2 == 0:
        return []
    starts: list[RigidTransform] = []
    place_mm = last.apply(centre_mm)
    # Tilts of the last pose where it was, and a step away along each axis.
    for step_mm, tilts in _RINGS:
        starts += make_scattered_starts(last, place_mm, step_mm, tilts, has_middle=not starts)
    return starts[n_searches // 2 % _PARTS :: _PARTS]
