"""Every state of the simulated operation: poses of its own bone, their bounds, cuts and holes.

usage: python -m tests.bench.stages [--knees N] [--first SEED] [--only STATE] [--frames]

Each knee and state is a session of `navapp run --headless --stage ...`, which begins as the stage
is usually entered; a script registers the bone and confirms what is made beyond that, so that the
room shows it. Judged are the last 16 frames, all of the state. Knees differ in seed, side, sex and
age; saw and drill miss as usual. The leg breathes.

The room's caliper reads the thickness of the sawn patella (docs/devices.md).
"""

import argparse
import json
import tempfile
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from navapp.cli.main import run

# Known to no test and no choice of a constant.
FIRST_SEED = 3201
_N_JUDGED = 16
_SIDES, _SEXES, _AGES = ("right", "left"), ("female", "male"), ("young", "middle", "old")
# Of a face of which most is seen.
_MOSTLY_SEEN = 0.6


@dataclass(frozen=True)
class State:
    """One state of the operation."""

    name: str
    bone: str
    stage: str
    made: tuple[str, ...] = ()  # confirmed beyond the stage's entry
    after: int = 8  # frames: faces that a part will cover are measured before


STATES = (
    State("intact", "femur", "opening"),
    State("drilled", "femur", "drilling", (), 24),
    State("cut", "femur", "implant"),
    State("metal", "femur", "implant", ("femoral_implant",), 90),
    State("whole", "patella", "patella"),
    State("cut", "patella", "patella", ("patella",)),
    State("button", "patella", "patella", ("patella", "patellar_implant")),
    State("cut", "tibia", "spacer"),
    State("insert", "tibia", "spacer", ("spacer",), 30),
)


@dataclass
class Found:
    """What the sessions of a state have found."""

    n_frames: int = 0
    reasons: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    errors_mm: list[float] = field(default_factory=list)  # of OK frames
    bounds_mm: list[float] = field(default_factory=list)


def knee_options(seed: int) -> str:
    """The patient of a seed."""
    side, sex, age = _SIDES[seed % 2], _SEXES[seed // 2 % 2], _AGES[seed % 3]
    return (
        f"[camera.simulated]\nseed = {seed}\nside = '{side}'\nsex = '{sex}'\nage_group = '{age}'\n"
    )


def run_state(state: State, seed: int, folder: Path) -> dict[str, Any]:
    """The result of one session."""
    script = "[[step]]\ndo = 'register'\n[[step]]\ndo = 'wait'\nuntil = 'navigating'\n"
    for k, name in enumerate(state.made):
        script += f"[[step]]\ndo = 'made'\nname = '{name}'\nat_frame = {state.after + k}\n"
    config, operator, result = (folder / name for name in ("c.toml", "s.toml", "r.json"))
    config.write_text(knee_options(seed), encoding="utf-8")
    operator.write_text(script, encoding="utf-8")
    n_frames = state.after + len(state.made) + _N_JUDGED + 4
    arguments = ["--config", str(config), "--quiet", "run", "--headless", "--stage", state.stage]
    arguments += ["--operator", str(operator), "--frames", str(n_frames), "--json", str(result)]
    result.unlink(missing_ok=True)
    run(arguments)
    told: dict[str, Any] = json.loads(result.read_text(encoding="utf-8"))
    return told


def judge(found: Found, state: State, frames: Sequence[dict[str, Any]]) -> None:
    """Count the last frames of a session that show its state; what is missing is not OK."""
    if not frames:
        found.n_frames += _N_JUDGED
        return
    shown = frames[state.after :]
    if state.made:  # before the last step was made the bone was another one
        shown = [frame for frame in frames if frame["bone_version"] == frames[-1]["bone_version"]]
    found.n_frames += max(0, _N_JUDGED - len(shown))
    for frame in shown[-_N_JUDGED:]:
        found.n_frames += 1
        if frame["status"] != "OK":
            for reason in frame["reasons"]:
                found.reasons[reason] += 1
            continue
        found.errors_mm.append(frame["tre_mm"])
        found.bounds_mm.append(frame["predicted_tre_mm"])


def tell(name: str, found: Found) -> str:
    """A row of the table."""
    if not found.errors_mm:
        why = max(found.reasons, key=lambda reason: found.reasons[reason], default="-")
        return f"| {name} | 0 of {found.n_frames} | - | - | - | - | - | {why} |"
    error, bound = np.array(found.errors_mm), np.array(found.bounds_mm)
    why = max(found.reasons, key=lambda reason: found.reasons[reason], default="")
    return (
        f"| {name} | {len(error)} of {found.n_frames} | {np.median(error):.3f} | "
        f"{np.percentile(error, 95):.3f} | {error.max():.3f} | {np.mean(error <= bound):.3f} | "
        f"{np.median(bound) / np.median(error):.1f} | {why} |"
    )


Measured = list[tuple[dict[str, Any], dict[str, Any]]]


def measured_of(told: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any], dict[str, Any]]]:
    """Name, measurement and its error of every measured face and hole of a session."""
    for step in told.get("operation", ()):
        if step["error"] is not None:
            yield step["step"], step["measured"], step["error"]


