"""Whether the rig still stands as it was calibrated: the rows of live pairs, a known length.

A rig that was found moved is not believed again in the same session.
"""

from collections import deque

import numpy as np

from drivers.frames import StereoFrame
from navapp.control.board_watch import BoardWatch
from navapp.control.bone_motion import BoneMotion
from navapp.control.commands import DistrustRig
from navapp.control.display_link import DisplayLink
from navapp.control.length_check import Finding, LengthCheck
from navapp.control.session import Session
from navapp.control.states import EventLevel
from navapp.values import RowCheck

# Longer than a breath takes: a leg that moves between the two exposures of a pair moves to and fro,
# and the rows it puts off change their sign.
_WINDOW_NS = 5_000_000_000
_LEAST_SPAN_NS, _FEWEST_PAIRS = 4_000_000_000, 10
# A single pair may be wrong either way.
_MOST_SHARE = 0.9
# A bone's speed is hardly ever known twice as wrong.
_MOST_EXPLAINED = 0.5


class RowWatch:
    """Finds rows that disagree for so long, and so alike, that only a moved rig explains it."""

    def __init__(self) -> None:
        self._told: deque[tuple[int, RowCheck]] = deque()

    def add(self, rows: RowCheck | None, captured_ns: int, motion_px: float) -> str:
        """What is wrong with the rig, after one more pair; empty while nothing is sure.

        Args:
            rows: of the pair; None when they say nothing.
            captured_ns: when.
            motion_px: by how much they may disagree because the bone moves between the exposures.
                A leg that is carried steadily does not change its sign as a breath does.
        """
        while self._told and captured_ns - self._told[0][0] > _WINDOW_NS:
            self._told.popleft()
        if rows is None or (rows.is_off and motion_px > _MOST_EXPLAINED * abs(rows.offset_px)):
            return ""
        self._told.append((captured_ns, rows))
        span_ns = captured_ns - self._told[0][0]
        if span_ns < _LEAST_SPAN_NS or len(self._told) < _FEWEST_PAIRS:
            return ""
        signs = np.array([np.sign(one.offset_px) * one.is_off for _, one in self._told])
        if max(np.mean(signs > 0), np.mean(signs < 0)) < _MOST_SHARE:
            return ""
        offset_px = float(np.median([one.offset_px for _, one in self._told]))
        where = "low" if offset_px > 0 else "high"
        return f"the right picture shows everything {abs(offset_px):.2f} px too {where}"


class RigWatch:
    """Checks the rig of a session with every frame, and ends the session's trust in it.

    Args:
        session: that is told.
        display: goes dark.
        motion: of the followed bone.
        board: looks for a known length; None: nobody does.
    """

    def __init__(
        self, session: Session, display: DisplayLink, motion: BoneMotion, board: BoardWatch | None
    ) -> None:
        self._session, self._display, self._board = session, display, board
        self._motion = motion
        self._rows = RowWatch()

    @property
    def has_board(self) -> bool:
        """A known length is looked for."""
        return self._board is not None

    @property
    def length_check(self) -> LengthCheck | None:
        """The newest that says something of the rig, else the newest; None before the first."""
        return None if self._board is None else self._board.judged or self._board.newest

    @property
    def unjudged(self) -> LengthCheck | None:
        """The newest, as long as it says nothing yet; None when it does."""
        newest = None if self._board is None else self._board.newest
        return None if newest is None or newest.is_judged else newest

    def take_over(self) -> None:
        """Before a frame: tell what was measured on an earlier one."""
        session = self._session
        found = None if self._board is None else self._board.take_over()
        if found is None or session.rig_error is not None:
            return
        if found.finding is Finding.OFF:
            self._tell_moved(str(found))
        elif found.finding is Finding.WITHIN:
            session.add_event("rig", f"rig checked: {found}")
        else:
            session.add_event("rig", f"rig in doubt, check it: {found}", EventLevel.WARNING)

    def check_frame(self, frame: StereoFrame) -> None:
        """After a frame: check its rows, and look for the board when it is time."""
        if self._session.rig_error is not None:
            return
        tracked = self._session.tracked
        motion_px = self._motion.row_px(frame, tracked)
        rows = None if tracked is None else tracked.rows
        why = self._rows.add(rows, frame.captured_ns, motion_px)
        if why:
            self._tell_moved(why)
        elif self._board is not None:
            self._board.look(frame)

    def distrust(self, command: DistrustRig) -> None:
        """Darken the display and put the session into a fault that does not end."""
        self._display.darken()
        self._session.distrust_rig(command.why)

    def _tell_moved(self, why: str) -> None:
        # A replay cannot look again as fast as the session did, or follows otherwise: it is told.
        command = DistrustRig(why)
        self._session.tell_command(command)
        self.distrust(command)

    def close(self) -> None:
        """Wait for a look that still runs."""
        if self._board is not None:
            self._board.close()
