"""Where the bone will be: constant velocity, damped, forgotten after a loss."""

from dataclasses import dataclass, field, replace

import numpy as np

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration.verdict import is_place_doubted
from navapp.tracking.box.tracker import BoxState
from navapp.values import Reason, Status, TrackedFrame

# All chosen. A patient's limb slows down: the prediction takes this part of the last velocity.
_DAMPING = 0.7
# What is left of an older change of the velocity, frame by frame.
_FADING = 0.8
# A gap longer than this says nothing about the velocity any more.
_MAX_GAP_NS = 400_000_000
# A search takes as long as many frames. While it finds nothing it is made again after twice as many
# frames, at most so many: where the bone is in doubt, and where it is lost.
_MOST_BETWEEN_SEARCHES, _MOST_BETWEEN_SEARCHES_LOST = 8, 4


@dataclass(frozen=True, slots=True, eq=False)
class TrackState:
    """What is remembered of one bone from frame to frame."""

    left_from_bone: RigidTransform  # pose of the newest frame that was not lost
    captured_ns: int  # when that was
    # (6,) twist per second (mm/s, rad/s), left, about the model's centre; None: not known.
    velocity: FloatArray | None
    n_lost: int = 0  # frames lost since then
    n_searches: int = 0  # searches made in these frames
    # consecutive frames in doubt; a lost frame leaves it, a frame in which a search could gain
    # nothing sets it to 0, a doubtful glance to 1
    n_doubted: int = 0
    # of the bone in the newest picture, and what it looks like; None before the first.
    box: BoxState | None = None
    # where something that it goes with has carried it by now, left camera from bone.
    expected: RigidTransform | None = None
    # (6,) by how much the velocity has changed from frame to frame of late; it fades.
    velocity_change: FloatArray = field(default_factory=lambda: np.zeros(6))
    cause: Reason | None = None  # what was found to be wrong for good, until a frame is OK
    is_glossy: bool = False  # the newest pose was measured without highlights

    @classmethod
    def at_rest(
        cls, left_from_bone: RigidTransform, captured_ns: int, cause: Reason | None = None
    ) -> "TrackState":
        """A pose of whose motion nothing is known, and what is wrong for good with it."""
        return cls(left_from_bone, captured_ns, None, cause=cause)

    @property
    def is_search_due(self) -> bool:
        """Whether the next frame, if in doubt too, is searched elsewhere: ever more rarely.

        The first doubtful frame begins no search: usually the next one is sure again.
        """
        return self.n_doubted > 0 and _is_due(self.n_doubted, _MOST_BETWEEN_SEARCHES)

    @property
    def is_search_after_loss_due(self) -> bool:
        """Whether the next frame, if lost as well, is searched where the bone was not expected."""
        return _is_due(self.n_lost, _MOST_BETWEEN_SEARCHES_LOST)

    def predict(self, captured_ns: int, centre_mm: FloatArray) -> RigidTransform:
        """The pose expected at a moment; where it was last seen after a long gap."""
        if self.expected is not None:
            return self.expected
        elapsed_ns = captured_ns - self.captured_ns
        if self.velocity is None or elapsed_ns > _MAX_GAP_NS:
            return self.left_from_bone
        seconds = elapsed_ns / 1e9
        twist = _DAMPING * seconds * self.velocity
        return self.left_from_bone.move(twist, self.left_from_bone.apply(centre_mm))

    def carry(self, moved: RigidTransform) -> "TrackState":
        """Expected to have moved with something else, whose motion is given in the left camera."""
        return replace(self, expected=moved @ self.left_from_bone)

    def is_recent(self, captured_ns: int) -> bool:
        """Whether the bone was seen so shortly before a moment that its way tells its velocity."""
        return self.n_lost == 0 and 0 < captured_ns - self.captured_ns <= _MAX_GAP_NS

    def find_velocity(self, captured_ns: int, centre_mm: FloatArray) -> FloatArray | None:
        """(6,) as of `velocity`, with which it has moved until a moment; None: not known."""
        if not self.is_recent(captured_ns):
            return None
        if self.expected is None:
            return self.velocity
        return self._velocity_to(self.expected, captured_ns, centre_mm)

    def update(
        self,
        tracked: TrackedFrame,
        captured_ns: int,
        centre_mm: FloatArray,
        *,
        follows_refused: bool = False,
    ) -> "TrackState":
        """After a frame; the pose stays when the bone was lost or something else was found.

        With `follows_refused` whatever pose there is is followed.
        """
        pose = tracked.left_from_bone
        verdict = tracked.verdict
        # What lies far from where it was expected, and fits badly too, is something else.
        is_another_thing = Reason.JUMPED in verdict.reasons and is_place_doubted(verdict)
        is_refused = verdict.status is Status.LOST or is_another_thing
        if pose is None or (is_refused and not follows_refused):
            place = self.left_from_bone if self.expected is None else self.expected
            lost = replace(self, left_from_bone=place, velocity=None, expected=None)
            return replace(lost, n_lost=self.n_lost + 1, cause=verdict.cause)
        velocity = None
        if self.is_recent(captured_ns) and Reason.JUMPED not in verdict.reasons:
            velocity = self._velocity_to(pose, captured_ns, centre_mm)
        return TrackState(
            pose,
            captured_ns,
            velocity,
            n_doubted=self.n_doubted + 1 if is_worth_a_search(tracked) else 0,
            box=self.box,
            velocity_change=self._change_to(velocity),
            cause=verdict.cause,
            is_glossy=tracked.is_matte,
        )

    def _velocity_to(
        self, pose: RigidTransform, captured_ns: int, centre_mm: FloatArray
    ) -> FloatArray:
        """(6,) mean since it was seen last."""
        elapsed_s = (captured_ns - self.captured_ns) / 1e9
        return self.left_from_bone.twist_to(pose, centre_mm) / elapsed_s

    def _change_to(self, velocity: FloatArray | None) -> FloatArray:
        """(6,) `velocity_change` with one more frame; of a first velocity all of it."""
        if velocity is None:
            return np.zeros(6)
        before = np.zeros(6) if self.velocity is None else self.velocity
        return np.maximum(np.abs(velocity - before), _FADING * self.velocity_change)


def _is_due(n: int, most: int) -> bool:
    """Whether n is one of 0, 1, 2, 4, 8, ..., which go on in steps of `most`, a power of two."""
    return n % most == 0 or (n < most and n & (n - 1) == 0)


def is_worth_a_search(tracked: TrackedFrame) -> bool:
    """Whether the place is in doubt, and a search could find one that is not.

    While the cameras' rows disagree no answer can be OK: only a lost bone has something to gain.
    """
    is_lost = tracked.verdict.status is Status.LOST
    return is_place_doubted(tracked.verdict) and (is_lost or not tracked.rows_disagree)
