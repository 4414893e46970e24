"""The corner that a cross is being aligned with, and whether it lies where the cross was put."""

from navapp.control.mirror_alignment.board_place import BoardLooks, BoardPlace

# A corner that moved by more since the cross was moved last is not where the cross was put.
MOST_MOVED_MM = 0.4
# A board that moved by more lies elsewhere.
_ELSEWHERE_MM = 5.0
# A corner that is hidden, or missed in a picture, is waited for so long.
_PATIENCE_NS = 1_500_000_000


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
        self.is_moved = False  # the cross, since it was lit

    @property
    def is_confirmed(self) -> bool:
        """The next look decides whether the alignment is kept."""
        return self._confirmed_ns is not None

    def note_nudge(self) -> None:
        """The cross was moved: from the next look on the corner must stay."""
        self._anchor, self._confirmed_ns, self.is_moved = None, None, True

    def confirm(self, now_ns: int) -> None:
        """The cross lies on the corner, now."""
        self._confirmed_ns = now_ns

    def is_elsewhere(self, place: BoardPlace) -> bool:
        """The board was carried away."""
        moved_mm = place.moved_mm(self._lit_at, self.corner)
        return moved_mm != float("inf") and moved_mm > _ELSEWHERE_MM

    def follow(self, place: BoardPlace | None) -> None:
        """Take the newest place of the board."""
        if self._anchor is None and place is not None and place.point_of(self.corner) is not None:
            self._anchor = place

    def moved_mm(self, place: BoardPlace | None) -> float | None:
        """How far the corner is from where it was when the cross was moved last."""
        if place is None or self._anchor is None:
            return None
        return place.moved_mm(self._anchor, self.corner)

    def judge(self, looks: BoardLooks, now_ns: int) -> str | None:
        """What speaks against keeping what was confirmed: empty for nothing.

        Args:
            looks: for the board.
            now_ns: when the newest picture was taken.

        Returns:
            None while nothing was confirmed, or that is not decided yet.
        """
        if self._confirmed_ns is None or now_ns < self._confirmed_ns:
            return None
        place, against = looks.newest, ""
        if place is None:
            against = "the board is not seen by both cameras"
        elif place.point_of(self.corner) is None:
            against = "the corner is not seen by both cameras"
        elif (moved_mm := self.moved_mm(place)) is not None and moved_mm > MOST_MOVED_MM:
            self._anchor, self._confirmed_ns = place, None
            return f"the board has moved by {moved_mm:.1f} mm, look again"
        elif not looks.is_still:
            against = "the board does not rest"
        if against and now_ns - self._confirmed_ns < _PATIENCE_NS:
            return None
        self._confirmed_ns = None
        return against

    def since_ns(self) -> int:
        """From when on looks show the corner where the cross was put."""
        return 0 if self._anchor is None else self._anchor.time_ns
