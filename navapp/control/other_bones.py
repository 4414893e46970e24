"""The other bones, which are not the stage's, are followed at a lower rate.

Once accepted, a bone is followed while another stage is in force, too: one such bone in every
second frame, after the picture was shown. With three bones the two others take turns.
"""

from dataclasses import dataclass

from drivers.frames import StereoFrame
from navapp.control.bone_tracks import BoneTracks
from navapp.control.stages import stage_of
from navapp.control.states import OtherBone
from navapp.geometry.transform import RigidTransform
from navapp.values import Plan, StageSpec, Status, TrackedFrame, Verdict


@dataclass(frozen=True, slots=True)
class _Sight:
    """What was last said of a bone."""

    verdict: Verdict
    # when the newest frame in which it was OK was captured; None when there was none.
    ok_ns: int | None = None
    # where the stage's bone was in the same frame; None when that was not OK.
    active: RigidTransform | None = None
    track_number: int = 0  # of that pose


class OtherBones:
    """Follows the other bones in turns, and keeps the last verdict on each.

    Turns go by the count of handled frames, never by the time: a recorded session replays to them.

    Args:
        tracks: of all bones of the session.
        plan: whose stages say by what goal a bone is judged.
        unasked: bones that are registered in their turns and taken without an operator's word.
    """

    def __init__(self, tracks: BoneTracks, plan: Plan, unasked: tuple[str, ...] = ()) -> None:
        self._tracks = tracks
        self._plan = plan
        self._unasked = unasked
        self._n_frames = 0
        self._sights: dict[str, _Sight] = {}

    def follow(
        self, stage: StageSpec, frame: StereoFrame, active: TrackedFrame | None
    ) -> dict[str, TrackedFrame]:
        """Follow one of them into a frame, if it is one's turn: each by its own stage's goal.

        The bones of a leg move together, but for what the knee bends: where the active one has
        gone since, the other one is expected to have gone, too.

        Args:
            stage: in force; its bone is none of the others.
            frame: the next one.
            active: what was said of the stage's bone in that frame.
        """
        turn, is_odd = divmod(self._n_frames, 2)
        self._n_frames += 1
        names = self._names(stage)
        self._sights.pop(stage.bone, None)
        if is_odd or not names:
            return {}
        name = names[turn % len(names)]
        own, known = stage_of(name, self._plan), _ok_pose(active)
        if self._tracks.is_accepted(own):
            tracked = self._tracks.glance(own, frame, self._active_motion(name, known))
        else:
            tracked = self._tracks.register_now(own, frame)
        self._remember(name, tracked.verdict, frame.captured_ns, known)
        return {name: tracked}

    def forget(self) -> None:
        """Forget the verdicts; the tracks stay."""
        self._sights = {}

    def describe(self, stage: StageSpec, now_ns: int) -> tuple[OtherBone, ...]:
        """What is known of each, as of now."""
        return tuple(self._describe(name, now_ns) for name in self._names(stage))

    def _describe(self, name: str, now_ns: int) -> OtherBone:
        sight = self._sights.get(name)
        if sight is None:
            return OtherBone(name)
        age_ms = None if sight.ok_ns is None else (now_ns - sight.ok_ns) / 1e6
        return OtherBone(name, sight.verdict, age_ms)

    def _names(self, stage: StageSpec) -> list[str]:
        known = dict.fromkeys((*self._unasked, *self._tracks.accepted))
        return [name for name in known if name != stage.bone]

    def _active_motion(self, name: str, active: RigidTransform | None) -> RigidTransform | None:
        """How the stage's bone has moved since a bone's last turn, if that is known."""
        sight = self._sights.get(name)
        if sight is None or sight.active is None or active is None:
            return None
        # From one candidate to another nothing has moved.
        now = self._tracks.track_number, active.source
        is_same = (sight.track_number, sight.active.source) == now
        return active @ sight.active.inverse() if is_same else None

    def _remember(
        self, name: str, verdict: Verdict, captured_ns: int, active: RigidTransform | None
    ) -> None:
        before = self._sights.get(name, _Sight(verdict))
        ok_ns = captured_ns if verdict.status is Status.OK else before.ok_ns
        self._sights[name] = _Sight(verdict, ok_ns, active, self._tracks.track_number)


def _ok_pose(active: TrackedFrame | None) -> RigidTransform | None:
    """Where the stage's bone is, when that is OK."""
    if active is None or active.verdict.status is not Status.OK:
        return None
    return active.left_from_bone
