"""The corner that a cross is being aligned with, and whether it lies where the cross was put."""

from navapp.control.mirror_alignment.board_place import BoardLooks, BoardPlace

# A corner that moved by more since the cross was moved last is not where the cross was put.
MOST_MOVED_MM = 0.4
# A board that moved by more lies elsewhere.
_ELSEWHERE_MM = 5.0


class AimedCorner:
    """Follows one corner while its cross is moved.

    Args:
        corner: its id.
        place: of the board when the cross was lit.
    """

    def __init__(self, corner: int, place: BoardPlace) -> None:
        self.corner = corner
        self._lit_at = place
        self._anchor: BoardPlace | None = place
        self._confirmed_ns: int | None = None

    @property
    def is_confirmed(self) -> bool:
        """The next look decides whether the alignment is kept."""
        return self._confirmed_ns is not None

    def note_nudge(self) -> None:
        """The cross was moved: from the next look on the corner must stay."""
        self._anchor, self._confirmed_ns = None, None

    def confirm(self, now_ns: int) -> None:
        """The cross lies on the corner, now."""
        self._confirmed_ns = now_ns

    def is_elsewhere(self, place: BoardPlace) -> bool:
        """The board was carried away."""
        moved_mm = place.moved_mm(self._lit_at)
        return moved_mm != float("inf") and moved_mm > _ELSEWHERE_MM

    def follow(self, place: BoardPlace | None) -> None:
        """Take the newest place of the board."""
        if self._anchor is None and place is not None and place.point_of(self.corner) is not None:
            self._anchor = place

    def moved_mm(self, place: BoardPlace | None) -> float | None:
        """How far the corner is from where it was when the cross was moved last."""
        return None if place is None or self._anchor is None else place.moved_mm(self._anchor)

    def judge(self, looks: BoardLooks) -> str | None:
        """What speaks against keeping what was confirmed: empty for nothing.

        None while no picture was taken since.
        """
        place = looks.newest
        if self._confirmed_ns is None:
            return None
        if place is None:
            return self._refuse("the board is not seen by both cameras")
        if place.time_ns < self._confirmed_ns:
            return None
        if place.point_of(self.corner) is None:
            return self._refuse("the corner is not seen by both cameras")
        moved_mm = self.moved_mm(place)
        if moved_mm is not None and moved_mm > MOST_MOVED_MM:
            self._anchor = place
            return self._refuse(f"the board has moved by {moved_mm:.1f} mm, look again")
        return "" if looks.is_still else self._refuse("the board does not rest")

    def since_ns(self) -> int:
        """From when on looks show the corner where the cross was put."""
        return 0 if self._anchor is None else self._anchor.time_ns

    def _refuse(self, why: str) -> str:
        self._confirmed_ns = None
        return why
