"""Operations in which something goes wrong on purpose: the tables of docs/measurements.md.

usage: python -m tests.bench.provoked_failures [--seeds N] [--rate HZ] [--only NAME] [--each]

Transient failures must cost no wrong frame, and tracking has to come back by itself. Persistent
ones must never give an OK frame.
"""

import argparse
import sys
from collections import Counter

import numpy as np

from navapp.tracking import Tracker, make_tracker
from tests.bench.provoked import Event, Shown, Theatre, played

# Not the seeds of any test or default, nor of the other benches.
FIRST_SEED = 141
# Waited for so long after the event, and looked at for so long when the bone is back.
PATIENCE_S, AFTERWARDS_S = 4.5, 1.5
_FAR_MM = 0.25
EVENTS = (
    Event("nothing"),
    Event("60 % covered", covered_share=0.6),
    Event("90 % covered", covered_share=0.9),
    Event("blurred, 2 px", blur_px=2.0),
    Event("blurred, 5 px", blur_px=5.0),
    Event("left blocked", blocked="left"),
    Event("right blocked", blocked="right"),
    Event("lights out", light=0.0),
    Event("dim light", light=0.05),
    Event("jump, 8 mm 5 deg", end_s=1.0, moved_mm=8.0, moved_deg=5.0),
    Event("jump, 14 mm 9 deg", end_s=1.0, moved_mm=14.0, moved_deg=9.0),
    Event("lights out, 14 mm 9 deg", light=0.0, moved_mm=14.0, moved_deg=9.0),
    Event("lights out, 25 mm 16 deg", light=0.0, moved_mm=25.0, moved_deg=16.0),
    Event("lights out, 40 mm 25 deg", light=0.0, moved_mm=40.0, moved_deg=25.0),
    Event("lights out, 60 mm 35 deg", light=0.0, moved_mm=60.0, moved_deg=35.0),
)


def main() -> int:
    """Print a row a seed and event."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--rate", type=float, default=15.0)
    parser.add_argument("--only", default="", help="events whose name contains this")
    parser.add_argument("--each", action="store_true", help="print every frame that is not OK")
    options = parser.parse_args()
    print("| event | seed | frames | OK | OK meanwhile | worst OK | OK again after | longest frame | reasons |")  # fmt: skip  # noqa: E501
    print("|---|" + "---|" * 8)
    for seed in range(FIRST_SEED, FIRST_SEED + options.seeds):
        for event in EVENTS:
            if options.only not in event.name:
                continue
            theatre = Theatre(seed, event)
            tracker = make_tracker(theatre.rig, theatre.bone)
            frames = watched(theatre, tracker, options.rate)
            print(table_row(theatre, frames), flush=True)
            if options.each:
                print_each(frames)
    return 0


def watched(theatre: Theatre, tracker: Tracker, rate_hz: float) -> list[Shown]:
    """All frames until some time after the bone is back."""
    event = theatre.event
    frames: list[Shown] = []
    for one in played(theatre, tracker, rate_hz, event.end_s + PATIENCE_S):
        frames.append(one)
        if one.time_s > event.end_s + back_after_s(event, frames) + AFTERWARDS_S:
            break
    return frames


def back_after_s(event: Event, frames: list[Shown]) -> float:
    """From the event's end to the next OK frame; infinite when there is none."""
    times = [one.time_s for one in frames if one.is_ok and one.time_s >= event.end_s]
    return min(times, default=np.inf) - event.end_s


def table_row(theatre: Theatre, frames: list[Shown]) -> str:
    """Figures of one sequence."""
    event = theatre.event
    ok = [one for one in frames if one.is_ok]
    meanwhile = [one for one in frames if event.is_on(one.time_s)]
    reasons = Counter(
        one.tracked.verdict.reasons[0].value for one in frames if one.tracked.verdict.reasons
    )
    said = ", ".join(f"{reason} ({n})" for reason, n in reasons.most_common(3))
    worst_mm = max((one.tre_mm for one in ok), default=np.nan)
    return (
        f"| {event.name} | {theatre.seed} | {len(frames)} | {len(ok)} | "
        f"{sum(one.is_ok for one in meanwhile)} of {len(meanwhile)} | {worst_mm:.2f} mm | "
        f"{back_after_s(event, frames):.2f} s | {max(one.took_ms for one in frames[1:]):.0f} ms | "
        f"{said or '-'} |"
    )


def print_each(frames: list[Shown]) -> None:
    """What became of every frame that is not OK, or not so near."""
    for one in frames:
        if not one.is_ok or one.tre_mm > _FAR_MM:
            verdict = one.tracked.verdict
            said = "; ".join(reason.name for reason in verdict.reasons)
            bound_mm = verdict.predicted_tre_mm or np.nan
            print(
                f"    {one.time_s:.2f} s {verdict.status.value} {one.tre_mm:.2f} mm "
                f"bound {bound_mm:.2f} "
                f"cov {verdict.coverage:.2f} hid {verdict.occluded_fraction:.2f} "
                f"in {verdict.inlier_fraction:.2f} {one.took_ms:.0f} ms {said}"
            )


if __name__ == "__main__":
    sys.exit(main())
