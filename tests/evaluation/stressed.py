"""Levels of an axis with scores by hand."""

from collections.abc import Mapping, Sequence

from navapp.evaluation.campaign import Done
from navapp.evaluation.scores import FrameScore
from navapp.evaluation.stress.matrix import StressTest
from tests.evaluation.scored import followed


def stressed(
    axis_name: str, levels: Mapping[float, Sequence[Sequence[FrameScore]]]
) -> list[Done[StressTest]]:
    """Of each level the frames of some knees."""
    return [
        Done(StressTest(axis_name, level, knee, 1 + knee), {"bimcc": followed(*frames)})
        for level, knees in levels.items()
        for knee, frames in enumerate(knees)
    ]
