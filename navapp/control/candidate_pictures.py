"""Pictures of several candidates, to be compared before one of them is accepted."""

from collections.abc import Mapping, Sequence

from navapp.control.bone_tracks import Candidate
from navapp.control.pictures import Composer, Image
from navapp.control.states import Snapshot
from navapp.values import Status


class CandidatePictures:
    """Draws all candidates in the frame in which one of them comes under review, or is lost.

    Only that one is followed from then on; the others are drawn where they were last seen.

    Args:
        composer: draws.
    """

    def __init__(self, composer: Composer) -> None:
        self._composer = composer
        # The candidate that was under review then, and the numbers of those that were lost.
        self._drawn_of: tuple[int | None, frozenset[int]] | None = None
        self._pictures: Mapping[int, Image] = {}

    def update(
        self, left: Image, snapshot: Snapshot, candidates: Sequence[Candidate]
    ) -> Mapping[int, Image]:
        """By their numbers; none of a candidate that waits alone.

        Args:
            left: picture of the newest frame.
            snapshot: of that frame.
            candidates: that wait for a decision.
        """
        lost = frozenset(
            one.number for one in candidates if one.tracked.verdict.status is Status.LOST
        )
        drawn_of = snapshot.candidate_id, lost
        if len(candidates) < 2:
            self._drawn_of, self._pictures = None, {}
        elif snapshot.is_candidate and drawn_of != self._drawn_of:
            self._drawn_of = drawn_of
            drawn = {one.number: self._draw(left, snapshot, one) for one in candidates}
            self._pictures = {key: image for key, image in drawn.items() if image is not None}
        return self._pictures

    def _draw(self, left: Image, snapshot: Snapshot, candidate: Candidate) -> Image | None:
        pose, status = candidate.track.left_from_bone, candidate.tracked.verdict.status
        return self._composer.draw_candidate(left, pose, status, snapshot)
