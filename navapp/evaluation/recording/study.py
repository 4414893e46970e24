"""Methods on a recording, scored against what is known of where the bone was."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

from drivers.frames import StereoFrame
from drivers.recorded_sources import RecordedSource
from drivers.replay_camera import open_source
from navapp.config import Configuration
from navapp.errors import RigError
from navapp.evaluation.following import Answers, follow
from navapp.evaluation.methods import OURS
from navapp.evaluation.recording.divots import measure_divots
from navapp.evaluation.recording.other_tracker import SolvedFrames, find_poses, solve_frames
from navapp.evaluation.recording.truth_files import DivotTruth, PoseTruth, Truth
from navapp.evaluation.scores import FrameScore, SequenceScore
from navapp.evaluation.scoring import score_answers
from navapp.evaluation.sequence import KnownSequence
from navapp.evaluation.worst_frame import draw_frame
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from navapp.tracking import Method
from navapp.values import Plan, Prior, StageSpec

# So many of the worst frames are drawn.
_N_PICTURES = 3


class RecordedFrames(Sequence[StereoFrame]):
    """The pairs of a recording, each loaded when it is asked for.

    Args:
        source: open, and kept open by who opened it.
        rig: that took them.
        rate_hz: where the source has neither times nor a rate.
        on_load: told how many pairs there are, whenever one is loaded.
    """

    def __init__(
        self,
        source: RecordedSource,
        rig: StereoRig,
        rate_hz: float,
        on_load: Callable[[int], None] = lambda n_frames: None,
    ) -> None:
        self._source, self._rig, self._on_load = source, rig, on_load
        self.numbers = source.numbers
        period_ns = 1e9 / (source.rate_hz or rate_hz)
        times = source.times
        self.has_times = times is not None
        self.times_ns = tuple(
            round(place * period_ns) if times is None else times[place].captured_ns
            for place in range(len(source.numbers))
        )

    def __len__(self) -> int:
        return len(self.numbers)

    def __getitem__(self, place: int) -> StereoFrame:  # type: ignore[override]
        self._on_load(len(self))
        left, right = self._source.load(place)
        times, number = self._source.times, self.numbers[place]
        captured_ns = self.times_ns[place]
        skew_ns = 0 if times is None else times[place].skew_ns
        return StereoFrame(
            left, right, captured_ns, captured_ns + max(skew_ns, 0), skew_ns,
            sequence=number, rig_id=self._rig.rig_id, source_index=number,
            row_delay_ns=self._rig.row_delay_ns,
        )  # fmt: skip


@contextmanager
def open_frames(
    source: str, rig: StereoRig, rate_hz: float, on_load: Callable[[int], None]
) -> Iterator[RecordedFrames]:
    """The frames of a folder of pairs, a session folder or two videos, as `RecordedFrames` says.

    Raises:
        SequenceError: nothing there, unpaired, damaged.
        RigError: pictures of another size than the rig's.
    """
    opened = open_source(source)
    try:
        frames = RecordedFrames(opened, rig, rate_hz, on_load)
        height, width = frames[0].left.shape[:2]
        if (width, height) != (rig.width, rig.height):
            raise RigError(
                f"the pictures of {source} are {width}x{height}, the rig was calibrated at "
                f"{rig.width}x{rig.height}",
                subject=source,
                remedy="use the rig file that belongs to these pictures",
            )
        yield frames
    finally:
        opened.close()


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """What every method is given beside the pictures, and the truth that none is given."""

    name: str  # of the recording
    truth: Truth
    configuration: Configuration
    rig: StereoRig
    plan: Plan
    prior: Prior
    stage: StageSpec

    def to_sequence(
        self, frames: RecordedFrames, truth: Sequence[RigidTransform | None] = ()
    ) -> KnownSequence:
        """The recording with true poses, as far as they are known."""
        return KnownSequence(
            frames,
            truth or (None,) * len(frames),
            self.configuration,
            self.rig,
            self.plan,
            self.prior,
            self.stage,
            is_simulated=False,
        )


@dataclass(frozen=True, slots=True, eq=False)
class Studied:
    """What came of a recording."""

    name: str
    stage: str
    bone: str
    truth: Truth
    has_times: bool
    known: frozenset[int]  # pictures whose poses can be scored
    scores: dict[Method, SequenceScore]  # with the pictures' own numbers
    leading: Method  # ours, unless it was not asked for
    solved: SolvedFrames | None  # of another tracker, with the leading method's poses
    pictures: tuple[tuple[FrameScore, bytes], ...]  # its worst frames


def study(given: Study, frames: RecordedFrames, methods: Sequence[Method]) -> Studied:
    """Follow the bone with each method, then score all alike.

    Raises:
        ResultError: the truth's own frames cannot be solved.
        SequenceError: a picture cannot be read.
    """
    answers = {method: follow(given.to_sequence(frames), method) for method in methods}
    # The truth of another tracker is solved with poses that the judge calls OK: ours, if it ran.
    leading: Method = OURS if OURS in answers else methods[0]
    poses, solved = _find_truth(given, frames, answers[leading])
    sequence = given.to_sequence(frames, poses)
    scored = {
        method: _score(given, sequence, one, frames.numbers) for method, one in answers.items()
    }
    return Studied(
        given.name,
        given.stage.name,
        given.stage.bone,
        given.truth,
        frames.has_times,
        _find_known(given, frames.numbers, poses),
        {method: _use_picture_numbers(one, frames.numbers) for method, one in scored.items()},
        leading,
        solved,
        tuple(_draw_worst(sequence, answers[leading], scored[leading], frames.numbers)),
    )


def _find_truth(
    given: Study, frames: RecordedFrames, leading: Answers
) -> tuple[list[RigidTransform | None], SolvedFrames | None]:
    """True poses in the pictures, left camera from bone; None where they are not known."""
    truth = given.truth
    if isinstance(truth, DivotTruth):
        return [None] * len(frames), None
    if isinstance(truth, PoseTruth):
        known = truth.poses[given.stage.bone]
        return [known.get(number) for number in frames.numbers], None
    # The first frame is the one that is registered in.
    believed = [None, *(one.pose if one.is_ok else None for one in leading.frames[1:])]
    vertices_mm = given.plan.bones[given.stage.bone].mesh.vertices_mm
    solved = solve_frames(frames.times_ns, believed, truth, vertices_mm)
    return find_poses(solved, truth, frames.times_ns), solved


def _find_known(
    given: Study, numbers: Sequence[int], true: Sequence[RigidTransform | None]
) -> frozenset[int]:
    if isinstance(given.truth, DivotTruth):
        return frozenset(given.truth.numbers)
    return frozenset(number for number, pose in zip(numbers, true, strict=True) if pose)


def _score(
    given: Study, sequence: KnownSequence, answers: Answers, numbers: Sequence[int]
) -> SequenceScore:
    scores = score_answers(sequence, answers, has_budget=False)
    if not isinstance(given.truth, DivotTruth):
        return scores
    touched_mm = measure_divots(answers.poses, numbers, given.truth)
    frames = (replace(one, tre_mm=touched_mm[one.index]) for one in scores.frames)
    return replace(scores, frames=tuple(frames))


def _use_picture_numbers(scores: SequenceScore, numbers: Sequence[int]) -> SequenceScore:
    """Scores with the pictures' numbers as index, instead of their places."""
    frames = tuple(replace(one, index=numbers[one.index]) for one in scores.frames)
    return replace(scores, frames=frames)


def _draw_worst(
    sequence: KnownSequence, answers: Answers, scores: SequenceScore, numbers: Sequence[int]
) -> Iterator[tuple[FrameScore, bytes]]:
    """The largest errors that the judge calls OK; of all poses when it calls none so."""
    known = [one for one in scores.frames if one.tre_mm is not None]
    chosen = [one for one in known if one.is_ok] or known
    chosen.sort(key=lambda one: one.tre_mm or 0.0, reverse=True)
    for one in chosen[:_N_PICTURES]:
        picture = draw_frame(sequence, answers, one.index)
        if picture is not None:
            yield replace(one, index=numbers[one.index]), picture