def tell_measured(measured: dict[str, Measured]) -> Iterator[str]:
    """Rows of the table: angle between normals, offset at the planned point; holes across."""
    yield (
        "| measured | sessions | mostly seen | angle off: median, worst deg "
        "| offset off: median, worst mm | bounds cover |"
    )
    yield "|---|---|---|---|---|---|"
    for name, found in measured.items():
        offset = np.array([error["mm"] for _, error in found])
        covers = offset <= [one["bound_mm"] for one, _ in found]
        angles = "-"
        if found[0][1]["deg"] is not None:
            angle = np.array([error["deg"] for _, error in found])
            covers &= angle <= [one["bound_deg"] for one, _ in found]
            angles = f"{np.median(angle):.2f}, {angle.max():.2f}"
        n_seen = sum(one["seen_share"] >= _MOSTLY_SEEN for one, _ in found)
        yield (
            f"| {name} | {len(found)} | {n_seen} | {angles} | "
            f"{np.median(offset):.3f}, {offset.max():.3f} | {np.mean(covers):.2f} |"
        )


def main() -> None:
    """Run it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--knees", type=int, default=10)
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    parser.add_argument("--only", default="", help="states whose bone and name contain this")
    parser.add_argument("--frames", action="store_true", help="a line a session")
    options = parser.parse_args()
    results: dict[str, Found] = {}
    measured: dict[str, Measured] = defaultdict(list)
    states = [one for one in STATES if options.only in f"{one.bone} {one.name}"]
    with tempfile.TemporaryDirectory() as folder:
        for state in states:
            found = results.setdefault(f"{state.bone} {state.name}", Found())
            for seed in range(options.first, options.first + options.knees):
                told = run_state(state, seed, Path(folder))
                made = {step["step"] for step in told.get("operation", ()) if step["made"]}
                judge(found, state, told["frames"] if made.issuperset(state.made) else [])
                for name, one, error in measured_of(told):
                    measured[name].append((one, error))
                if options.frames:
                    alone = Found()
                    judge(alone, state, told["frames"])
                    print(tell(f"{state.bone} {state.name} {seed}", alone), flush=True)
    print("| state | OK | TRE median mm | 95 % | worst | bound holds | bound / error | most told |")
    print("|---|---|---|---|---|---|---|---|")
    pooled = Found()
    for name, found in results.items():
        print(tell(name, found))
        pooled.n_frames += found.n_frames
        pooled.errors_mm += found.errors_mm
        pooled.bounds_mm += found.bounds_mm
    print(tell("all", pooled))
    print()
    for line in tell_measured(measured):
        print(line)


if __name__ == "__main__":
    main()
