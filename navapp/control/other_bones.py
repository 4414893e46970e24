"""The other bones, which are not the stage's, are followed at a lower rate.

Once accepted, a bone is followed while another stage is in force, too: one such bone in every
second frame, after the picture was shown. With three bones the two others take turns. A tibia that
was asked for is found from the femur.
"""

from collections.abc import Callable
from dataclasses import dataclass

from drivers.frames import StereoFrame
from navapp.control.beside_femur import BesideFemur, FoundBone
from navapp.control.bone_tracks import BoneTracks
from navapp.control.stages import stage_of
from navapp.control.states import LimbLine, OtherBone
from navapp.geometry.transform import RigidTransform
from navapp.limb import FEMUR, TIBIA, LimbMeasurement
from navapp.values import Plan, StageSpec, Status, TrackedFrame, Verdict


@dataclass(frozen=True, slots=True)
class AskedBones:
    """Other bones that are looked for without having been accepted."""

    names: tuple[str, ...] = ()
    is_each: bool = False  # every frame is the turn of each, and stands for itself
    # An operator is asked: only what is beside an accepted bone and OK is followed, and a search
    # that found nothing is made again only after `turns_between`.
    is_live: bool = False
    turns_between: int = 8  # chosen


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
        beside: finds the tibia from the femur.
        asked: bones that are looked for in their turns.
        tell_take_over: told in which frame the result of a search is used.
    """

    def __init__(
        self,
        tracks: BoneTracks,
        plan: Plan,
        beside: BesideFemur,
        asked: AskedBones | None = None,
        tell_take_over: Callable[[int], None] = lambda sequence: None,
    ) -> None:
        self._tracks, self._plan, self._beside = tracks, plan, beside
        self._asked = asked or AskedBones()
        self._tell_take_over = tell_take_over
        self._n_frames = 0
        self._turns_to_search = 0
        self._sights: dict[str, _Sight] = {}
        # The newest measurement, and when its picture was captured.
        self._limb: tuple[LimbMeasurement, int] | None = None

    def follow(
        self,
        stage: StageSpec,
        frame: StereoFrame,
        active: TrackedFrame | None,
        *,
        is_accepted: bool = True,
    ) -> dict[str, TrackedFrame]:
        """Follow one of them into a frame, if it is one's turn: each by its own stage's goal.

        The bones of a leg move together, but for what the knee bends: where the active one has
        gone since, the other one is expected to have gone, too.

        Args:
            stage: in force; its bone is none of the others.
            frame: the next one.
            active: what was said of the stage's bone in that frame.
            is_accepted: that bone's pose was accepted; a tibia is found from no other.
        """
        turn, is_odd = divmod(self._n_frames, 2)
        self._n_frames += 1
        names = self._names(stage)
        self._sights.pop(stage.bone, None)
        known = _ok_pose(active)
        if not self._asked.is_each:
            names = [] if is_odd or not names else [names[turn % len(names)]]
        answers = {}
        for name in names:
            tracked = self._follow(
                name, stage.bone, frame, known, is_trusted=self._trusts(is_accepted)
            )
            if tracked is not None:
                self._remember(name, tracked.verdict, frame.captured_ns, known)
                answers[name] = tracked
        return answers

    def _follow(
        self,
        name: str,
        active_bone: str,
        frame: StereoFrame,
        active: RigidTransform | None,
        *,
        is_trusted: bool,
    ) -> TrackedFrame | None:
        """What is said of a bone in its turn; None while nothing is known of it."""
        own, tracked = stage_of(name, self._plan), None
        is_asked = name in self._asked.names
        if is_asked and self._asked.is_each:
            self._tracks.forget(name)
        is_beside = is_trusted and active is not None and self._beside.can_find(name, active_bone)
        # What was found behind the femur is known as well as told only there.
        is_found = self._tracks.is_found(own)
        if self._tracks.is_followed(own) and (is_beside or not is_found):
            known = active if is_beside else None
            tracker = self._beside.tracker(name, known, is_found=is_found)
            moved = self._active_motion(name, active)
            tracked = self._tracks.glance(own, frame, moved, tracker)
        if active is not None and is_beside and is_asked:
            return self._search(own, frame, active, tracked)
        if tracked is None and is_asked and not self._asked.is_live:
            return self._tracks.register_now(own, frame)
        return tracked

    def _trusts(self, is_accepted: bool) -> bool:
        """Whether the active bone's pose counts for others: in a replay nobody is asked."""
        return is_accepted or not self._asked.is_live

    def _search(
        self,
        own: StageSpec,
        frame: StereoFrame,
        left_from_femur: RigidTransform,
        tracked: TrackedFrame | None,
    ) -> TrackedFrame | None:
        """The better one of an answer and of a search, which is made while it is not OK."""
        if tracked is not None and tracked.verdict.status is Status.OK:
            self._beside.cancel()
            return tracked
        self._turns_to_search -= 1
        if not self._beside.is_searching and self._turns_to_search < 0:
            self._turns_to_search = self._asked.turns_between if self._asked.is_live else 0
            self._beside.start(own, frame, left_from_femur, self._tracks.track_number)
        found = self._beside.take_due(frame.sequence)
        if found is None:
            return tracked
        self._tell_take_over(frame.sequence)
        if tracked is not None and tracked.verdict.rank <= found.tracked.verdict.rank:
            return tracked
        return self._take(own, frame, left_from_femur, found) or tracked

    def _take(
        self,
        own: StageSpec,
        frame: StereoFrame,
        left_from_femur: RigidTransform,
        found: FoundBone,
    ) -> TrackedFrame | None:
        """Follow what a search has found, into this frame if it was found in an earlier one."""
        is_now = found.captured_ns == frame.captured_ns
        if self._asked.is_live and found.tracked.verdict.status is not Status.OK:
            return found.tracked if is_now else None
        if not is_now and found.track_number != self._tracks.track_number:
            return None
        self._tracks.take(own, found.tracked, found.captured_ns)
        self._beside.keep(found)
        if is_now or not self._tracks.is_followed(own):
            return found.tracked
        moved = left_from_femur @ found.left_from_femur.inverse()
        tracker = self._beside.tracker(own.bone, left_from_femur, is_found=True)
        return self._tracks.glance(own, frame, moved, tracker)

    def measure_limb(
        self,
        stage: StageSpec,
        frame: StereoFrame,
        active: TrackedFrame | None,
        others: dict[str, TrackedFrame],
        *,
        is_accepted: bool = True,
    ) -> LimbMeasurement | None:
        """What femur and tibia say together, when both are OK in this very frame.

        Nothing while the active bone's pose is not accepted.
        """
        if active is None or not self._trusts(is_accepted):
            return None
        answers = {**others, stage.bone: active}
        if not {FEMUR, TIBIA} <= set(answers):
            return None
        femur, tibia = answers[FEMUR], answers[TIBIA]
        if not all(one.verdict.status is Status.OK for one in (femur, tibia)):
            return None
        if femur.estimate is None or tibia.estimate is None:
            return None
        measured = self._beside.measure_limb(femur.estimate, tibia.estimate)
        self._limb = measured, frame.captured_ns
        return measured

    def describe_limb(self, stage: StageSpec, now_ns: int) -> LimbLine | None:
        """What they said together last; None while they are not both followed."""
        if not {FEMUR, TIBIA} <= {stage.bone, *self._names(stage)}:
            return None
        if self._limb is None:
            return LimbLine()
        measured, captured_ns = self._limb
        return LimbLine(measured, (now_ns - captured_ns) / 1e6)

    def forget(self) -> None:
        """Forget the verdicts; the tracks stay."""
        self._beside.cancel()
        self._sights, self._limb = {}, None

    def close(self) -> None:
        """End what runs."""
        self._beside.close()

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
        known = dict.fromkeys((*self._asked.names, *self._tracks.accepted))
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
