"""Operators who confirm crosses that they did not align."""

from dataclasses import dataclass

import numpy as np

from calibration.mirror.alignments import MOST_ALIGNMENTS, solve_alignments
from navapp.control.commands import NudgeCross
from navapp.control.mirror_alignment.alignment import MirrorAlignment
from navapp.control.mirror_alignment.states import Confirm
from sim_devices.aligning_eye import AligningEye
from tests.control.mirror_alignment.rooms import (
    MirrorRoom,
    align,
    alignment_in,
    steps,
)
from tests.geometry.test_display_model_errors import seen_beside_mm

# Aligned so badly, the crosses before are refused.
SHAKING_PX = 3.0
TOKEN_MOVES = {"token": NudgeCross(1, 0), "enter": None}
_N_ANATOMY = 200


@dataclass(frozen=True, slots=True)
class Ended:
    """What became of a calibration."""

    n_kept: int
    is_accepted: bool
    error_mm: float  # predicted, 95 %; not a number without a solution
    true_mm: float  # at the anatomy, 95 %

    @property
    def is_false(self) -> bool:
        """Accepted, with an error that is larger than the predicted one."""
        return self.is_accepted and not self.true_mm <= self.error_mm


def confirm_blindly(seed: int, n_aligned: int, move: NudgeCross | None) -> Ended:
    """Align some crosses with a shaking hand, then no more: move each so, and confirm it.

    Ends when it is accepted, when nothing is kept any more, or with the most alignments.
    """
    room = MirrorRoom(seed)
    room.eye = AligningEye(room.setup, seed, SHAKING_PX)
    session = alignment_in(room, solve=solve_alignments)
    align(room, session, n_aligned)
    n_kept = -1
    while not session.snapshot.is_accepted and n_kept < session.snapshot.n_kept < MOST_ALIGNMENTS:
        n_kept = session.snapshot.n_kept
        for _ in range(30):
            if session.snapshot.corner is None:
                session.step()
        if move is not None:
            session.submit(move)
        session.submit(Confirm())
        steps(session, 2)
    return _end(room, session)


def _end(room: MirrorRoom, session: MirrorAlignment) -> Ended:
    verdict, found = session.snapshot.verdict, session._solution.found
    if verdict is None or found is None:
        return Ended(session.snapshot.n_kept, False, float("nan"), float("nan"))
    half_mm = np.array([30.0, 30.0, 25.0])
    rng = np.random.default_rng(9)
    points = room.setup.site_mm + rng.uniform(-1.0, 1.0, (_N_ANATOMY, 3)) * half_mm
    true_mm = float(np.quantile(seen_beside_mm(found.model, room.true, points, points), 0.95))
    return Ended(session.snapshot.n_kept, verdict.is_accepted, verdict.error_mm, true_mm)
