"""The truth of a replayed recording: errors of its frames, joined with them after they are told."""

import argparse
from collections.abc import Mapping
from contextlib import closing
from typing import TYPE_CHECKING

from navapp.cli.results import frame_text
from navapp.errors import UsageError

if TYPE_CHECKING:
    from navapp.control.frame_result import FrameResult
    from navapp.evaluation.recording.truth_files import PoseTruth, Truth
    from navapp.values import Plan


def read_replay_truth(options: argparse.Namespace, plan: "Plan", bone: str) -> "ReplayTruth | None":
    """The file of `--truth`; None without it.

    Args:
        options: of the replay.
        plan: with the bones and their targets.
        bone: that the first stage follows.

    Raises:
        InputError: it cannot be read, or does not fit the recording.
        UsageError: it holds no poses of bones.
    """
    from navapp.evaluation.recording.truth_files import PoseTruth, read_truth

    if options.truth is None:
        return None
    truth = read_truth(options.truth)
    if not isinstance(truth, PoseTruth):
        raise UsageError(
            f"truth {options.truth} holds no poses of bones",
            subject=options.truth,
            remedy="score the recording with `navapp evaluate --recording`",
        )
    check_recorded_truth(
        truth, options.truth, options.sequence, bone, is_split=options.split is not None
    )
    return ReplayTruth(truth, plan)


def check_recorded_truth(
    truth: "Truth", path: str, recording: str, bone: str, *, is_split: bool = False
) -> None:
    """Refuse a truth that does not fit a recording, before any of its pictures is read.

    Args:
        truth: of the recording.
        path: of the truth, for messages.
        recording: folder or videos.
        bone: that is followed.
        is_split: one video holds both pictures.

    Raises:
        InputError: it speaks of pictures that there are not, or not of the bone.
    """
    from drivers.replay_camera import open_source
    from navapp.evaluation.recording.truth_files import check_truth

    with closing(open_source(recording, is_split)) as source:
        check_truth(truth, path, source.numbers, bone)


class ReplayTruth:
    """Tells the errors of frames; no session sees it.

    Args:
        truth: of the recording.
        plan: with the bones and their targets.
    """

    def __init__(self, truth: "PoseTruth", plan: "Plan") -> None:
        self._truth, self._plan = truth, plan

    def measure(self, result: "FrameResult") -> Mapping[str, float | None]:
        """Bone -> target registration error in mm, of the bones whose pose and truth are known."""
        from navapp.control.stages import stage_of
        from navapp.evaluation import compute_mean_tre_mm

        answers = [(result.stage, result.tracked)]
        answers += [
            (stage_of(name, self._plan), tracked) for name, tracked in result.others.items()
        ]
        errors_mm: dict[str, float | None] = {}
        for stage, tracked in answers:
            pose = None if tracked is None else tracked.left_from_bone
            true = self._truth.poses.get(stage.bone, {}).get(result.frame.index)
            if pose is not None and true is not None:
                bone, targets_mm = (
                    self._plan.bones[stage.bone],
                    self._plan.targets_of(stage.targets),
                )
                errors_mm[stage.bone] = compute_mean_tre_mm(pose, true, bone, targets_mm)
        return errors_mm

    def tell(self, result: "FrameResult") -> str:
        """A frame for people, with its errors."""
        told = [
            f"TRE of the {bone} {error_mm:.3f} mm"
            for bone, error_mm in self.measure(result).items()
            if error_mm is not None
        ]
        return "; ".join([frame_text(result), *told])
