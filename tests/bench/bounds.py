"""Errors of OK poses beside their bounds, by stage and situation, on the seeds of all choices.

usage: python -m tests.bench.bounds [--stage STAGE] [--situation NAME] [--knees N] [--frames N]
                                     [--first SEED] [--highlights X] [--misses X]
                                     [--knee-rows]

The production tracker on simulated knees as `navapp evaluate` has them, of other seeds: what the
judge's constants were chosen on. `navapp evaluate` reports on seeds that no choice has seen.
"""

import argparse

import numpy as np

from navapp.control.stages import STAGES
from navapp.evaluation.following import follow
from navapp.evaluation.paper.cases import SAMPLES, SITUATIONS, Case, CaseTest, SituationName
from navapp.evaluation.scores import FrameScore
from navapp.evaluation.scoring import score_answers
from navapp.evaluation.sequence import KnownSequence, render_room

FIRST_SEED = 2_000_301


def main() -> None:
    """Print a row for each stage and situation, and one for all of them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--stage", help="one only")
    parser.add_argument("--situation", default="overlay", help="or all")
    parser.add_argument("--knees", type=int, default=12)
    parser.add_argument("--frames", type=int, default=6)
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    parser.add_argument("--highlights", type=float, default=1.0, help="times the usual area")
    parser.add_argument("--misses", type=float, default=1.0, help="of saw and drill, times usual")
    parser.add_argument("--knee-rows", action="store_true", help="a row for each knee as well")
    options = parser.parse_args()
    print(
        "| stage | situation | frames | OK | TRE mean mm | worst mm | within | bound over error |"
    )
    print("|---|---|---|---|---|---|---|---|")
    every: list[FrameScore] = []
    for stage in STAGES:
        if options.stage not in (None, stage.name):
            continue
        for situation in SITUATIONS:
            if options.situation in ("all", situation):
                every += _judge_cell(stage.name, situation, options)
    print(_row("all", "", every))


def render_knee(
    stage: str,
    situation: SituationName,
    number: int,
    first_seed: int,
    n_frames: int,
    highlights: float,
    misses: float = 1.0,
) -> KnownSequence:
    """A knee as `navapp evaluate` has them; with so many times the usual highlights and misses."""
    samples = tuple(SAMPLES)
    case = Case(samples[number % len(samples)], stage, situation)
    usual = CaseTest(case, number, first_seed + number).configure()
    simulated = usual.camera.simulated.model_copy(
        update={"highlights": highlights, "misses": misses}
    )
    camera = usual.camera.model_copy(update={"simulated": simulated})
    return render_room(usual.model_copy(update={"camera": camera}), stage, n_frames)


def _judge_cell(
    stage: str, situation: SituationName, options: argparse.Namespace
) -> list[FrameScore]:
    frames: list[FrameScore] = []
    for number in range(options.knees):
        sequence = render_knee(
            stage, situation, number, options.first, options.frames + 1, options.highlights,
            options.misses,
        )  # fmt: skip
        answers = follow(sequence, "bimcc")
        found = score_answers(sequence, answers, has_budget=False).frames
        if options.knee_rows:
            print(_row(f"{stage} {options.first + number}", situation, found), flush=True)
        frames += found
    print(_row(stage, situation, frames), flush=True)
    return frames


def _row(stage: str, situation: str, frames: list[FrameScore] | tuple[FrameScore, ...]) -> str:
    ok = [one for one in frames if one.is_ok]
    errors = np.array([one.tre_mm for one in ok], dtype=float)
    bounds = np.array([one.bound_mm for one in ok], dtype=float)
    if not ok:
        return f"| {stage} | {situation} | {len(frames)} | 0 | | | | |"
    return (
        f"| {stage} | {situation} | {len(frames)} | {len(ok)} | {errors.mean():.3f} | "
        f"{errors.max():.2f} | {100.0 * np.mean(errors <= bounds):.0f} % | "
        f"{np.median(bounds) / np.median(errors):.1f} |"
    )


if __name__ == "__main__":
    main()
