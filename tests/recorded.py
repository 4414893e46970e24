"""Frames of a recorded sequence, and their true poses."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import cv2

from navapp.evaluation.recording.truth_files import PoseTruth, read_truth
from navapp.geometry.rectification import Image
from navapp.geometry.transform import RigidTransform


class RecordedFrame(NamedTuple):
    """A pair of colour pictures, (H, W, 3) each, and where the bone was."""

    number: int  # in the names of its files
    left: Image
    right: Image
    truth: RigidTransform  # left camera from bone


def read_frames(sequence: Path, bone: str = "femur") -> Iterator[RecordedFrame]:
    """All frames of a folder of which its `truth.json` speaks, in the order of their numbers."""
    for number, pose in sorted(read_true_poses(sequence, bone).items()):
        left, right = (read_picture(sequence, eye, number) for eye in ("left", "right"))
        yield RecordedFrame(number, left, right, pose)


def read_true_poses(sequence: Path, bone: str = "femur") -> Mapping[int, RigidTransform]:
    """Poses (left camera from bone) that a folder's `truth.json` tells, by the frame's number."""
    truth = read_truth(sequence / "truth.json")
    assert isinstance(truth, PoseTruth)
    return truth.poses[bone]


def read_picture(sequence: Path, name: str, number: int) -> Image:
    """One picture of a frame: an eye's, or a mask, in three channels."""
    picture = cv2.imread(str(next(sequence.glob(f"{name}_{number:04d}.*"))), cv2.IMREAD_COLOR)
    assert picture is not None, f"no picture: {name} {number} in {sequence}"
    return picture
